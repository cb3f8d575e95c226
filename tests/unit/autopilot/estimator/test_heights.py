"""Barometer and GNSS that agree with each other and not with the state bring the height back."""

from typing import Any

import numpy as np
import pytest

from autopilot.estimator.sources.heights import common_error
from tests.unit.autopilot.estimator.flights import Flight, make_flight, stacked
from tests.unit.autopilot.estimator.run import default_ekf, run

TICKS = 250  # per second
WRONG_S = 30.0
SEEDS = range(4)


def misled(wrong_m: float) -> list[tuple[Flight, Any]]:
    """Flights and traces from the moment on at which the state's height was wrong and both slow errors held it."""
    flights = [make_flight(seed=seed, duration_s=65.0) for seed in SEEDS]
    ekf, samples, at = default_ekf(len(flights)), stacked(flights), int(WRONG_S * TICKS)
    run(ekf, samples[:, :at], keep_trace=False)
    rows = ekf.rows.numpy()  # the live rows
    rows["nominal"]["pos_ned"][:, 2] += wrong_m
    rows["nominal"]["terrain_d"] += wrong_m
    rows["nominal"]["slow"][:, 2:] -= wrong_m
    rows["output"]["pos_correction_ned"][:, 2] += wrong_m
    return list(zip(flights, run(ekf, samples[:, at:]), strict=True))


@pytest.mark.parametrize("wrong_m", [1.5, 3.0, -3.0])
def test_height_comes_back_when_barometer_and_gnss_agree(wrong_m: float) -> None:
    at = int(WRONG_S * TICKS)
    for flight, trace in misled(wrong_m):
        down = trace["estimate"]["pos_ned"][:, 2] - flight.pos_ned[at:, 2]
        after = slice(10 * TICKS, None)
        assert np.abs(down[after]).max() < 1.0
        assert np.all(np.abs(down[after]) < 4.0 * trace["estimate"]["pos_v_std"][after])


def test_height_moved_back_is_reported_as_a_reset_and_the_ground_moves_along() -> None:
    for _, trace in misled(3.0):
        estimate = trace["estimate"]
        step = int(np.flatnonzero(np.diff(estimate["reset_count"]))[0]) + 1
        jumped = estimate["pos_ned"][step] - estimate["pos_ned"][step - 1]
        np.testing.assert_allclose(jumped, estimate["pos_reset_ned"][step], atol=0.1)
        ground = trace["nominal"]["terrain_d"] - trace["nominal"]["pos_ned"][:, 2]
        assert abs(ground[step] - ground[step - 1]) < 0.1


def test_wander_of_healthy_sensors_moves_nothing() -> None:
    flights = [make_flight(seed=seed, duration_s=90.0) for seed in range(20, 32)]
    assert not run(default_ekf(len(flights)), stacked(flights))["estimate"]["reset_count"].any()


@pytest.mark.parametrize(
    ("baro", "gnss", "shared"),
    [
        (2.0, 2.0, 2.0),  # the same error in both
        (2.0, 0.1, 0.0),  # the barometer alone
        (0.1, 3.0, 0.0),  # GNSS alone
        (2.0, -2.0, 0.0),  # on both sides
        (0.3, 0.3, 0.0),  # no more than they wander
    ],
)
def test_only_what_both_say_is_the_state_s(baro: float, gnss: float, shared: float) -> None:
    assert common_error(baro, 0.05, gnss, 0.81)[0] == pytest.approx(shared, abs=0.05)
