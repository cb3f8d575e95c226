"""Slow and smooth motion is not taken for rest, and rest is found again after it."""

from dataclasses import fields, replace
from itertools import product
from typing import Any

import numpy as np
import pytest
import warp as wp

from autopilot.estimator.sources.rest import conclude
from autopilot.estimator.state import Stillness
from autopilot.ports import CONTACT_GROUND, CONTACT_NONE, CONTACT_UNKNOWN
from tests.unit.autopilot.estimator.flights import (
    Array,
    Flight,
    Path,
    SensorNoise,
    make_flight,
    silence,
    stacked,
)
from tests.unit.autopilot.estimator.run import default_ekf, errors, run

TICKS = 250  # per second
DEPARTURE_S = 10.0
MOVED_S = 40.0
SMOOTH = {"gyro": 0.005, "accel": 0.03}  # a vehicle that does not shake: its IMU looks like one at rest

# Velocity in ned [m/s], seconds over which it is taken up, and whether the vehicle leans into it
MOTIONS = {
    "climb 0.2": ((0.0, 0.0, -0.2), 2.0, True),
    "climb 0.4": ((0.0, 0.0, -0.4), 2.0, True),
    "slowly taken up climb 0.3": ((0.0, 0.0, -0.3), 10.0, True),
    "sink 0.3": ((0.0, 0.0, 0.3), 2.0, True),
    "multirotor 0.3": ((0.2, -0.2, 0.0), 2.0, True),
    "rover 0.2": ((0.2, 0.0, 0.0), 2.0, False),
    "slowly taken up drive 0.4": ((0.4, 0.0, 0.0), 10.0, False),
    "rover 0.6": ((0.0, 0.6, 0.0), 3.0, False),
}
NOISES = (0.0, 0.2, 1.0)
SEEDS = (1, 2)


def ramped(time_s: Array, at_s: float, over_s: float) -> Array:
    """Path [m] after a speed of 1 m/s was taken up smoothly."""
    x = np.clip((time_s - at_s) / over_s, 0.0, 1.0)
    return np.asarray(over_s * (x**3 - 0.5 * x**4) + np.maximum(time_s - at_s - over_s, 0.0))


def straight(vel_ned: tuple[float, float, float], over_s: float, stop_s: float | None = None) -> Path:
    """A path that departs at DEPARTURE_S, and ends at `stop_s`."""

    def path(time_s: Array) -> tuple[Array, Array]:
        way = ramped(time_s, DEPARTURE_S, over_s)
        if stop_s is not None:
            way = way - ramped(time_s, stop_s, over_s)
        return way[:, None] * np.array(vel_ned), np.full(len(time_s), 0.7)

    return path


def smooth_noise(scale: float) -> SensorNoise:
    """The default sensors' noise times `scale`, without vibration."""
    scaled = {field.name: scale * getattr(SensorNoise(), field.name) for field in fields(SensorNoise)}
    return replace(SensorNoise(**scaled), **{name: min(scaled[name], most) for name, most in SMOOTH.items()})


@pytest.fixture(scope="module")
def slow_motions() -> list[tuple[tuple[str, float], Flight, Any]]:
    """Each motion with each noise: its name, the flight and the trace."""
    found = []
    for noise, (name, (vel_ned, over_s, leans)), seed in product(NOISES, MOTIONS.items(), SEEDS):
        path = straight(vel_ned, over_s)
        flight = make_flight(
            seed=seed, duration_s=DEPARTURE_S + MOVED_S, noise=smooth_noise(noise), path=path, leans=leans
        )
        found.append(((name, noise), flight))
    traces = run(default_ekf(len(found)), stacked([flight for _, flight in found]))
    return [(label, flight, trace) for (label, flight), trace in zip(found, traces, strict=True)]


def test_slow_smooth_motion_is_followed(slow_motions: Any) -> None:
    departure = int(DEPARTURE_S * TICKS)
    for label, flight, trace in slow_motions:
        pos = errors(flight, trace).pos
        lost = np.linalg.norm(pos[departure:] - pos[departure], axis=1).max()
        # what remains is the receiver's wander
        assert lost < (1.0 if label[1] == 1.0 else 0.3), label


def test_deviations_in_slow_smooth_motion_are_honest(slow_motions: Any) -> None:
    departure = int(DEPARTURE_S * TICKS)
    for label, flight, trace in slow_motions:
        found, estimate = errors(flight, trace), trace["estimate"][departure:]
        pos, vel = np.abs(found.pos[departure:]), np.abs(found.vel[departure:])
        assert np.all(pos[:, :2] < 3.0 * estimate["pos_h_std"][:, None]), label
        assert np.all(pos[:, 2] < 3.0 * estimate["pos_v_std"]), label
        assert np.all(vel[:, :2] < 4.0 * estimate["vel_std"][:, None]), label


def test_smooth_vehicle_is_at_rest_before_it_departs_and_not_while_it_moves(slow_motions: Any) -> None:
    for label, _, trace in slow_motions:
        is_still = trace["stillness"]["is_still"]
        assert is_still[TICKS : int(DEPARTURE_S * TICKS)].all(), label
        assert not is_still[int((DEPARTURE_S + 10.0) * TICKS) :].any(), label


def test_velocity_is_uncertain_at_once_when_rest_ends(slow_motions: Any) -> None:
    for label, _, trace in slow_motions:
        is_still, vel_std = trace["stillness"]["is_still"], trace["estimate"]["vel_std"]
        ends = np.flatnonzero((is_still[TICKS:-10] == 1) & (is_still[TICKS + 1 : -9] == 0)) + TICKS
        assert len(ends), label
        for end in ends:
            assert vel_std[end + 1 : end + 9].max() >= 0.1 > vel_std[end], label


def test_rest_is_found_again_after_a_smooth_drive() -> None:
    stop_s = 25.0
    path = straight((0.4, 0.0, 0.0), 2.0, stop_s)
    flight = make_flight(seed=4, duration_s=45.0, noise=smooth_noise(1.0), path=path, leans=False)
    is_still = run(default_ekf(), flight.samples)[0]["stillness"]["is_still"]
    assert not is_still[int((DEPARTURE_S + 2.0) * TICKS) : int((stop_s + 2.0) * TICKS)].any()
    assert np.mean(is_still[int((stop_s + 12.0) * TICKS) :]) > 0.9


def test_parked_vehicle_without_gnss_keeps_its_velocity_at_zero() -> None:
    path = straight((0.0, 0.0, 0.0), 2.0)
    flight = make_flight(seed=4, duration_s=120.0, noise=smooth_noise(1.0), path=path)
    silence(flight.samples["gnss"], 0)
    trace = run(default_ekf(), flight.samples)[0]
    assert trace["stillness"]["is_still"][TICKS:].all()
    assert np.abs(trace["estimate"]["vel_ned"]).max() < 0.1


def test_drive_without_gnss_is_not_taken_for_rest() -> None:
    path = straight((0.4, 0.0, 0.0), 2.0)
    flight = make_flight(seed=4, duration_s=40.0, noise=smooth_noise(0.2), path=path, leans=False)
    silence(flight.samples["gnss"], 0)
    trace = run(default_ekf(), flight.samples)[0]
    assert not trace["stillness"]["is_still"][int((DEPARTURE_S + 2.0) * TICKS) :].any()


def concluded(still: Stillness, contact: int, seconds: float) -> Stillness:
    for _ in range(int(seconds * TICKS)):
        still = conclude(still, wp.vec3(), contact, 0.004)
    return still


def test_vehicle_in_the_air_by_its_commander_is_never_at_rest() -> None:
    still = Stillness()
    still.still_s = 60.0
    assert concluded(still, CONTACT_UNKNOWN, 5.0).is_still == 1
    assert concluded(still, CONTACT_NONE, 5.0).is_still == 0


def test_landed_vehicle_is_at_rest_at_once_by_its_commander_and_later_by_itself() -> None:
    still = Stillness()
    still.still_s = 60.0
    flown = concluded(still, CONTACT_NONE, 5.0)
    assert concluded(flown, CONTACT_UNKNOWN, 2.0).is_still == 0
    assert concluded(flown, CONTACT_UNKNOWN, 5.0).is_still == 1
    assert concluded(flown, CONTACT_GROUND, 1.0).is_still == 1
