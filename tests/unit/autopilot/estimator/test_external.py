"""External positions in the estimator: alone without GNSS, beside it, jumping, frozen, silent."""

import numpy as np
import pytest

from autopilot.ports import (
    DEAD_RECKONING,
    EXTERNAL_POSITION,
    HEIGHT_VALID,
    POSITION_VALID,
    VELOCITY_VALID,
    YAW_ALIGNED,
    ExternalSample,
)
from tests.unit.autopilot.estimator.flights import hold, make_flight, silence, stacked
from tests.unit.autopilot.estimator.run import assert_same, default_ekf, errors, rms, run, share_in_band

TICKS = 250
AIRBORNE = 10 * TICKS
POS, HEIGHT, VEL, YAW = 1, 2, 4, 8
MAG_NONE = 5
VALID = POSITION_VALID | VELOCITY_VALID | HEIGHT_VALID | YAW_ALIGNED
STD_M, STD_M_S, STD_RAD = 0.05, 0.08, 0.03


def measured(flight, seed, holds=POS | HEIGHT, delay_ticks=10, every=8):
    """What cameras say of a flight at 31 Hz, 40 ms late."""
    rng = np.random.default_rng(seed)
    count = len(flight.time_s)
    column = np.zeros(count, ExternalSample.numpy_dtype())
    at = np.arange(every, count - delay_ticks, every)
    sample = column[at + delay_ticks]
    sample["time_us"] = flight.samples["imu"]["time_us"][at]
    sample["holds"] = holds
    sample["pos_ned"] = flight.pos_ned[at] + rng.normal(0.0, STD_M, (len(at), 3))
    if holds & VEL:
        sample["vel_ned"] = flight.vel_ned[at] + rng.normal(0.0, STD_M_S, (len(at), 3))
    if holds & YAW:
        x, y, z, w = flight.q[at].T
        yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)) + rng.normal(0.0, STD_RAD, len(at))
        sample["yaw"] = np.arctan2(np.sin(yaw), np.cos(yaw))
    sample["pos_h_std"] = sample["pos_v_std"] = STD_M
    sample["vel_std"], sample["yaw_std"] = STD_M_S, STD_RAD
    column[at + delay_ticks] = sample
    hold(column)
    return column


def without_gnss(seed, duration_s=40.0):
    flight = make_flight(seed=seed, duration_s=duration_s)
    silence(flight.samples["gnss"], 0)
    return flight


@pytest.fixture(scope="module")
def flights():
    return [without_gnss(seed) for seed in range(6)]


@pytest.fixture(scope="module")
def traces(flights):
    external = np.empty((len(flights), len(flights[0].time_s)), ExternalSample.numpy_dtype())
    for k, flight in enumerate(flights):
        external[k] = measured(flight, k, POS | HEIGHT | VEL | YAW)
    ekf = default_ekf(len(flights), EKF2_EV_CTRL=15, EKF2_MAG_TYPE=MAG_NONE)
    return run(ekf, stacked(flights), external=external)


def test_cameras_alone_give_everything_that_flying_needs(flights, traces):
    assert np.all(traces["estimate"]["flags"][:, 3 * TICKS :] & VALID == VALID)
    assert not np.any(traces["estimate"]["flags"][:, 3 * TICKS :] & DEAD_RECKONING)
    found = [errors(flight, trace) for flight, trace in zip(flights, traces, strict=True)]
    assert np.all(rms([rms(error.pos[AIRBORNE:]) for error in found]) < 0.05)
    assert np.all(rms([rms(error.vel[AIRBORNE:]) for error in found]) < 0.08)
    assert rms([rms(error.yaw_deg[AIRBORNE:]) for error in found]) < 1.0
    assert rms([rms(error.tilt_deg[AIRBORNE:]) for error in found]) < 0.5


@pytest.mark.parametrize(("aid", "components"), [("pos", 2), ("height", 1), ("vel", 3), ("yaw", 1)])
def test_normalised_innovations_are_in_their_band(traces, aid, components):
    fraction = np.mean([share_in_band(trace, f"external_{aid}", components, AIRBORNE) for trace in traces])
    assert 0.92 < fraction < 0.98


def test_errors_are_as_large_as_the_filter_says(flights, traces):
    every = slice(AIRBORNE, None, 50)
    ratios = []
    for flight, trace in zip(flights, traces, strict=True):
        found, estimate = errors(flight, trace), trace["estimate"][every]
        std = np.stack([estimate["pos_h_std"], estimate["pos_h_std"], estimate["pos_v_std"]], -1)
        ratios.append(
            [
                np.mean((found.pos[every] / std) ** 2),
                np.mean((found.vel[every] / estimate["vel_std"][:, None]) ** 2),
                np.mean((np.radians(found.yaw_deg[every]) / estimate["yaw_std"]) ** 2),
            ]
        )
    assert np.all(np.mean(ratios, 0) > 0.2), np.mean(ratios, 0)
    assert np.all(np.mean(ratios, 0) < 3.0), np.mean(ratios, 0)


def test_nothing_changes_unless_it_is_asked_for():
    flight = make_flight(seed=3, duration_s=15.0)
    plain = run(default_ekf(), flight.samples)[0]
    offered = run(default_ekf(), flight.samples, external=measured(flight, 1))[0]
    assert_same(plain["estimate"][-1], offered["estimate"][-1])
    assert_same(plain["nominal"][-1], offered["nominal"][-1])


def test_jump_is_rejected_for_a_while_and_then_believed():
    flight = without_gnss(4, 30.0)
    external = measured(flight, 1)
    at = 15 * TICKS
    external["pos_ned"][at:, 0] += 5.0
    trace = run(default_ekf(EKF2_EV_CTRL=POS | HEIGHT), flight.samples, external=external)[0]
    north = errors(flight, trace).pos[:, 0]
    assert abs(north[at + 4 * TICKS]) < 1.0
    assert abs(north[at + 7 * TICKS] - 5.0) < 0.3
    assert trace["external_pos"]["reset_count"][-1] == 1


def test_reset_of_the_client_is_followed_at_once():
    flight = without_gnss(4, 20.0)
    external = measured(flight, 1)
    at = 15 * TICKS
    external["pos_ned"][at:, 0] += 5.0
    external["reset_count"][at:] = 1
    trace = run(default_ekf(EKF2_EV_CTRL=POS | HEIGHT), flight.samples, external=external)[0]
    assert np.all(np.abs(errors(flight, trace).pos[at + TICKS // 2 :, 0] - 5.0) < 0.3)
    assert trace["estimate"]["pos_reset_ned"][-1][0] == pytest.approx(5.0, abs=0.3)


def test_silence_ends_in_a_position_that_is_not_valid():
    flight = without_gnss(4, 30.0)
    external = measured(flight, 1)
    at = 15 * TICKS
    silence(external, at)
    trace = run(default_ekf(EKF2_EV_CTRL=POS | HEIGHT), flight.samples, external=external)[0]
    flags = trace["estimate"]["flags"]
    assert flags[at] & EXTERNAL_POSITION
    assert not flags[at + 2 * TICKS] & EXTERNAL_POSITION
    assert flags[at + 2 * TICKS] & DEAD_RECKONING
    assert flags[at + 4 * TICKS] & POSITION_VALID
    assert not flags[at + 6 * TICKS] & POSITION_VALID
    assert flags[at + 6 * TICKS] & HEIGHT_VALID  # by the barometer


def test_frozen_cameras_are_not_believed():
    flight = without_gnss(4, 30.0)
    external = measured(flight, 1)
    at = 15 * TICKS
    external["pos_ned"][at:] = external["pos_ned"][at]
    trace = run(default_ekf(EKF2_EV_CTRL=POS | HEIGHT), flight.samples, external=external)[0]
    assert trace["external_inbox"]["is_stuck"][at + TICKS] == 1
    assert not trace["estimate"]["flags"][at + 7 * TICKS] & POSITION_VALID


def test_gnss_of_another_place_does_not_move_what_cameras_say():
    flight = make_flight(seed=4, duration_s=30.0)
    flight.samples["gnss"]["pos_ned"] += np.array([15.0, 0.0, 4.0], np.float32)
    trace = run(default_ekf(EKF2_EV_CTRL=POS | HEIGHT), flight.samples, external=measured(flight, 1))[0]
    assert rms(errors(flight, trace).pos[AIRBORNE:]).max() < 0.2
    assert trace["gnss_pos"]["reset_count"][-1] == trace["gnss_pos"]["reset_count"][AIRBORNE]


def test_height_jump_of_the_client_takes_the_barometer_along():
    flight = without_gnss(4, 30.0)
    external = measured(flight, 1)
    at = 15 * TICKS
    external["pos_ned"][at:, 2] -= 3.0
    external["reset_count"][at:] = 1
    trace = run(default_ekf(EKF2_EV_CTRL=POS | HEIGHT), flight.samples, external=external)[0]
    assert np.all(np.abs(errors(flight, trace).pos[at + TICKS :, 2] + 3.0) < 0.3)
    assert trace["baro"]["reject_count"][-1] == 0


def seen_to_move(flight, seed, start):
    """What a companion's odometry says at 10 Hz, 80 ms late, from a tick on: velocity alone."""
    external = measured(flight, seed, VEL, delay_ticks=20, every=25)
    external["time_us"][:start] = 0
    external["vel_std"] = 0.25
    return external


def gone_at_10_s(seed):
    """A flight of 32 s whose GNSS goes away for good, the tick of that, and what odometry says from then on."""
    flight = make_flight(seed=seed, duration_s=32.0)
    away = 10 * TICKS
    silence(flight.samples["gnss"], away)
    return flight, away, seen_to_move(flight, seed, away)


@pytest.fixture(scope="module")
def seen_without_gnss():
    """Flights whose GNSS goes away at 12 s, for 30 s, and what comes of it: with odometry, and without."""
    away = 12 * TICKS
    flights = [make_flight(seed=seed, duration_s=60.0) for seed in range(4)]
    external = np.empty((len(flights), len(flights[0].time_s)), ExternalSample.numpy_dtype())
    for k, flight in enumerate(flights):
        silence(flight.samples["gnss"], away, away + 30 * TICKS)
        external[k] = seen_to_move(flight, k, away)
    ekf = default_ekf(len(flights), EKF2_EV_CTRL=VEL, EKF2_EVV_TOUT=60.0)
    return flights, run(ekf, stacked(flights), external=external), away


def test_velocity_from_outside_keeps_the_position_while_gnss_is_away(seen_without_gnss):
    flights, traces, away = seen_without_gnss
    gone = slice(away + 6 * TICKS, away + 30 * TICKS)
    flags = traces["estimate"]["flags"][:, gone]
    assert np.all(flags & VALID == VALID)
    assert not np.any(flags & DEAD_RECKONING)
    for flight, trace in zip(flights, traces, strict=True):
        found = errors(flight, trace)
        assert np.all(rms(found.vel[gone]) < 0.15)
        drift_m = np.hypot(*(found.pos[gone.stop - 1] - found.pos[away])[:2])
        assert drift_m < 3.0 * trace["estimate"]["pos_h_std"][gone.stop - 1]
        std = trace["estimate"]["pos_h_std"]
        assert std[gone.stop - 1] > std[away] + 0.05  # it grows, as the error may


def test_gnss_that_is_back_sets_the_position_right(seen_without_gnss):
    flights, traces, away = seen_without_gnss
    after = slice(away + 37 * TICKS, None)
    for flight, trace in zip(flights, traces, strict=True):
        assert np.all(rms(errors(flight, trace).pos[after]) < 1.2)
        assert np.all(trace["estimate"]["flags"][after] & VALID == VALID)


def test_without_velocity_from_outside_the_position_is_lost_as_before():
    flight = make_flight(seed=0, duration_s=25.0)
    away = 12 * TICKS
    silence(flight.samples["gnss"], away)
    for ctrl, external in ((VEL, None), (0, seen_to_move(flight, 0, away))):
        flags = run(default_ekf(EKF2_EV_CTRL=ctrl), flight.samples, external=external)[0]["estimate"]["flags"]
        assert flags[away + 4 * TICKS] & POSITION_VALID
        assert not flags[away + 6 * TICKS] & POSITION_VALID


def test_velocity_from_outside_carries_a_position_for_its_time_and_no_longer():
    flight, away, external = gone_at_10_s(1)
    ekf = default_ekf(EKF2_EV_CTRL=VEL, EKF2_EVV_TOUT=15.0)
    flags = run(ekf, flight.samples, external=external)[0]["estimate"]["flags"]
    assert flags[away + 14 * TICKS] & POSITION_VALID
    assert not flags[away + 16 * TICKS] & POSITION_VALID
    assert flags[away + 20 * TICKS] & VELOCITY_VALID


def test_a_position_is_lost_soon_after_the_velocity_from_outside_ends():
    flight, away, external = gone_at_10_s(2)
    silence(external, away + 12 * TICKS)
    flags = run(default_ekf(EKF2_EV_CTRL=VEL), flight.samples, external=external)[0]["estimate"]["flags"]
    assert flags[away + 15 * TICKS] & POSITION_VALID
    assert not flags[away + 18 * TICKS] & POSITION_VALID


def test_a_velocity_that_says_next_to_nothing_carries_no_position():
    flight, away, external = gone_at_10_s(1)
    external["vel_std"] = 30.0
    flags = run(default_ekf(EKF2_EV_CTRL=VEL), flight.samples, external=external)[0]["estimate"]["flags"]
    assert not flags[away + 20 * TICKS] & POSITION_VALID
