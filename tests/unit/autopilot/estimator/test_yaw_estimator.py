"""Heading without a compass that can be believed: turned, missing, wrong at first, disturbed; flights with GNSS."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from autopilot.ports import MAG_DISTURBED, MAG_FAULTY, POSITION_VALID, YAW_ALIGNED
from tests.unit.autopilot.estimator.flights import (
    Array,
    Flight,
    SensorNoise,
    make_flight,
    stacked,
)
from tests.unit.autopilot.estimator.run import default_ekf, errors, run

TICKS = 250  # per second
SEEDS = range(6)
MOVING_M_S = 2.0
FOUND_S = 15.0


def turn_compass(samples: Any, angle_deg: float) -> None:
    """Mounts the magnetometer turned about the vehicle's down axis."""
    field = samples["mag"]["field_frd_gauss"]
    x, y = field[:, 0].copy(), field[:, 1].copy()
    cosine, sine = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    field[:, 0], field[:, 1] = cosine * x - sine * y, sine * x + cosine * y


def flown(change: Callable[[Any], None], *, parameters: dict[str, float] | None = None, **how: Any) -> Any:
    """Flights of several seeds whose samples `change` has spoilt, their estimators and their traces."""
    flights = [make_flight(seed=seed, **how) for seed in SEEDS]
    for flight in flights:
        change(flight.samples)
    ekf = default_ekf(len(flights), **(parameters or {}))
    return flights, ekf, run(ekf, stacked(flights))


def moving_tick(flight: Flight) -> int:
    return int(np.argmax(np.linalg.norm(flight.vel_ned[:, :2], axis=1) > MOVING_M_S))


def true_yaw(q: Array) -> Array:
    x, y, z, w = np.moveaxis(q, -1, 0)
    return np.asarray(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))


@pytest.mark.parametrize("angle_deg", [45.0, 90.0, 180.0, -135.0])
def test_turned_compass_is_found_out_and_heading_mended(angle_deg: float) -> None:
    flights, _, traces = flown(lambda samples: turn_compass(samples, angle_deg), duration_s=35.0)
    for flight, trace in zip(flights, traces, strict=True):
        found = errors(flight, trace)
        assert abs(found.yaw_deg[5 * TICKS]) > abs(angle_deg) - 6.0
        late = slice(moving_tick(flight) + round(FOUND_S * TICKS), None)
        assert np.abs(found.yaw_deg[late]).max() < 5.0
        assert found.tilt_deg[late].max() < 2.0
        assert np.abs(found.vel[late]).max() < 0.5
        assert np.abs(found.pos[late, :2]).max() < 4.0
        assert trace["estimate"]["flags"][-1] & MAG_FAULTY
        assert trace["mag"]["is_active"][-1] == 0
        jumped = np.flatnonzero(np.diff(trace["estimate"]["reset_count"])) + 1
        assert len(jumped) == 1
        assert abs(np.degrees(trace["estimate"]["yaw_reset"][-1])) == pytest.approx(abs(angle_deg), abs=15.0)


def test_vehicle_without_compass_finds_its_heading_in_flight() -> None:
    flights, _, traces = flown(lambda _: None, duration_s=35.0, parameters={"EKF2_MAG_TYPE": 5})
    for flight, trace in zip(flights, traces, strict=True):
        flags = trace["estimate"]["flags"]
        assert not flags[5 * TICKS] & (YAW_ALIGNED | POSITION_VALID)
        late = slice(moving_tick(flight) + round(FOUND_S * TICKS), None)
        found = errors(flight, trace)
        assert np.abs(found.yaw_deg[late]).max() < 5.0
        assert np.abs(found.vel[late]).max() < 0.5
        assert np.all(flags[late] & YAW_ALIGNED)
        assert np.all(flags[late] & POSITION_VALID)
        assert not np.any(flags & MAG_FAULTY)


@pytest.mark.parametrize(
    "how",
    [
        {},
        {"rate": 0.6},
        {"rate": 0.4, "size_m": 40.0},
        {"rate": 0.15},
        {"yaw_rate": 1.0},
        {"noise": SensorNoise(gyro=0.05, accel=2.0, accel_bias=0.1, gyro_bias=0.003)},
    ],
    ids=["cruise", "steep turns", "fast", "slow", "spinning", "shaken"],
)
def test_yaw_estimator_is_as_wrong_as_it_says_and_lets_a_sound_heading_be(how: dict[str, Any]) -> None:
    flights = [make_flight(seed=seed, duration_s=40.0, **how) for seed in SEEDS]
    ekf, samples = default_ekf(len(flights)), stacked(flights)
    found, said = [], []
    for first in range(0, samples.shape[1], 50):
        run(ekf, samples[:, first : first + 50], keep_trace=False)
        if first < 15 * TICKS:
            continue
        for flight, row, state in zip(flights, ekf.yaw.numpy(), ekf.rows.numpy(), strict=True):
            tick = int(np.searchsorted(flight.samples["imu"]["time_us"], state["horizon_time_us"]))
            error = row["yaw_level"] + true_yaw(row["q_level_from_frd"]) - true_yaw(flight.q[tick])
            found.append((error + np.pi) % (2.0 * np.pi) - np.pi)
            said.append(np.sqrt(row["yaw_var"]))
    found, said = np.array(found), np.array(said)
    assert np.degrees(said).max() < 10.0
    assert np.degrees(np.abs(found)).max() < 7.0  # half of what a reset needs
    assert np.mean((found / said) ** 2) < 3.0
    assert not ekf.rows.numpy()["estimate"]["yaw_reset"].any()
    assert not ekf.rows.numpy()["is_mag_faulty"].any()


def test_standing_vehicle_learns_no_heading_from_noise() -> None:
    _, ekf, traces = flown(lambda _: None, duration_s=20.0, rest_s=100.0, parameters={"EKF2_MAG_TYPE": 5})
    assert not np.any(traces["estimate"]["flags"] & YAW_ALIGNED)
    assert not ekf.yaw.numpy()["is_running"].any()


def test_compass_that_agrees_again_is_used_again() -> None:
    def turned_until(samples: Any) -> None:
        late = samples["mag"]["field_frd_gauss"][15 * TICKS :].copy()
        turn_compass(samples, 90.0)
        samples["mag"]["field_frd_gauss"][15 * TICKS :] = late

    flights, _, traces = flown(turned_until, duration_s=35.0)
    for flight, trace in zip(flights, traces, strict=True):
        flags = trace["estimate"]["flags"]
        assert flags[14 * TICKS] & MAG_FAULTY
        assert not flags[30 * TICKS] & MAG_FAULTY
        assert trace["mag"]["is_active"][-1] == 1
        assert np.abs(errors(flight, trace).yaw_deg[30 * TICKS :]).max() < 3.0


@pytest.mark.parametrize("wrong_s", [0.7, 3.0])
def test_magnetometer_wrong_during_alignment_is_not_kept_as_a_field_of_the_body(wrong_s: float) -> None:
    def disturb(samples: Any) -> None:
        samples["mag"]["field_frd_gauss"][: round(wrong_s * TICKS), 1] += 0.15

    flights, _, traces = flown(disturb, duration_s=10.0, rest_s=100.0)
    for flight, trace in zip(flights, traces, strict=True):
        found = errors(flight, trace)
        assert abs(found.yaw_deg[round(0.65 * TICKS)]) > 20.0
        assert np.abs(found.yaw_deg[-TICKS:]).max() < 5.0
        assert np.linalg.norm(trace["nominal"]["body_field_frd"][-1]) < 0.03


@pytest.mark.parametrize("spoil", ["strength", "inclination"])
def test_field_that_is_not_that_of_the_place_is_not_used(spoil: str) -> None:
    def disturb(samples: Any) -> None:
        field = samples["mag"]["field_frd_gauss"]
        if spoil == "strength":
            field *= 1.6
        else:
            field[:, 2] -= 0.35

    _, _, traces = flown(disturb, duration_s=8.0, rest_s=100.0)
    flags = traces["estimate"]["flags"]
    assert np.all(flags[:, 4 * TICKS :] & MAG_DISTURBED)
    assert not np.any(flags & YAW_ALIGNED)


def test_field_check_can_be_switched_off() -> None:
    def disturb(samples: Any) -> None:
        samples["mag"]["field_frd_gauss"] *= 1.6

    _, _, traces = flown(disturb, duration_s=6.0, rest_s=100.0, parameters={"EKF2_MAG_CHECK": 0})
    assert np.all(traces["estimate"]["flags"][:, -1] & YAW_ALIGNED)


def test_field_disturbed_in_flight_leaves_heading_alone() -> None:
    def disturb(samples: Any) -> None:
        samples["mag"]["field_frd_gauss"][15 * TICKS : 25 * TICKS] += np.array([0.3, 0.3, 0.0], dtype=np.float32)

    flights, _, traces = flown(disturb, duration_s=35.0)
    for flight, trace in zip(flights, traces, strict=True):
        assert np.abs(errors(flight, trace).yaw_deg[15 * TICKS :]).max() < 3.0
        assert trace["mag"]["is_active"][-1] == 1


def test_compass_angle_in_the_vehicle_is_a_parameter() -> None:
    angle_deg = -90.0
    flights, _, traces = flown(
        lambda samples: turn_compass(samples, angle_deg), duration_s=20.0, parameters={"CAL_MAG0_YAW": -angle_deg}
    )
    for flight, trace in zip(flights, traces, strict=True):
        assert np.abs(errors(flight, trace).yaw_deg[2 * TICKS :]).max() < 5.0
        assert trace["estimate"]["reset_count"][-1] == 0
