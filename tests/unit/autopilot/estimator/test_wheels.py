"""Wheel odometry on simulated drives: without GNSS, at standstill, and with wheels that slip or lie."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from autopilot.ports import CONTACT_NONE, DEAD_RECKONING, POSITION_VALID, VELOCITY_VALID
from tests.unit.autopilot.estimator.drives import (
    REAR_X_M,
    TRACK_M,
    Drive,
    distance,
    make_drive,
    outage,
    varied,
)
from tests.unit.autopilot.estimator.flights import Flight, stacked
from tests.unit.autopilot.estimator.run import default_ekf, errors, run, share_in_band

TICKS = 250  # per second
CAR = {"EKF2_WHL_POS_X": REAR_X_M, "EKF2_WHL_TRACK": TRACK_M, "EKF2_DRAG_CTRL": 0}
FAULT_AT = 40 * TICKS
FAULT_END = 60 * TICKS
SIDES = ("left_m_s", "right_m_s")


def driven(flights: list[Flight], **changes: float) -> Any:
    """The traces of armed cars: their commander never says that they stand."""
    return run(default_ekf(len(flights), **{**CAR, **changes}), stacked(flights), contact=CONTACT_NONE)


@pytest.fixture(scope="module")
def without_gnss() -> tuple[list[Flight], Any, int, int]:
    flights = [varied(seed) for seed in range(6)]
    for flight in flights:
        first, end = outage(flight, 65.0, 30.0)
    return flights, driven(flights), first, end


def drift(flight: Flight, trace: Any, first: int, end: int) -> float:
    """By how much the horizontal error changes between two ticks, over the distance driven."""
    pos = errors(flight, trace).pos[:, :2]
    return float(np.linalg.norm(pos[end - 1] - pos[first])) / distance(flight, first, end)


def test_gnss_lost_for_30_s_on_hills_costs_less_than_3_percent_of_the_distance(without_gnss: Any) -> None:
    flights, traces, first, end = without_gnss
    assert distance(flights[0], first, end) > 75.0
    drifts = [drift(flight, trace, first, end) for flight, trace in zip(flights, traces, strict=True)]
    assert max(drifts) < 0.01  # 0.004 measured


def test_position_stays_valid_on_wheels_and_says_that_it_is_dead_reckoning(without_gnss: Any) -> None:
    _, traces, first, end = without_gnss
    flags = traces["estimate"]["flags"][:, first + 8 * TICKS : end]
    wanted = POSITION_VALID | VELOCITY_VALID | DEAD_RECKONING
    assert np.all(flags & wanted == wanted)


def test_position_is_invalid_once_wheels_alone_have_carried_it_for_their_time(without_gnss: Any) -> None:
    flights, _, first, _ = without_gnss
    flags = driven(flights[:1], EKF2_WHL_TOUT=20.0)[0]["estimate"]["flags"]
    assert flags[first + 18 * TICKS] & POSITION_VALID
    assert not flags[first + 22 * TICKS] & POSITION_VALID
    assert flags[first + 22 * TICKS] & VELOCITY_VALID


def test_scale_of_each_wheel_is_learned(without_gnss: Any) -> None:
    _, traces, first, _ = without_gnss
    for seed, trace in enumerate(traces):
        true = np.random.default_rng(1000 + seed).normal(0.0, 0.015, 2)
        np.testing.assert_allclose(trace["odometer"]["scale"][first], true, atol=0.008)
        assert np.all(np.sqrt(trace["odometer"]["scale_var"][first]) < 0.008)


def test_innovations_of_wheels_are_in_their_band(without_gnss: Any) -> None:
    _, traces, _, _ = without_gnss
    for aid, components in (("wheels", 1), ("wheel_side", 2), ("gnss_vel", 3), ("gnss_pos", 2)):
        assert np.mean([share_in_band(trace, aid, components, 12 * TICKS) for trace in traces]) > 0.92, aid


def test_errors_with_wheels_are_as_large_as_the_filter_says(without_gnss: Any) -> None:
    flights, traces, _, end = without_gnss
    squares: dict[str, list[float]] = {"vel": [], "pos": [], "yaw": []}
    for flight, trace in zip(flights, traces, strict=True):
        every = slice(12 * TICKS, end, 125)
        found, estimate = errors(flight, trace), trace["estimate"][every]
        squares["vel"].append(np.mean((found.vel[every, :2] / estimate["vel_std"][:, None]) ** 2))
        squares["pos"].append(np.mean((found.pos[every, :2] / estimate["pos_h_std"][:, None]) ** 2))
        squares["yaw"].append(np.mean((np.radians(found.yaw_deg[every]) / estimate["yaw_std"]) ** 2))
    for name, ratios in squares.items():
        assert 0.1 < np.mean(ratios) < 3.0, name  # 1 expected; the deviation is that of the worse axis


def test_wheels_without_samples_change_nothing() -> None:
    flight = make_drive(3, Drive(duration_s=30.0))
    flight.samples["wheels"]["time_us"] = 0
    with_wheels, without = (driven([flight], EKF2_WHL_CTRL=ctrl)[0]["estimate"] for ctrl in (15, 0))
    assert np.array_equal(with_wheels["pos_ned"], without["pos_ned"])


def faster(flight: Flight, by: Any, sides: tuple[str, ...] = SIDES) -> None:
    for side in sides:
        flight.samples["wheels"][side] += by


def ramp(over_s: float, ticks: int) -> Any:
    """From 0 at FAULT_AT to 1, and back to 0 at once at FAULT_END."""
    tick = np.arange(ticks)
    return np.clip((tick - FAULT_AT) / (over_s * TICKS), 0.0, 1.0) * (tick < FAULT_END)


def stuck_left(flight: Flight) -> None:
    wheels = flight.samples["wheels"]["left_m_s"]
    wheels[FAULT_AT:] = wheels[FAULT_AT]


def stuck_both(flight: Flight) -> None:
    stuck_left(flight)
    wheels = flight.samples["wheels"]["right_m_s"]
    wheels[FAULT_AT:] = wheels[FAULT_AT]


def off_left(flight: Flight) -> None:
    flight.samples["wheels"]["left_m_s"][FAULT_AT:] = 0.0


def off_both(flight: Flight) -> None:
    off_left(flight)
    flight.samples["wheels"]["right_m_s"][FAULT_AT:] = 0.0


def spinning(flight: Flight) -> None:
    faster(flight, 2.0 * ramp(0.5, len(flight.samples)))


def spinning_left(flight: Flight) -> None:
    faster(flight, 2.0 * ramp(0.5, len(flight.samples)), ("left_m_s",))


def slipping_more_and_more(flight: Flight) -> None:
    for side in SIDES:
        flight.samples["wheels"][side] *= 1.0 + 0.2 * ramp(5.0, len(flight.samples))


def wrong(flight: Flight) -> None:
    faster(flight, 5.0 * ramp(0.02, len(flight.samples)))


# Fault, largest error of velocity [m/s] and change of the error of position [m] with GNSS, and without for 20 s
FAULTS = [
    (stuck_left, 0.3, 1.5, 0.5, 3.0),
    (stuck_both, 0.3, 1.0, 0.5, 5.0),
    (off_left, 0.3, 1.0, 0.3, 2.0),
    (off_both, 0.3, 1.0, 0.5, 5.0),
    (spinning, 0.3, 1.0, 0.5, 5.0),
    (spinning_left, 0.3, 1.0, 0.3, 2.0),
    (slipping_more_and_more, 0.6, 4.0, 0.9, 10.0),
    (wrong, 0.3, 1.0, 0.6, 6.0),
]


@pytest.mark.parametrize("has_gnss", [True, False])
def test_wheels_that_lie_do_not_drag_the_estimate_away(has_gnss: bool) -> None:
    flights = []
    for fault, *_ in FAULTS:
        for seed in (1, 2):
            flight = varied(seed, Drive(duration_s=65.0))
            fault(flight)
            if not has_gnss:
                outage(flight, FAULT_AT / TICKS, 20.0)
            flights.append(flight)
    traces = driven(flights)
    for k, flight in enumerate(flights):
        fault, *limits = FAULTS[k // 2]
        vel_limit, pos_limit = limits[:2] if has_gnss else limits[2:]
        found = errors(flight, traces[k])
        assert np.abs(found.vel[FAULT_AT:FAULT_END]).max() < vel_limit, fault.__name__
        moved = found.pos[FAULT_AT:FAULT_END, :2] - found.pos[FAULT_AT, :2]
        assert np.linalg.norm(moved, axis=1).max() < pos_limit, fault.__name__
        assert np.abs(found.yaw_deg[FAULT_AT:FAULT_END]).max() < 1.5, fault.__name__


def test_one_broken_side_leaves_the_other_to_carry_on_without_gnss() -> None:
    flight = varied(1, Drive(duration_s=75.0))
    off_left(flight)
    first, end = outage(flight, FAULT_AT / TICKS, 30.0)
    trace = driven([flight])[0]
    assert drift(flight, trace, first, end) < 0.01


STOP_S = 30.0


def test_car_that_stops_is_at_rest_within_a_second_while_armed() -> None:
    flight = make_drive(2, Drive(stop_s=STOP_S, duration_s=40.0))
    trace = driven([flight])[0]
    is_still = trace["stillness"]["is_still"]
    assert not is_still[9 * TICKS : int(STOP_S) * TICKS].any()
    assert is_still[int(STOP_S + 1.5) * TICKS :].all()
    assert np.abs(trace["estimate"]["vel_ned"][int(STOP_S + 3.0) * TICKS :]).max() < 0.05


@pytest.mark.parametrize("has_steel", [False, True])
def test_parked_car_holds_its_heading_for_minutes(has_steel: bool) -> None:
    flight = make_drive(4, Drive(stop_s=STOP_S, duration_s=340.0))
    if has_steel:
        flight.samples["mag"]["field_frd_gauss"][int(STOP_S + 10.0) * TICKS :] += (0.03, 0.06, 0.0)
    parked = int(STOP_S + 5.0) * TICKS
    yaw = errors(flight, driven([flight])[0]).yaw_deg
    assert np.abs(yaw[parked:] - yaw[parked]).max() < 0.3


def test_parked_car_learns_the_bias_about_the_vertical_without_a_compass() -> None:
    flight = make_drive(4, Drive(stop_s=STOP_S, duration_s=120.0))
    flight.samples["mag"]["time_us"][int(STOP_S + 1.0) * TICKS :] = 0
    trace = driven([flight])[0]
    np.testing.assert_allclose(trace["estimate"]["gyro_bias_frd"][-1], flight.gyro_bias, atol=2e-4)


def test_car_pushed_with_its_wheels_held_is_followed_by_gnss_within_seconds() -> None:
    flight = make_drive(5, Drive(speed_m_s=1.0, duration_s=40.0))
    for side in SIDES:
        flight.samples["wheels"][side] = 0.0
    found = errors(flight, driven([flight])[0])
    assert np.linalg.norm(found.vel[20 * TICKS :, :2], axis=1).max() < 0.3
    assert np.linalg.norm(found.pos[20 * TICKS :, :2], axis=1).max() < 3.0


def test_rolling_wheels_end_rest_at_once() -> None:
    flight = make_drive(6, replace(Drive(), speed_m_s=0.3, duration_s=20.0, turn_rad_s=0.0, slope_deg=0.0))
    is_still = driven([flight])[0]["stillness"]["is_still"]
    assert is_still[7 * TICKS]
    assert not is_still[int(9.5 * TICKS) :].any()


def test_what_a_blow_leaves_of_velocity_is_mended_by_the_wheels_without_gnss() -> None:
    flight = varied(1, Drive(duration_s=60.0))
    flight.samples["imu"]["accel_frd"][FAULT_AT : FAULT_AT + 12, :2] += (-35.0, 35.0)
    outage(flight, FAULT_AT / TICKS - 2.0, 20.0)
    found = errors(flight, driven([flight])[0])
    assert np.linalg.norm(found.vel[FAULT_AT + 30, :2]) > 1.0
    assert np.linalg.norm(found.vel[FAULT_AT + 3 * TICKS : FAULT_AT + 18 * TICKS, :2], axis=1).max() < 0.3
