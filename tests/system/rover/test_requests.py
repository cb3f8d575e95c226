"""What clients ask of a rover beside what ArduPilot's tests ask: places beside it, reverse, ways that do not exist."""

from dataclasses import replace
from math import hypot

import numpy as np
import pytest

from autopilot.interface.vehicle_state import Mode
from common.attitude import wrapped
from common.geodesy import geodetic_from_ned
from mission.client import CommandRefused
from tests.system.published.published_rules import Flown
from tests.system.published.rover_station import (
    CIRCLE,
    DOCK,
    FOLLOW,
    HOLD,
    POSITION,
    SET_REVERSE,
    VELOCITY,
    Rover,
)
from tests.system.published.test_published_fences import polygon
from tests.system.published.test_published_rover import FRONT_M

EXCLUSION, FENCE = 5002, 1
NO_WAY = "Guided: there is no way to the target inside the fence"
RING = [
    ((10.0, -20.0), (10.0, 20.0), (13.0, 20.0), (13.0, -20.0)),
    ((30.0, -20.0), (30.0, 20.0), (33.0, 20.0), (33.0, -20.0)),
    ((9.0, -23.0), (9.0, -18.0), (34.0, -18.0), (34.0, -23.0)),
    ((9.0, 18.0), (9.0, 23.0), (34.0, 23.0), (34.0, 18.0)),
]


@pytest.mark.parametrize("target", [(-0.5, 0.0), (-0.8, 0.1), (-1.5, 0.0)])
def test_a_dock_behind_it_is_not_backed_into(target):
    rover = Rover(HG_RO_DOCK_STP=0.0)

    async def script(client):
        await rover.armed()
        start = rover.flown.pos
        dock = (start[0] + target[0], start[1] + target[1])
        gap_m = rover.away(*dock)
        client.start(rover.shows_dock(*target))
        await client.sleep(1.0)
        await rover.mode(DOCK)
        for _ in range(20):
            await client.sleep(0.1)
            assert rover.away(*dock) > gap_m - 0.05
        await client.until(lambda: rover.said("Docked"), 60.0, "docked")

    rover.run(script)


def test_what_turns_on_the_spot_shows_its_front_to_a_dock_beside_it():
    rover = Rover("rover-skid")

    async def script(client):
        await rover.armed()
        start = rover.flown.pos
        client.start(rover.shows_dock(0.0, 0.6))
        await client.sleep(1.0)
        await rover.mode(DOCK)
        await client.until(lambda: rover.said("Docked"), 30.0, "docked")
        await client.sleep(1.0)
        here = rover.flown.pos
        assert abs(rover.turned_deg(np.arctan2(start[1] + 0.6 - here[1], start[0] - here[0]))) < 20.0

    rover.run(script)


@pytest.mark.parametrize("target", [(0.5, 1.3), (-0.2, -1.0), (-3.0, 0.5), (-12.0, 4.0)])
@pytest.mark.parametrize("airframe", ["rover", "rover-skid"])
def test_a_dock_beside_or_behind_it_is_come_to_with_the_front(airframe, target):
    rover = Rover(airframe, HG_RO_DOCK_STP=0.0)

    async def script(client):
        await rover.armed()
        start = rover.flown.pos
        dock = (start[0] + target[0], start[1] + target[1])
        client.start(rover.shows_dock(*target))
        await client.sleep(1.0)
        await rover.mode(DOCK)
        await client.until(lambda: rover.said("Docked"), 60.0, "docked")
        await client.sleep(3.0)
        off_deg = rover.turned_deg(np.arctan2(dock[1] - rover.flown.pos[1], dock[0] - rover.flown.pos[0]))
        assert abs(off_deg) < 60.0
        assert rover.away(*dock) - FRONT_M < 0.3
        assert abs(rover.speed) < 0.05

    rover.run(script)


def test_a_dock_lost_from_sight_is_waited_for():
    rover = Rover()

    async def script(client):
        await rover.armed()
        seen = client.start(rover.shows_dock(30.0, 0.0))
        await client.sleep(1.0)
        await rover.mode(DOCK)
        await client.sleep(4.0)
        assert rover.speed == pytest.approx(0.5, abs=0.1)
        seen.cancel()
        await client.until(lambda: rover.said("Dock: target lost, waiting"), 10.0, "lost")
        await client.sleep(3.0)
        assert abs(rover.speed) < 0.05
        client.start(rover.shows_dock(30.0, 0.0))
        await client.sleep(5.0)
        assert rover.speed == pytest.approx(0.5, abs=0.1)

    rover.run(script)


@pytest.mark.parametrize("beside", [(0.0, 3.0), (-1.5, -0.8), (6.0, 0.0)])
def test_a_place_beside_somebody_who_stands_is_gone_to_and_kept(beside):
    rover = Rover(FLW_TGT_DST=2.0)

    async def script(client):
        await rover.armed()
        somebody = rover.flown.pos[:2] + np.array(beside)
        await rover.mode(FOLLOW)
        for k in range(600):
            rover.tell_target(somebody, (0.0, 0.0))
            await client.sleep(0.1)
            if k == 400:
                begin_s = rover.flown.now_s
        rows = rover.flown.since(begin_s)
        assert hypot(*(rover.flown.pos[:2] - somebody)) == pytest.approx(2.0, abs=0.6)
        assert np.hypot(*rows[:, 4:6].T).max() < 0.15

    rover.run(script)


def test_it_backs_away_from_somebody_who_comes_nearer_without_turning_round():
    rover = Rover(FLW_TGT_DST=4.0, FLW_TGT_FA=0.0)

    async def script(client):
        await rover.armed()
        somebody = rover.flown.pos[:2] + np.array((4.0, 0.0))
        await rover.mode(FOLLOW)
        for _ in range(150):
            somebody -= np.array((0.08, 0.0))
            rover.tell_target(somebody, (-0.8, 0.0))
            await client.sleep(0.1)
        assert rover.speed == pytest.approx(-0.8, abs=0.25)
        assert abs(rover.turned_deg(0.0)) < 45.0

    rover.run(script)


def test_reverse_stays_where_a_place_is_asked_for_in_hold():
    flown = Flown(config={"airframe": "rover"})

    async def script(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.command(SET_REVERSE, 1.0, name="reverse")
        yaw = flown.state.yaw_rad
        await drone.goto_ned(-20.0, 0.0, 0.0, timeout_s=30.0)
        assert abs(wrapped(flown.state.yaw_rad - yaw)) < 0.3
        assert flown.home_distance_m > 19.0

    flown.run(script, 120.0)


def test_a_streamed_place_without_a_way_is_refused_once_and_not_driven_to():
    rover = Rover()

    async def script(client):
        await exclude(client, RING)
        await rover.armed()
        await rover.target(POSITION, 10.0, x=21.0, y=0.0)
        assert client.texts.count(NO_WAY) == 1
        assert hypot(*rover.flown.pos[:2]) < 2.0
        await rover.target(VELOCITY, 3.0, vx=0.0, vy=1.0)
        await rover.target(POSITION, 1.0, x=21.0, y=0.0)
        assert client.texts.count(NO_WAY) == 2

    rover.run(script)


async def exclude(client, corners):
    """Uploads a fence of polygons that exclude, and switches it on; none: switches it off."""
    fence = [item for polygon_corners in corners for item in polygon(polygon_corners, EXCLUSION)]
    await client.upload([replace(item, seq=i) for i, item in enumerate(fence)], FENCE)
    await client.set_parameter("FENCE_ENABLE", 1 if corners else 0)


def test_a_streamed_place_is_not_planned_for_each_message():
    rover = Rover()

    async def script(client):
        await rover.armed()
        context = rover.flown.flight.controller.navigator.context
        find_path, asked = context.find_path, []
        context.find_path = lambda start, goal: asked.append(goal) or find_path(start, goal)
        await rover.target(POSITION, 20.0, x=20.0, y=10.0)
        assert len(asked) <= 21
        assert rover.away(20.0, 10.0) < 1.0

    rover.run(script)


def test_a_streamed_place_is_driven_to_round_a_fence_that_comes_later():
    rover = Rover()

    async def script(client):
        await rover.armed()
        await rover.target(POSITION, 1.0, x=25.0, y=0.0)
        await exclude(client, [((10.0, -4.0), (10.0, 4.0), (14.0, 4.0), (14.0, -4.0))])
        await rover.target(POSITION, 40.0, x=25.0, y=0.0)
        assert rover.away(25.0, 0.0) < 1.0
        north, east = rover.flown.since(0.0)[:, 1:3].T
        assert not ((north > 10.0) & (north < 14.0) & (np.abs(east) < 4.0)).any()

    rover.run(script)


def test_a_refused_place_is_driven_to_once_nothing_forbids_it():
    rover = Rover()

    async def script(client):
        await exclude(client, RING)
        await rover.armed()
        await rover.target(POSITION, 5.0, x=21.0, y=0.0)
        assert hypot(*rover.flown.pos[:2]) < 2.0
        await exclude(client, [])
        await rover.target(POSITION, 20.0, x=21.0, y=0.0)
        assert rover.away(21.0, 0.0) < 1.0

    rover.run(script)


def test_a_circle_smaller_than_it_can_turn_is_made_larger():
    rover = Rover(HG_RO_CIRC_RAD=0.5, HG_RO_CIRC_SPD=0.5)

    async def script(client):
        await rover.armed()
        await rover.mode(CIRCLE)
        await client.sleep(10.0)
        begin_s = rover.flown.now_s
        await client.sleep(25.0)
        track = rover.flown.since(begin_s)[:, 1:3]
        sizes = track.max(axis=0) - track.min(axis=0)
        assert (sizes > 1.6).all()
        assert (sizes < 4.0).all()

    rover.run(script)


@pytest.mark.parametrize("none", [-1.0, 0.0])
def test_no_limits_of_braking_and_jerk_are_no_trouble(none):
    """PX4's -1: it goes, stops where it was to, and keeps its distance to what is in its way."""
    rover = Rover(RO_DECEL_LIM=none, RO_JERK_LIM=none, RO_ACCEL_LIM=none)

    async def script(client):
        await rover.armed()
        await rover.target(POSITION, x=25.0, y=10.0)
        await rover.there(25.0, 10.0, 0.5)
        await client.sleep(2.0)
        assert rover.away(25.0, 10.0) < 0.8
        await rover.target(VELOCITY, 4.0, vx=3.0)
        await rover.mode(HOLD)
        await client.sleep(3.0)
        assert abs(rover.speed) < 0.1

    rover.run(script)


ORBIT = 34


@pytest.mark.parametrize("airframe", ["rover", "rover-skid"])
@pytest.mark.parametrize("radius_m", [6.0, -6.0])
def test_an_orbit_of_so_many_turns_is_driven_and_then_held(airframe, radius_m):
    """DO_ORBIT in PX4's dialect: negative is counter-clockwise, parameter 4 is the angle in all."""
    flown = Flown(config={"airframe": airframe})
    centre, ends = (10.0, 0.0), []

    async def script(drone):
        await drone.wait_ready()
        await drone.arm()
        lat_deg, lon_deg, alt_m = geodetic_from_ned(*centre, 0.0, drone.origin)
        place = round(lat_deg * 1e7), round(lon_deg * 1e7), alt_m
        await drone.command_int(ORBIT, 0, (radius_m, 1.5, 3.0, 4.0 * np.pi), *place, name="orbit")
        await drone.until(lambda: flown.state.mode is Mode.HOLD, 120.0, "held")
        await drone.sleep(3.0)
        ends.append(abs(flown.state.estimate.vel_ned[0]))

    flown.run(script, 200.0)
    rows = np.array(flown.rows)
    off = rows[:, 1:3] - centre
    is_round = np.abs(np.hypot(*off.T) - abs(radius_m)) < 0.7
    bearing = np.unwrap(np.arctan2(off[is_round, 1], off[is_round, 0]))
    assert np.sign(radius_m) * (bearing[-1] - bearing[0]) == pytest.approx(4.0 * np.pi, abs=1.0)
    assert ends[0] < 0.1


@pytest.mark.parametrize(("radius_m", "speed"), [(0.3, 1.0), (5.0, 40.0), (2000.0, 1.0)])
def test_a_circle_that_cannot_be_driven_is_refused(radius_m, speed):
    flown = Flown(config={"airframe": "rover"})

    async def script(drone):
        await drone.wait_ready()
        await drone.arm()
        with pytest.raises(CommandRefused):
            await drone.command_int(ORBIT, 0, (radius_m, speed, 3.0, 0.0), 0, 0, 0.0, name="orbit")

    flown.run(script, 60.0)
