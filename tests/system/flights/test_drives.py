"""Whole drives over MAVLink in lockstep: how well a rover drives, and what it answers to what only aircraft can do."""

import numpy as np
import pytest

from mission.drive_benchmarks import OPEN_HILLS, hold_trial, loss_trial, return_trial, speed_trial, square_trial
from mission.flight import Flight, FlightConfig
from mission.fly_session import default_plan
from mission.log.flight_summary import planned_path, summarise
from mission.plan.plan_file import read_plan
from mission.script import ScriptError, fly_plan

CMD_TAKEOFF, CMD_LAND, CMD_TERMINATION = 22, 21, 185
ROVERS = ["rover", "rover-skid"]


def config(airframe="rover", **fields):
    return FlightConfig(airframe=airframe, **({"world": OPEN_HILLS, "wind_m_s": 5.0} | fields))


def drive(script, seconds=90.0, **fields):
    """Runs a script to its end; returns its result and the history."""
    flight = Flight(config(**fields))
    running = flight.fly(script, seconds=seconds)
    history = flight.close()
    if running.error is not None:
        raise running.error
    return running.result, history


@pytest.mark.parametrize(("airframe", "speed"), [("rover", 2.0), ("rover", 5.0), ("rover-skid", 1.5)])
def test_a_mission_keeps_to_its_lines_round_its_corners_and_stops_at_its_end(airframe, speed):
    figures = square_trial(config(airframe, seed=3), speed)
    assert figures.cross_track_p95_m < 0.3
    assert figures.overshoot_m < 0.4
    assert figures.stop_miss_m < 0.5
    assert figures.speed_max_m_s == pytest.approx(speed, abs=0.15)


def test_a_mission_that_stops_at_each_corner_stops_there():
    assert square_trial(config(seed=2), 3.0, stop_s=2.0).stop_miss_m < 0.5


@pytest.mark.parametrize("airframe", ROVERS)
def test_a_return_ends_at_home_disarmed(airframe):
    distance, past = return_trial(config(airframe, seed=1))
    assert distance < 1.0
    assert past < 0.5


def test_without_noise_it_holds_a_place_a_speed_and_a_heading():
    perfect = config(noise=0.0, wind_m_s=0.0)
    assert hold_trial(perfect) < 0.5
    speed_error, heading_error = speed_trial(perfect, 3.0)
    assert speed_error < 0.1
    assert heading_error < 1.0


@pytest.mark.parametrize("airframe", ROVERS)
def test_without_gnss_it_drives_on_by_its_wheels(airframe):
    lost = loss_trial(config(airframe, seed=4), 3.0 if airframe == "rover" else 1.5)
    assert lost.way_m > 40.0
    assert lost.fraction < 0.03


def test_the_default_plan_of_rovers_is_driven_between_the_trees():
    plan = read_plan(default_plan("rover"))
    flight = Flight(FlightConfig(airframe="rover", seed=5))
    running = flight.fly(lambda drone: fly_plan(drone, plan), seconds=300.0)
    summary = summarise(flight, flight.close(), running, planned_path(plan, flight.config.home))
    assert summary.is_success, summary.result
    assert summary.landing_error_est_m < 1.0


def test_it_stands_still_while_parked_on_a_slope():
    async def park(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.goto_ned(35.0, 10.0, 0.0)
        await drone.sleep(30.0)

    _, history = drive(park, noise=0.0)
    late = history.pos_ned_true[history.time_us > history.time_us[-1] - 20_000_000]
    assert np.linalg.norm(late - late[0], axis=1).max() < 0.01


@pytest.mark.parametrize("command", [CMD_TAKEOFF, CMD_LAND])
def test_taking_off_and_landing_are_refused(command):
    async def ask(drone):
        await drone.wait_ready()
        await drone.arm()
        with pytest.raises(ScriptError, match=r"(?i)unsupported|denied|no mode of this vehicle"):
            await drone.command(command, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 10.0)
        assert drone.is_armed
        await drone.goto_ned(5.0, 0.0, 0.0)

    drive(ask)


def test_it_goes_nowhere_while_disarmed():
    async def ask(drone):
        await drone.wait_ready()
        with pytest.raises(ScriptError, match="not armed"):
            await drone.goto_ned(5.0, 0.0, 0.0)

    drive(ask)


def test_terminated_it_is_disarmed_and_brakes():
    async def end(drone):
        await drone.wait_ready()
        await drone.arm()
        drone.offboard_velocity(4.0, 0.0, 0.0)
        await drone.start_offboard()
        await drone.sleep(6.0)
        await drone.command(CMD_TERMINATION, 1.0)
        await drone.wait_disarmed(2.0)
        await drone.sleep(3.0)

    _, history = drive(end)
    assert np.linalg.norm(history.vel_ned_true[-1]) < 0.01


def _offboard(parameters, *velocity, **options):
    async def go(drone):
        await drone.wait_ready()
        await drone.arm()
        drone.offboard_velocity(*velocity, **options)
        await drone.start_offboard()
        await drone.sleep(6.0)

    _, history = drive(go, noise=0.0, parameters=parameters)
    x, y, z, w = history.q_true[-1]
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    vel = history.vel_ned_true[-1]
    return float(np.cos(yaw) * vel[0] + np.sin(yaw) * vel[1]), float(np.degrees(yaw))


def test_offboard_velocities_are_a_course_and_a_speed_forward_as_with_px4():
    speed, yaw = _offboard({}, -2.0, 0.0, 0.0, yaw_rad=0.0)
    assert speed == pytest.approx(2.0, abs=0.1)
    assert abs(yaw) == pytest.approx(180.0, abs=3.0)


def test_along_the_nose_offboard_velocities_may_lead_backwards():
    speed, yaw = _offboard({"HG_RO_OFFB_BODY": 1}, -2.0, 0.0, 0.0, yaw_rad=0.0)
    assert speed == pytest.approx(-2.0, abs=0.1)
    assert yaw == pytest.approx(0.0, abs=2.0)


def test_a_rover_without_a_speed_limit_is_not_armed():
    async def ask(drone):
        await drone.sleep(8.0)
        with pytest.raises(ScriptError, match="RO_SPEED_LIM must be above 0"):
            await drone.arm()

    drive(ask, parameters={"RO_SPEED_LIM": 0.0})
