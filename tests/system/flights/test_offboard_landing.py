"""Landing by offboard setpoints, as scripts do it, and what else ground contact and a lost attitude lead to."""

import numpy as np
import pytest

from autopilot.interface.vehicle_state import LandedState, Mode
from mission.flight import Flight, FlightConfig
from mission.script import ScriptError
from sim.faults import set_fault
from sim.world.world import WorldConfig

WIND = {"wind_m_s": 5.0}
OPEN_GROUND = WorldConfig(trees_per_ha=0.0)
UPRIGHT_DEG = 10.0


def flown(script, **config):
    """The flight after a take-off to 3 m and `script(drone, flight)`, which must not fail."""
    flight = Flight(FlightConfig(world=OPEN_GROUND, **config))

    async def whole(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(3.0)
        return await script(drone, flight)

    running = flight.fly(whole, seconds=150.0)
    flight.close()
    if running.error is not None:
        raise running.error
    assert running.is_done
    return flight


def body(flight):
    return flight.rig.rows["truth"][0]


def tilt_deg(flight):
    x, y, _, _ = body(flight)["q_ned_from_frd"]
    return float(np.degrees(np.arccos(1.0 - 2.0 * (x * x + y * y))))


def break_sensor(flight, sensor, mode, magnitude=0.0):
    set_fault(flight.rig.arrays.faults.numpy()[0], sensor, mode, magnitude)


def ask(drone, kind, value):
    if kind == "velocity":
        drone.offboard_velocity(0.0, 0.0, value)
    else:
        drone.offboard_position(0.0, 0.0, value)


def assert_stands(flight):
    state = flight.controller.state
    assert state.landed_state is LandedState.ON_GROUND
    assert not state.is_armed
    assert tilt_deg(flight) < UPRIGHT_DEG
    assert not body(flight)["is_crashed"]
    assert flight.drone.texts[-2:] == ["Landed", "Disarmed after landing"]


@pytest.mark.parametrize(
    ("seed", "wind", "has_range_finder"),
    [
        (0, {}, True),
        (1, WIND, True),
        (2, WIND, False),
        *(pytest.param(seed, WIND, seed % 2 == 1, marks=pytest.mark.slow) for seed in range(3, 9)),
    ],
)
@pytest.mark.parametrize(
    ("kind", "value"), [("velocity", 0.3), ("velocity", 0.7), ("velocity", 1.0), ("position", 0.0), ("position", 0.5)]
)
def test_offboard_descent_ends_upright_and_disarmed(kind, value, seed, wind, has_range_finder):
    async def script(drone, flight):
        if not has_range_finder:
            break_sensor(flight, "range", "off")
        ask(drone, kind, value)
        await drone.start_offboard()
        await drone.wait_disarmed(30.0)

    assert_stands(flown(script, seed=seed, **wind))


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("height_m", [0.3, 0.5])
def test_low_hover_in_wind_is_no_landing(height_m, seed):
    async def script(drone, flight):
        drone.offboard_position(0.0, 0.0, flight.controller.state.home_ned[2] - height_m)
        await drone.start_offboard()
        for _ in range(600):
            await drone.sleep(0.05)
            assert not flight.controller.state.has_ground_contact

    flight = flown(script, seed=seed, **WIND)
    assert flight.controller.state.is_armed
    assert flight.controller.state.mode is Mode.OFFBOARD


def test_vehicle_that_touches_the_ground_climbs_again_when_asked_to():
    heights = []

    async def touch(drone, flight):
        drone.offboard_velocity(0.0, 0.0, 0.7)
        await drone.until(lambda: flight.controller.state.has_ground_contact, 20.0, "contact")
        await drone.sleep(0.2)

    async def script(drone, flight):
        drone.offboard_velocity(0.0, 0.0, 0.7)
        await drone.start_offboard()
        await touch(drone, flight)
        drone.offboard_velocity(0.0, 0.0, -1.0)
        await drone.sleep(3.0)
        heights.append(-drone.pos_ned[2])
        await touch(drone, flight)
        await drone.takeoff(3.0)
        heights.append(-drone.pos_ned[2])

    flight = flown(script, seed=1, **WIND)
    assert heights[0] > 2.0
    assert heights[1] > 2.5
    assert flight.controller.state.is_armed
    assert not body(flight)["is_crashed"]


def test_goto_to_the_ground_lands_and_far_below_it_is_refused():
    async def script(drone, flight):
        with pytest.raises(ScriptError, match="below the ground"):
            await drone.goto_ned(30.0, 0.0, 5.0)
        with pytest.raises(ScriptError):
            await drone.goto_ned(4.0, 0.0, 0.4, timeout_s=12.0, acceptance_m=0.1)
        await drone.wait_disarmed(10.0)

    assert_stands(flown(script, seed=1, **WIND))


def test_lost_imu_stops_the_motors():
    async def script(drone, flight):
        break_sensor(flight, "gyro", "off")
        await drone.until(lambda: not drone.is_armed, 1.5, "motors stopped")
        await drone.wait_disarmed(15.0)

    flight = flown(script)
    assert "Attitude lost: motors stopped" in flight.drone.texts
    assert "Landed" not in flight.drone.texts[-2:]


def test_vehicle_turned_over_stops_its_motors():
    async def script(drone, flight):
        break_sensor(flight, "gyro", "biased", 0.5)  # far more than the estimator can learn
        await drone.until(lambda: not drone.is_armed, 30.0, "motors stopped")

    flight = flown(script, **WIND)
    assert "Crash detected: motors stopped" in flight.drone.texts


def test_position_reset_is_told():
    async def script(drone, flight):
        break_sensor(flight, "gnss", "biased", 10.0)
        await drone.until(lambda: any("position reset by 1" in text for text in drone.texts), 20.0, "reset told")

    flown(script)
