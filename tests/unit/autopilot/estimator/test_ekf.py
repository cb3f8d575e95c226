"""The estimator on simulated flights: accuracy, consistency, start, and what it does when a sensor fails."""

from typing import Any

import numpy as np
import pytest
import warp as wp

from autopilot.estimator.state import SLOW, SLOW_COUNT, SLOW_COV
from autopilot.ports import (
    ACCEL_DOUBTED,
    DEAD_RECKONING,
    HEIGHT_VALID,
    POSITION_VALID,
    TILT_ALIGNED,
    VELOCITY_VALID,
    YAW_ALIGNED,
)
from tests.unit.autopilot.estimator.flights import Flight, SensorNoise, freeze, make_flight, silence, stacked
from tests.unit.autopilot.estimator.run import (
    assert_same,
    default_ekf,
    errors,
    fields,
    reset_one,
    rms,
    run,
    share_in_band,
)

TICKS = 250  # per second
ALL_VALID = TILT_ALIGNED | YAW_ALIGNED | POSITION_VALID | VELOCITY_VALID | HEIGHT_VALID
AIRBORNE = 10 * TICKS
NOISE_FREE = SensorNoise(*[0.0] * 13)


@pytest.fixture(scope="module")
def flights() -> list[Flight]:
    return [make_flight(seed=seed, duration_s=60.0) for seed in range(12)]


@pytest.fixture(scope="module")
def traces(flights: list[Flight]) -> Any:
    return run(default_ekf(len(flights)), stacked(flights))


def flown(change: Any, duration_s: float = 60.0, **changes: float) -> tuple[Flight, Any]:
    """A flight whose samples `change` has spoilt, and the trace."""
    flight = make_flight(seed=5, duration_s=duration_s)
    change(flight.samples)
    return flight, run(default_ekf(**changes), flight.samples)[0]


def test_errors_are_within_their_limits(flights: list[Flight], traces: Any) -> None:
    found = [errors(flight, trace) for flight, trace in zip(flights, traces, strict=True)]
    pos = rms([rms(error.pos[AIRBORNE:]) for error in found])
    vel = rms([rms(error.vel[AIRBORNE:]) for error in found])
    assert np.all(pos[:2] < 0.75)
    assert pos[2] < 0.8
    assert np.all(vel < 0.12)
    assert rms([rms(error.tilt_deg[AIRBORNE:]) for error in found]) < 0.5
    assert rms([rms(error.yaw_deg[AIRBORNE:]) for error in found]) < 2.0


@pytest.mark.parametrize(
    ("aid", "components"), [("gnss_pos", 2), ("gnss_vel", 3), ("gnss_height", 1), ("baro", 1), ("mag", 3)]
)
def test_normalised_innovations_are_in_their_band(traces: Any, aid: str, components: int) -> None:
    fraction = np.mean([share_in_band(trace, aid, components, AIRBORNE) for trace in traces])
    assert 0.92 < fraction < 0.98  # 0.95 expected; the magnetometer's soft iron is covered by a wider walk


def squared_ratios(flight: Flight, trace: Any) -> dict[str, float]:
    """Mean square of error over published deviation, in flight."""
    every = slice(AIRBORNE, None, 125)  # half a second apart: nearly independent, but for the slow errors
    found, estimate = errors(flight, trace), trace["estimate"][every]
    ratios = {
        "tilt": np.radians(found.tilt_deg[every]) / estimate["tilt_std"],
        "yaw": np.radians(found.yaw_deg[every]) / estimate["yaw_std"],
        "vel": found.vel[every, 0] / estimate["vel_std"],
        "north": found.pos[every, 0] / estimate["pos_h_std"],
        "east": found.pos[every, 1] / estimate["pos_h_std"],
        "down": found.pos[every, 2] / estimate["pos_v_std"],
    }
    return {name: float(np.mean(ratio**2)) for name, ratio in ratios.items()}


@pytest.mark.parametrize("boot_std", [0.1, 100.0])
def test_errors_are_as_large_as_the_filter_says(flights: list[Flight], boot_std: float) -> None:
    traces = run(default_ekf(len(flights), EKF2_BOOT_STD=boot_std), stacked(flights))
    found = [squared_ratios(flight, trace) for flight, trace in zip(flights, traces, strict=True)]
    for name in found[0]:
        # 1 expected; each flight has one draw of the slow errors, so twelve do not average them out
        assert 0.2 < np.mean([ratios[name] for ratios in found]) < 3.0, name


def test_accuracy_says_what_the_receiver_can_know(flights: list[Flight]) -> None:
    """A mean of many fixes is as wrong as the wander that they share."""
    unknown, known = (
        run(default_ekf(EKF2_BOOT_STD=std), flights[0].samples)[0]["estimate"]["pos_h_std"] for std in (100.0, 0.1)
    )
    # a vehicle that does not know its place learns the wander only as it changes: a little better than 0.6 m
    assert 0.4 < unknown[-1] < 0.6
    assert known[AIRBORNE] < 0.3
    assert known[AIRBORNE] < known[-1] < unknown[-1]


def test_biases_are_found(flights: list[Flight], traces: Any) -> None:
    for flight, trace in zip(flights, traces, strict=True):
        estimate = trace["estimate"][-1]
        np.testing.assert_allclose(estimate["gyro_bias_frd"], flight.gyro_bias, atol=1e-3)
        np.testing.assert_allclose(estimate["accel_bias_frd"], flight.accel_bias, atol=0.03)


def test_ready_within_ten_seconds_of_power_on(traces: Any) -> None:
    flags = traces["estimate"]["flags"][:, 5 * TICKS]
    assert np.all(flags & ALL_VALID == ALL_VALID)


def test_answers_are_sane_before_the_first_fix(traces: Any) -> None:
    early = traces["estimate"][:, : TICKS // 2]
    assert np.all(np.isfinite(early["q_ned_from_frd"]))
    np.testing.assert_allclose(np.linalg.norm(early["q_ned_from_frd"], axis=-1), 1.0, atol=1e-5)
    assert np.all(np.abs(early["vel_ned"]) < 0.1)
    assert not np.any(early["flags"][:, 50] & POSITION_VALID)


def test_noise_free_flight_is_followed_within_centimetres() -> None:
    flight = make_flight(duration_s=40.0, noise=NOISE_FREE)
    trace = run(default_ekf(), flight.samples)[0]
    found = errors(flight, trace)
    # what is left: first-order integration over 4 ms, and the output predictor's lag of a quarter of a second
    assert np.abs(found.pos[AIRBORNE:]).max() < 0.1
    assert np.abs(found.vel[AIRBORNE:]).max() < 0.03
    assert found.tilt_deg[AIRBORNE:].max() < 0.1
    assert not trace["baro_inbox"]["is_stuck"][AIRBORNE:].any()
    for name in ("gnss", "baro", "mag", "range"):
        assert not trace[f"{name}_inbox"]["is_stuck"][AIRBORNE:].any(), name


def test_late_gnss_is_fused_at_its_own_time() -> None:
    """With a delay that the horizon does not reach, position lags; with one that it does, the delay leaves no trace."""
    lag = {}
    for delay_s in (0.0, 0.12):
        flight = make_flight(duration_s=40.0, noise=NOISE_FREE, gnss_delay_s=delay_s, rate=0.6)
        lag[delay_s] = np.abs(errors(flight, run(default_ekf(), flight.samples)[0]).pos[AIRBORNE:]).max()
    assert lag[0.12] == pytest.approx(lag[0.0], abs=0.01)
    moved = flight.samples.copy()
    moved["gnss"]["time_us"][moved["gnss"]["time_us"] > 0] += 120_000  # a driver that hides the delay
    assert np.abs(errors(flight, run(default_ekf(), moved)[0]).pos[AIRBORNE:]).max() > 5.0 * lag[0.12]


def test_jittering_imu_intervals_change_nothing() -> None:
    flight = make_flight(duration_s=40.0, noise=NOISE_FREE, jitter=0.4)
    found = errors(flight, run(default_ekf(), flight.samples)[0])
    assert np.abs(found.pos[AIRBORNE:]).max() < 0.1
    assert found.tilt_deg[AIRBORNE:].max() < 0.1


def test_healthy_accelerometer_is_never_doubted(traces: Any) -> None:
    assert not np.any(traces["estimate"]["flags"] & ACCEL_DOUBTED)


@pytest.mark.parametrize("bias_m_s2", [2.0, -3.0])
def test_accelerometer_that_contradicts_gnss_and_barometer_is_doubted_and_its_bias_found(bias_m_s2: float) -> None:
    at, over = 30 * TICKS, 50 * TICKS

    def shake(samples: Any) -> None:
        samples["imu"]["accel_frd"][at:over, 2] += bias_m_s2

    flight, trace = flown(shake)
    is_doubted = (trace["estimate"]["flags"] & ACCEL_DOUBTED) != 0
    assert not is_doubted[:at].any()
    assert is_doubted[at + 3 * TICKS : over].all()
    assert trace["estimate"]["reset_count"][-1] == 0
    assert trace["estimate"]["accel_bias_frd"][over - TICKS, 2] == pytest.approx(bias_m_s2, abs=0.5)
    assert np.abs(errors(flight, trace).pos[at:, 2]).max() < 5.0


def test_gate_rejects_gnss_jump() -> None:
    at = 30 * TICKS

    def jump(samples: Any) -> None:
        samples["gnss"]["pos_ned"][at : at + 2 * TICKS, 0] += 20.0

    flight, trace = flown(jump)
    assert trace["gnss_pos"]["reject_count"][at : at + 3 * TICKS].max() >= 8
    assert trace["gnss_pos"]["reset_count"][-1] == 0
    assert np.abs(errors(flight, trace).pos[at:, 0]).max() < 2.0


def test_lasting_gnss_jump_resets_position_and_reports_it() -> None:
    at = 30 * TICKS

    def jump(samples: Any) -> None:
        samples["gnss"]["pos_ned"][at:, 0] += 20.0

    flight, trace = flown(jump)
    estimate = trace["estimate"]
    assert estimate["reset_count"][at] == 0
    assert estimate["reset_count"][-1] == 1
    assert estimate["pos_reset_ned"][-1, 0] == pytest.approx(20.0, abs=2.0)
    step = int(np.flatnonzero(np.diff(estimate["reset_count"]))[0]) + 1
    seen = estimate["pos_ned"][step] - estimate["pos_ned"][step - 1]
    np.testing.assert_allclose(seen, estimate["pos_reset_ned"][-1], atol=0.1)
    assert errors(flight, trace).pos[-1, 0] == pytest.approx(20.0, abs=2.0)


def test_without_gnss_it_reckons_and_says_so() -> None:
    at = 30 * TICKS
    flight, trace = flown(lambda samples: silence(samples["gnss"], at))
    flags = trace["estimate"]["flags"]
    assert flags[at + 3 * TICKS] & DEAD_RECKONING
    assert flags[at + 3 * TICKS] & POSITION_VALID
    assert not flags[at + 8 * TICKS] & (POSITION_VALID | VELOCITY_VALID)
    assert flags[-1] & HEIGHT_VALID
    assert flags[-1] & TILT_ALIGNED
    found = errors(flight, trace)
    assert found.tilt_deg[at:].max() < 1.0
    assert np.abs(found.pos[at:, 2]).max() < 1.5
    assert trace["gnss_pos"]["is_active"][-1] == 0


def test_position_returns_with_gnss() -> None:
    lost, back = 20 * TICKS, 40 * TICKS
    flight, trace = flown(lambda samples: silence(samples["gnss"], lost, back))
    assert not trace["estimate"]["flags"][back - 1] & POSITION_VALID
    assert trace["estimate"]["flags"][back + 2 * TICKS] & POSITION_VALID
    assert np.abs(errors(flight, trace).pos[back + 5 * TICKS :, :2]).max() < 3.0


def test_a_fix_without_velocity_gives_position() -> None:
    def without_velocity(samples: Any) -> None:
        samples["gnss"]["vel_ned"] = 0.0
        samples["gnss"]["vel_std"] = 1000.0

    flight, trace = flown(without_velocity)
    flags = trace["estimate"]["flags"][AIRBORNE:]
    assert np.all(flags & (POSITION_VALID | VELOCITY_VALID) == (POSITION_VALID | VELOCITY_VALID))
    assert trace["gnss_vel"]["judged_time_us"].max() == 0
    found = errors(flight, trace)
    assert np.abs(found.pos[AIRBORNE:]).max() < 3.0
    assert np.all(rms(found.vel[AIRBORNE:]) < 0.4)
    assert rms(found.tilt_deg[AIRBORNE:]) < 1.0


def test_stuck_barometer_hands_height_to_gnss() -> None:
    at = 30 * TICKS
    flight, trace = flown(lambda samples: freeze(samples["baro"], at, ("pressure_pa",)))
    assert trace["baro_inbox"]["is_stuck"][at + TICKS] == 1
    assert trace["baro"]["is_active"][at + TICKS] == 0
    assert trace["estimate"]["flags"][-1] & HEIGHT_VALID
    assert np.abs(errors(flight, trace).pos[at:, 2]).max() < 2.5  # GNSS height wanders by 0.9 m


def test_stuck_magnetometer_is_dropped_before_it_turns_heading() -> None:
    at = 30 * TICKS
    flight, trace = flown(lambda samples: freeze(samples["mag"], at, ("field_frd_gauss",)))
    assert trace["mag_inbox"]["is_stuck"][at + TICKS] == 1
    assert trace["mag"]["is_active"][at + TICKS] == 0
    assert np.abs(errors(flight, trace).yaw_deg[at:]).max() < 2.0
    assert trace["estimate"]["flags"][-1] & YAW_ALIGNED


def test_stuck_gnss_is_treated_as_lost() -> None:
    at = 30 * TICKS
    _, trace = flown(lambda samples: freeze(samples["gnss"], at, ("pos_ned", "vel_ned")))
    assert trace["gnss_inbox"]["is_stuck"][at + TICKS] == 1
    assert not trace["estimate"]["flags"][at + 10 * TICKS] & POSITION_VALID


@pytest.mark.parametrize(
    ("name", "fields", "seconds"),
    [
        ("gnss", ("pos_ned", "vel_ned"), 2.0),
        ("baro", ("pressure_pa",), 4.0),
        ("mag", ("field_frd_gauss",), 3.0),
        ("range", ("distance_m",), 4.0),
    ],
)
def test_sensor_that_shows_no_noise_is_stuck_once_the_vehicle_has_moved(
    name: str, fields: tuple[str, ...], seconds: float
) -> None:
    at = 25 * TICKS
    flight = make_flight(duration_s=40.0, noise=NOISE_FREE, rate=0.6)
    for solution in ("pos_ned", "vel_ned"):
        flight.samples["gnss"][solution] = np.round(flight.samples["gnss"][solution], 3)  # as receivers report it
    freeze(flight.samples[name], at, fields)
    trace = run(default_ekf(), flight.samples)[0]
    is_stuck = trace[f"{name}_inbox"]["is_stuck"]
    assert not trace[f"{name}_inbox"]["resolves_noise"].any()
    assert not is_stuck[AIRBORNE:at].any()
    assert is_stuck[at + int(seconds * TICKS) :].all()


def test_coarse_barometer_that_repeats_is_not_stuck() -> None:
    def quantise(samples: Any) -> None:
        samples["baro"]["pressure_pa"] = np.round(samples["baro"]["pressure_pa"] / 8.0) * 8.0  # 0.7 m

    flight, trace = flown(quantise)
    assert trace["baro_inbox"]["repeat_count"].max() > 20
    assert not trace["baro_inbox"]["is_stuck"].any()
    assert np.abs(errors(flight, trace).pos[AIRBORNE:, 2]).max() < 1.5


def test_heading_taken_on_a_magnetic_pad_is_mended_by_gnss_velocity() -> None:
    def disturb(samples: Any) -> None:
        samples["mag"]["field_frd_gauss"][: int(6.5 * TICKS), 1] += 0.2  # steel under it until it has left the ground

    flight, trace = flown(disturb, duration_s=90.0)
    found = errors(flight, trace)
    assert abs(found.yaw_deg[6 * TICKS]) > 45.0
    assert np.abs(found.yaw_deg[60 * TICKS :]).max() < 3.0
    assert np.abs(found.vel[60 * TICKS :]).max() < 0.4


def test_noisy_source_is_trusted_less() -> None:
    rng = np.random.default_rng(0)
    at = 20 * TICKS

    def shake(samples: Any) -> None:
        times, index = np.unique(samples["gnss"]["time_us"][at:], return_inverse=True)
        samples["gnss"]["vel_ned"][at:] += rng.normal(0.0, 1.0, (len(times), 3))[index]

    flight, trace = flown(shake)
    assert trace["gnss_vel"]["noise_scale"][-1] > 10.0
    assert np.all(rms(errors(flight, trace).vel[at + 10 * TICKS :]) < 0.4)


def test_covariance_stays_symmetric_and_positive_for_ten_minutes() -> None:
    flight = make_flight(duration_s=600.0, size_m=30.0, rate=0.5)
    ekf = default_ekf()
    run(ekf, flight.samples, keep_trace=False)
    rows = ekf.covariance.numpy()[0].astype(float)
    among_slow = rows[SLOW_COV, : SLOW_COUNT**2].reshape(SLOW_COUNT, SLOW_COUNT)
    covariance = np.block([[rows[:SLOW], rows[SLOW:SLOW_COV].T], [rows[SLOW:SLOW_COV], among_slow]])
    np.testing.assert_array_equal(covariance, covariance.T)
    scale = np.sqrt(np.diag(covariance))
    assert np.all(scale > 0.0)
    assert np.linalg.eigvalsh(covariance / np.outer(scale, scale)).min() > 0.0
    assert ekf.rows.numpy()["fault_count"][0] == 0


def test_a_state_that_is_no_number_is_forgotten_at_once() -> None:
    flight = make_flight(seed=5, duration_s=20.0)
    ekf = default_ekf()
    run(ekf, flight.samples[: 15 * TICKS], keep_trace=False)
    ekf.rows.numpy()["nominal"]["pos_ned"][0] = np.nan
    trace = run(ekf, flight.samples[15 * TICKS :])[0]
    lost = ~np.isfinite(trace["estimate"]["pos_ned"]).all(axis=1)
    assert lost.sum() < 0.05 * TICKS
    assert trace["fault_count"][-1] == 1


NUMBERS = (
    ("imu", "gyro_frd"),
    ("gnss", "pos_ned"),
    ("gnss", "vel_ned"),
    ("baro", "pressure_pa"),
    ("mag", "field_frd_gauss"),
    ("range", "distance_m"),
)


def test_a_sample_that_is_no_number_is_not_taken_for_one() -> None:
    flight = make_flight(seed=5, duration_s=30.0)
    spoilt = np.empty((len(NUMBERS), len(flight.samples)), flight.samples.dtype)
    spoilt[:] = flight.samples
    for samples, (sensor, name) in zip(spoilt, NUMBERS, strict=True):
        time_us = samples[sensor]["time_us"]
        first = 15 * TICKS + np.flatnonzero(np.diff(time_us[15 * TICKS :]))[0] + 1
        samples[sensor][name][time_us == time_us[first]] = np.nan
    ekf = default_ekf(len(spoilt))
    trace = run(ekf, spoilt)
    for label, states, row, yaw in zip(NUMBERS, trace, ekf.rows.numpy(), ekf.yaw.numpy(), strict=True):
        assert row["fault_count"] == 0, label
        assert np.abs(errors(flight, states).pos[-1]).max() < 2.0, label
        for leaf, value in (fields(row) | fields(yaw, "yaw.")).items():
            assert np.isfinite(value).all(), (label, leaf)


def test_one_vehicle_equals_its_row_among_sixteen() -> None:
    flights = [make_flight(seed=seed, duration_s=12.0) for seed in range(16)]
    many, one = default_ekf(16), default_ekf(1)
    run(many, stacked(flights), keep_trace=False)
    run(one, flights[11].samples, keep_trace=False)
    assert_same(many.rows.numpy()[11], one.rows.numpy()[0])
    np.testing.assert_array_equal(many.covariance.numpy()[11], one.covariance.numpy()[0])


def test_reset_touches_one_row() -> None:
    flights = [make_flight(seed=seed, duration_s=12.0) for seed in range(3)]
    ekf, fresh = default_ekf(3), default_ekf(1)
    run(ekf, stacked(flights), keep_trace=False)
    before = ekf.rows.numpy().copy()
    wp.launch(reset_one, 1, inputs=[ekf, 1], device="cpu")
    after = ekf.rows.numpy()
    assert_same(after[0], before[0])
    assert_same(after[2], before[2])
    assert_same(after[1], fresh.rows.numpy()[0])
    run(ekf, stacked(flights), keep_trace=False)
    run(fresh, flights[1].samples, keep_trace=False)
    assert_same(ekf.rows.numpy()[1], fresh.rows.numpy()[0])


def test_heading_waits_for_a_magnetometer() -> None:
    on = 5 * TICKS

    def late(samples: Any) -> None:
        samples["mag"][:on] = np.zeros((), dtype=samples["mag"].dtype)

    flight, trace = flown(late, duration_s=20.0)
    assert not trace["estimate"]["flags"][on - 1] & YAW_ALIGNED
    assert trace["estimate"]["flags"][on - 1] & TILT_ALIGNED
    assert trace["estimate"]["flags"][on + 2 * TICKS] & YAW_ALIGNED
    assert np.abs(errors(flight, trace).yaw_deg[on + 2 * TICKS :]).max() < 5.0
