"""A hexarotor whose motors fail in flight: it flies on without them. Tolerances are PX4's, where it has any."""

from itertools import pairwise
from math import nan

import numpy as np
import pytest

from autopilot.interface.item_lists import MissionItem
from autopilot.interface.vehicle_state import Mode
from common.geodesy import geodetic_from_ned
from mission.flight import Flight, FlightConfig
from sim.world.world import WorldConfig

INJECT, TAKEOFF, WAYPOINT, LAND = 420, 22, 16, 21
ABOVE_HOME = 6  # MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
MOTOR, OK, OFF = 101, 0, 1
HEIGHT_M, SIDE_M = 10.0, 20.0
CORNERS = [(0.0, 0.0), (SIDE_M, 0.0), (SIDE_M, SIDE_M), (0.0, SIDE_M), (0.0, 0.0)]


def make_flight(**params):
    return Flight(
        FlightConfig(
            airframe="f550",
            seed=1,
            wind_m_s=5.0,
            world=WorldConfig(trees_per_ha=0.0),
            parameters={"SYS_FAILURE_EN": 1, **params},
        )
    )


async def fail(drone, *motors, how=OFF):
    """All at once: a motor that the others' failure leaves without a command is not found out."""
    asked = [
        drone.start(drone.command(INJECT, float(MOTOR), float(how), float(motor), name="fail")) for motor in motors
    ]
    await drone.until(lambda: all(each.is_done for each in asked), 5.0, "the failures")
    for each in asked:
        if each.error is not None:
            raise each.error


def run(flight, script):
    """Runs a script and returns the true path of the armed flight."""
    running = flight.fly(script, seconds=600.0)
    if running.error is not None:
        raise running.error
    assert running.is_done
    history = flight.close()
    return history.pos_ned_true[history.is_armed].astype(float)


def height_error_m(pos_ned):
    return float(np.abs(pos_ned[:, 2] - pos_ned[0, 2]).max())


@pytest.mark.parametrize(
    "motors",
    [
        (1,),
        (3,),
        (1, 2),
        *(pytest.param(each, marks=pytest.mark.slow) for each in [(2,), (4,), (5,), (6,), (3, 4), (5, 6)]),
    ],
)
def test_hover_with_motors_out(motors):
    flight = make_flight()
    paths = []

    async def script(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(HEIGHT_M)
        await drone.sleep(3.0)
        await fail(drone, *motors)
        for _ in range(1000):
            await drone.sleep(0.02)
            paths.append(flight.rig.rows["truth"]["pos_ned"][0].astype(float))
        await drone.land()

    run(flight, script)
    path = np.array(paths)
    assert height_error_m(path) < 1.0  # PX4: 4 m
    assert np.hypot(*(path[:, :2] - path[0, :2]).T).max() < 1.5
    for motor in motors:
        assert f"Motor {motor} has failed" in flight.drone.texts
    assert not flight.rig.rows["truth"]["is_crashed"][0]


def test_mission_with_a_motor_out():
    flight = make_flight()

    def item(seq, command, corner):
        lat_deg, lon_deg, _ = geodetic_from_ned(*corner, 0.0, flight.config.home)
        return MissionItem(seq, ABOVE_HOME, command, (0.0, 0.0, 0.0, nan), lat_deg, lon_deg, HEIGHT_M)

    commands = [TAKEOFF, *[WAYPOINT] * 4, LAND]
    corners = [CORNERS[0], *CORNERS[1:], CORNERS[0]]

    async def script(drone):
        await drone.wait_ready()
        await drone.upload([item(seq, *pair) for seq, pair in enumerate(zip(commands, corners, strict=True))])
        await drone.start_mission()
        await drone.until(lambda: 1 in drone.reached, 120.0, "the first corner")
        await fail(drone, 1)
        await drone.wait_disarmed(200.0)

    pos = run(flight, script)
    assert flight.drone.reached[-1] == len(commands) - 1
    cruise = pos[-pos[:, 2] > HEIGHT_M - 1.5]
    legs = [np.array(leg) for leg in pairwise(CORNERS)]
    assert max(min(distance_m(point[:2], *leg) for leg in legs) for point in cruise) < 2.0  # PX4: 5 m
    assert -pos[:, 2].min() < HEIGHT_M + 1.0
    assert np.hypot(*pos[-1, :2]) < 2.0  # PX4: 5 m


def distance_m(point, start, end):
    """From a point to a line segment."""
    along = end - start
    share = np.clip(np.dot(point - start, along) / np.dot(along, along), 0.0, 1.0)
    return float(np.linalg.norm(point - start - share * along))


def test_every_motor_off_and_on_once():
    flight = make_flight()

    async def script(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(HEIGHT_M)
        for motor in range(1, 7):
            await fail(drone, motor)
            await drone.sleep(3.0)
            await fail(drone, motor, how=OK)
            await drone.sleep(3.0)
            assert f"Motor {motor} works again" in drone.texts
        await drone.land()

    pos = run(flight, script)
    assert -pos[:, 2].min() < HEIGHT_M + 1.0
    assert np.hypot(*pos[-1, :2]) < 3.0
    assert not any(flight.rig.arrays.autopilot.airframe.numpy()["left_out"])


@pytest.mark.parametrize(("action", "mode"), [(1, Mode.HOLD), (2, Mode.LAND), (3, Mode.RETURN)])
def test_motor_failure_leads_to_its_action(action, mode):
    flight = make_flight(COM_ACT_FAIL_ACT=action)

    async def script(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(HEIGHT_M)
        await drone.goto_ned(30.0, 0.0, -HEIGHT_M)
        await fail(drone, 5)
        await drone.sleep(1.0)
        assert flight.controller.state.mode is mode
        if mode is not Mode.HOLD:
            await drone.wait_disarmed(120.0)

    pos = run(flight, script)
    if mode is Mode.RETURN:
        assert np.hypot(*pos[-1, :2]) < 2.0  # PX4: 5 m
