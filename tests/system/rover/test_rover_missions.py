"""A rover's missions: backwards where an item says so, stopped before what stands in the way, and what it refuses."""

from math import nan

import numpy as np
import pytest

from common.attitude import wrapped
from common.geodesy import geodetic_from_ned
from mission.client import MissionRefused
from mission.plan.plan_file import PlanItem
from sim.world.world import WorldConfig
from tests.system.rover.walled import WALL_M, driven

KEEP_M = 1.0
WAYPOINT, SET_REVERSE = 16, 194
HOME_FRAME, NO_FRAME = 3, 2
OPEN = WorldConfig(trees_per_ha=0.0, hill_height_m=0.0)


def plan(origin, *items):
    """Waypoints from pairs of north and east [m], other items from command and first parameters."""
    made = []
    for i, item in enumerate(items):
        if isinstance(item, tuple):
            lat_deg, lon_deg, _ = geodetic_from_ned(*item, 0.0, origin)
            made.append(PlanItem(i, HOME_FRAME, WAYPOINT, (0.0, 0.0, 0.0, nan), lat_deg, lon_deg, 0.0))
        else:
            command, *params = item
            params = (*params, *[0.0] * (4 - len(params)))
            made.append(PlanItem(i, NO_FRAME, command, tuple(params), 0.0, 0.0, 0.0))
    return made


async def drive_plan(drone, *items, seconds=100.0):
    await drone.upload(plan(drone.origin, *items))
    await drone.start_mission()
    await drone.until(lambda: drone.is_mission_complete, seconds, "finished")


def yaws(history):
    x, y, z, w = history.q_true.T
    return np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


@pytest.mark.parametrize("airframe", ["rover", "rover-skid"])
def test_legs_after_an_item_that_says_so_are_driven_backwards(airframe):
    """As ArduPilot's DO_SET_REVERSE: tail first until an item says otherwise."""
    marks = []

    async def script(drone):
        await drive_plan(drone, (15.0, 0.0), [SET_REVERSE, 1.0], (0.0, 0.0), [SET_REVERSE, 0.0], (0.0, 15.0))
        marks.append(drone.pos_ned)

    _, history = driven(script, airframe=airframe, world=OPEN)
    north, east = history.pos_ned_true[:, :2].T
    velocity, yaw = history.vel_ned_true[:, :2], yaws(history)
    along = np.cos(yaw) * velocity[:, 0] + np.sin(yaw) * velocity[:, 1]
    is_back = (north > 4.0) & (north < 11.0) & (velocity[:, 0] < -0.3)
    assert is_back.sum() > 50
    assert (along[is_back] < 0.0).all()
    assert max(abs(wrapped(float(angle))) for angle in yaw[is_back]) < 0.3
    assert along[east > 8.0].min() > -0.1
    assert np.hypot(marks[0][0], marks[0][1] - 15.0) < 1.5


@pytest.mark.parametrize("airframe", ["rover", "rover-skid"])
def test_a_pause_on_a_leg_backwards_stops_it_straight_and_it_goes_on_backwards(airframe):
    headings, speeds = [], []

    async def script(drone):
        def note():
            attitude = drone.latest("ATTITUDE")
            headings.append(attitude.yaw)
            speeds.append(drone.latest("LOCAL_POSITION_NED").vy * np.sin(attitude.yaw))

        await drone.upload(plan(drone.origin, (5.0, 0.0), [SET_REVERSE, 1.0], (5.0, 30.0)))
        await drone.start_mission()
        await drone.until(lambda: drone.pos_ned[1] > 8.0, 60.0, "on the leg")
        note()
        await drone.hold()
        for _ in range(40):
            await drone.sleep(0.1)
            note()
        await drone.start_mission(drone.latest("MISSION_CURRENT").seq)
        await drone.sleep(3.0)
        note()
        await drone.hold()
        await drone.sleep(4.0)
        await drone.goto_ned(drone.pos_ned[0], drone.pos_ned[1] - 12.0, 0.0)

    _, history = driven(script, airframe=airframe, world=OPEN)
    turned = [abs(wrapped(yaw - headings[0])) for yaw in headings]
    assert max(turned) < 0.26
    assert speeds[0] < -0.5
    assert speeds[-1] < -0.5
    velocity, yaw = history.vel_ned_true[:, :2], yaws(history)
    along = np.cos(yaw) * velocity[:, 0] + np.sin(yaw) * velocity[:, 1]
    assert along[-400:].max() > 0.5  # what it was sent to in Hold is driven forwards again


def test_to_drive_backwards_is_refused_where_it_means_nothing():
    async def script(drone):
        with pytest.raises(MissionRefused, match=r"parameter 1 is 2\.0, not 0"):
            await drone.upload(plan(drone.origin, (15.0, 0.0), [SET_REVERSE, 2.0]))

    async def flown(drone):
        with pytest.raises(MissionRefused, match="command 194 is for vehicles that drive"):
            await drone.upload(plan(drone.origin, (15.0, 0.0), [SET_REVERSE, 1.0]))

    driven(script, world=OPEN)
    driven(flown, world=OPEN, airframe="x500")


def test_a_mission_stops_before_a_wall_that_stands_in_its_way():
    stops = []

    async def script(drone):
        await drone.upload(plan(drone.origin, (40.0, 0.0)))
        await drone.start_mission()
        await drone.sleep(25.0)
        stops.append(drone.pos_ned[0])

    texts, history = driven(script, CP_DIST=KEEP_M)
    assert WALL_M - KEEP_M - 1.2 < stops[0] < WALL_M - KEEP_M
    assert np.hypot(*history.vel_ned_true[-50:, :2].T).max() < 0.1
    assert texts.count("Obstacle ahead: stopped") == 1


def test_a_return_waits_until_its_way_is_free():
    places = []

    async def script(drone):
        async def report(distance_cm, seconds):
            for _ in range(round(10.0 * seconds)):
                drone.send("OBSTACLE_DISTANCE", time_usec=0, sensor_type=0, distances=[distance_cm] * 72, increment=5,
                           min_distance=10, max_distance=1000, increment_f=0.0, angle_offset=0.0, frame=12)  # fmt: skip
                await drone.sleep(0.1)

        free = drone.start(report(1001, 30.0))
        await drone.goto_ned(15.0, 0.0, 0.0)
        free.cancel()
        await drone.return_home()
        for distance_cm, seconds in ((60, 8.0), (1001, 40.0)):
            await report(distance_cm, seconds)
            places.append(drone.pos_ned[0])

    driven(script, has_lidar=False, world=OPEN, CP_DIST=KEEP_M)
    assert places[0] > 13.5
    assert places[1] < 1.5
