"""The accelerometer bias through impacts, fast turns and vibration."""

from typing import Any

import numpy as np

from tests.unit.autopilot.estimator.flights import Array, Flight, make_flight, stacked
from tests.unit.autopilot.estimator.run import default_ekf, errors, run

TICKS = 250  # per second
SPIN_S, SPIN_RATE, SPIN_RAMP_S = 4.0, 6.0, 0.5
EVENT_S = 20.0
REAL = {"EKF2_ABIAS_INIT": 0.2, "EKF2_GPS_V_NOISE": 0.3, "EKF2_MAG_NOISE": 0.05}  # as of a sensor that nobody knows


def at(time_s: float) -> int:
    return round(time_s * TICKS)


def hover(seed: int, spin_rate: float = 0.0, duration_s: float = 30.0) -> Flight:
    """At rest, climbing to 10 m, hovering; from EVENT_S on spinning for SPIN_S."""

    def turned(time_s: Array) -> Array:
        time_s = np.maximum(time_s, 0.0)
        return np.where(time_s < SPIN_RAMP_S, time_s**2 / (2.0 * SPIN_RAMP_S), time_s - 0.5 * SPIN_RAMP_S)

    def path(time_s: Array) -> tuple[Array, Array]:
        climb = np.clip((time_s - 6.0) / 6.0, 0.0, 1.0)
        climb = climb**3 * (10.0 - 15.0 * climb + 6.0 * climb**2)
        pos = np.stack([0.0 * time_s, 0.0 * time_s, -10.0 * climb], -1)
        return pos, 0.7 + spin_rate * (turned(time_s - EVENT_S) - turned(time_s - EVENT_S - SPIN_S))

    return make_flight(seed=seed, duration_s=duration_s, path=path)


def bias_errors(flight: Flight, trace: Any) -> Array:
    error: Array = trace["nominal"]["accel_bias_frd"] - flight.accel_bias
    return error


def test_blow_is_not_taken_for_a_bias() -> None:
    """Three samples of 150 m/s² that the vehicle did not do: 1.8 m/s."""
    flights = [hover(seed) for seed in range(3)]
    for flight in flights:
        flight.samples["imu"]["accel_frd"][at(EVENT_S) : at(EVENT_S) + 3, 0] += 150.0
    for flight, trace in zip(flights, run(default_ekf(3, **REAL), stacked(flights)), strict=True):
        bias = bias_errors(flight, trace)[at(EVENT_S) :]
        assert np.max(np.abs(bias - bias[0])) < 0.08
        assert np.max(errors(flight, trace).tilt_deg[at(EVENT_S) :]) < 0.9


def test_bias_is_held_while_a_vehicle_spins_about_a_point_beside_its_imu() -> None:
    flight = hover(0, SPIN_RATE)
    spins = slice(at(EVENT_S + SPIN_RAMP_S), at(EVENT_S + SPIN_S))
    flight.samples["imu"]["accel_frd"][spins] += SPIN_RATE**2 * np.array([-0.05, -0.03, 0.0], np.float32)
    trace = run(default_ekf(**REAL), flight.samples)[0]
    horizon = slice(spins.start + at(0.15), spins.stop)
    assert np.all(np.ptp(bias_errors(flight, trace)[horizon], axis=0) == 0.0)
    assert np.all(np.abs(np.diff(bias_errors(flight, trace)[[spins.start, -1]], axis=0)) < 0.15)


def test_bias_is_found_through_vibration_whose_peaks_are_above_the_limit() -> None:
    flight = make_flight(seed=5, duration_s=40.0)
    imu = flight.samples["imu"]
    imu["accel_frd"][at(6.0) :: 2, 2] -= 20.0
    imu["accel_frd"][at(6.0) + 1 :: 2, 2] += 20.0
    imu["accel_frd"][:, 0] += 0.3
    trace = run(default_ekf(EKF2_ABIAS_INIT=0.2), flight.samples)[0]
    assert not np.any(trace["nominal"]["holds_accel_bias"])
    np.testing.assert_allclose(bias_errors(flight, trace)[-1], (0.3, 0.0, 0.0), atol=0.05)
