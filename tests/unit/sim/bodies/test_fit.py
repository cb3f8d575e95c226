"""Numbers of an airframe from segments that its own kernels have made: found where they are told, else left."""

from dataclasses import replace

import numpy as np
import pytest

from common.airframe import load_airframe
from sim.bodies.fit.least_squares import errors_of, fit_airframe, fit_flights
from sim.bodies.fit.numbers import NUMBERS, fittable, with_numbers
from sim.bodies.fit.prediction import Predictor
from sim.bodies.fit.segments import LEAD_TICKS, ROWS, WINDOW_TICKS, WINDOWS, Segments, joined

X500 = fittable("x500")
BY_NAME = {number.name: number for number in NUMBERS}
HOVER = np.sqrt(1.5 * 9.80665 / (4 * 8.54858e-6)) / 1000.0
WIND_NE = np.array([[2.0, -3.0]])
TURNS = ((1, -1, -1, 1), (1, -1, 1, -1), (1, 1, -1, -1))  # what turns an x500 about each axis


def commanded(count, liveliness, seed=1):
    """Segments of an x500 near hover, its attitude tilted and its motors driven at random, that end nowhere yet."""
    rng = np.random.default_rng(seed)
    t = np.arange(ROWS) * 0.004
    command = np.zeros((count, ROWS, 8), np.float32)
    q = np.zeros((count, ROWS, 4), np.float32)
    q[..., 3] = 1.0
    q[..., :2] = 0.15 * liveliness * rng.uniform(-1, 1, (count, 1, 2))
    vel_ned = np.repeat(8.0 * liveliness * rng.uniform(-1, 1, (count, 1, 3)), ROWS, axis=1)
    for i in range(count):
        command[i, :, :4] = HOVER + 0.25 * liveliness * rng.uniform(-1, 1)
        for turn, size in zip(TURNS, (0.01, 0.01, 0.05), strict=True):
            wave = np.sin(2 * np.pi * (rng.uniform(1, 4) * t + rng.uniform()))
            command[i, :, :4] += liveliness * size * wave[:, None] * turn
    return Segments(
        log=np.zeros(count, np.int32),
        command=command,
        voltage=np.full((count, ROWS), 0.95, np.float32),
        density_ratio=np.full(count, 0.97, np.float32),
        vel_ned=vel_ned.astype(np.float32),
        q_ned_from_frd=q / np.linalg.norm(q, axis=-1, keepdims=True),
        omega_frd=np.zeros((count, ROWS, 3), np.float32),
    )


def flown(airframe, segments, noise=0.0):
    """The segments, ended as the airframe's kernels end them in a wind."""
    rng = np.random.default_rng(2)
    vel_ned, omega_frd = segments.vel_ned.copy(), segments.omega_frd.copy()
    for k in range(1, WINDOWS + 1):  # each window begins where the one before has ended
        ends = Predictor(replace(segments, omega_frd=omega_frd)).predict([airframe], WIND_NE[None])
        at = LEAD_TICKS + k * WINDOW_TICKS
        omega_frd[:, at] = ends[1][0, :, k - 1] + noise * rng.normal(size=(len(segments), 3))
    vel_ned[:, -1] = ends[0][0] + noise * rng.normal(size=(len(segments), 3))
    return replace(segments, vel_ned=vel_ned, omega_frd=omega_frd)


@pytest.fixture(scope="module")
def changed():
    changes = {"thrust_n_s2": -0.2, "drag_n_s2_m": 0.4, "spin_up_time_s": 0.5, "inertia_xx_kg_m2": 0.3}
    return with_numbers(X500, {BY_NAME[name]: change for name, change in changes.items()})


@pytest.mark.parametrize("change", [-1.0, -0.4])
def test_with_another_curve_rotors_idle_as_fast_as_before(change):
    rotor, other = X500.rotor_model, with_numbers(X500, {BY_NAME["command_curve"]: change}).rotor_model
    assert other.command_curve == pytest.approx(1.0 + change)
    idle = other.idle_command
    speed = other.command_curve * idle + (1.0 - other.command_curve) * idle**0.5
    assert speed == pytest.approx(rotor.idle_command)  # whose curve is 1: speed is the command


def test_numbers_are_found_again_in_a_wind(changed):
    segments = flown(changed, commanded(60, 1.0), noise=0.01)
    fit = fit_airframe(X500, segments, NUMBERS)
    for name in ("thrust_n_s2", "drag_n_s2_m", "spin_up_time_s", "inertia_xx_kg_m2", "inertia_yy_kg_m2"):
        number = BY_NAME[name]
        found, true = (getattr(getattr(each, number.section), name) for each in (fit.airframe, changed))
        assert abs(np.log(found / true)) < max(4 * fit.stds[number], 0.01), name
    assert fit.flights[0, :2] == pytest.approx(WIND_NE[0], abs=0.5)


def test_what_segments_do_not_tell_stays_as_it_was():
    segments = flown(X500, commanded(25, 0.02), noise=0.02)
    fit = fit_airframe(X500, segments, NUMBERS)
    assert BY_NAME["thrust_n_s2"] in fit.stds
    for name in ("drag_area_x_m2", "drag_area_y_m2", "drag_area_z_m2"):
        assert BY_NAME[name] in fit.unknown
        assert getattr(fit.airframe.body, name) == getattr(X500.body, name)


def test_the_airframe_that_flew_predicts_without_error():
    segments = flown(X500, commanded(10, 1.0))
    flights = fit_flights(X500, segments).flights
    assert errors_of(X500, segments, flights).rms() == pytest.approx((0.0, 0.0), abs=2e-3)


def test_flights_have_winds_of_their_own():
    calm, windy = commanded(12, 1.0), commanded(12, 1.0, seed=5)
    vel_ned = calm.vel_ned.copy()
    ends, _ = Predictor(calm).predict([X500], np.zeros((1, 1, 2)))
    vel_ned[:, -1] = ends[0]
    both = joined([replace(calm, vel_ned=vel_ned), replace(flown(X500, windy), log=np.ones(12, np.int32))])
    assert fit_flights(X500, both).flights[:, :2] == pytest.approx(np.array([[0.0, 0.0], WIND_NE[0]]), abs=0.3)


def test_some_segments_of_several_flights_are_still_of_as_many():
    both = joined([flown(X500, commanded(20, 1.0)), flown(X500, commanded(1, 1.0))])
    learnt = both.only(both.log == 0)
    assert learnt.log_count == both.log_count == 2
    for part in (both, learnt, both.only(both.log == 1)):
        assert np.isfinite(errors_of(X500, part, fit_flights(X500, learnt).flights).rms()).all()


def test_a_candidate_predicts_the_same_whoever_is_beside_it(changed):
    predictor = Predictor(commanded(3, 1.0))
    alone = predictor.predict([changed], WIND_NE[None])
    beside = predictor.predict([X500, changed], np.stack([0 * WIND_NE, WIND_NE]))
    assert all((one[0] == two[1]).all() for one, two in zip(alone, beside, strict=True))


def test_a_number_that_is_nothing_stays():
    bare = X500.model_copy(update={"rotor_model": X500.rotor_model.model_copy(update={"inflow_n_s2_m": 0.0})})
    fit = fit_airframe(bare, flown(bare, commanded(20, 1.0)), (BY_NAME["inflow_n_s2_m"], BY_NAME["thrust_n_s2"]))
    assert fit.unknown == {BY_NAME["inflow_n_s2_m"]: float("inf")}


def test_only_multirotors_are_fitted():
    assert load_airframe("rover").name == "rover"
    with pytest.raises(ValueError, match="airframe 'rover': only multirotors can be fitted to logs"):
        fittable("rover")
