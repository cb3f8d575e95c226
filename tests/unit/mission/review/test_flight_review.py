"""What a review says of a log: figures, verdicts, innovations, spectra, whatever of it was logged."""

import numpy as np
import pytest

from common.logs.ulog import UlogWriter
from mission.review.curves import POINTS_MAX, thinned
from mission.review.flight_review import review_flight
from mission.review.innovations import ratios
from mission.review.logged_flight import ReviewError, read_flight
from mission.review.review_page import review_page
from mission.review.vibration import METRIC_FORGETS, metric, spectra
from tests.unit.mission.review import px4_logs
from tests.unit.mission.review.px4_logs import ALL, SECONDS, SHAKE_HZ, SHAKE_M_S2, START_US, write


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    path = write(tmp_path_factory.mktemp("log") / "circle.ulg", texts=[(START_US + 10_500_000, 4, "[x] Low \x1b[0m")])
    return review_flight((path,), "circle", None, None)


def read(path, *names):
    return read_flight((path,), "log", names or sorted(ALL))


def test_the_summary_has_the_flights_figures(whole):
    told = dict(whole.summary)
    assert told["Vehicle"] == "quadrotor, airframe 4001, TEST"
    assert told["In the air"] == "16.0 s"
    assert told["Greatest height"] == "5.0 m above home"
    assert told["Farthest away"] == "10 m from home"
    assert told["Charge drawn"] == "60 mAh"
    around_m_s, climb_m_s = px4_logs.RADIUS_M * px4_logs.TURN_RAD_S, px4_logs.HEIGHT_M / 2.0
    way_m = around_m_s * (SECONDS - 4.0) + 4.0 * np.hypot(around_m_s, climb_m_s)
    assert whole.distance_m == pytest.approx(way_m, rel=0.003)


def test_modes_and_failsafes_are_spans_of_time(whole):
    assert [(span.name, span.start_s, round(span.end_s, 2)) for span in whole.timeline.modes] == [
        ("Hold", 0.0, 2.0),
        ("Mission", 2.0, 10.0),
        ("Return", 10.0, 18.0),
        ("Hold", 18.0, 20.0),
    ]
    assert [(span.start_s, span.end_s) for span in whole.timeline.failsafe] == [(10.0, 18.0)]
    assert [(text.time_s, text.level, text.text) for text in whole.timeline.texts] == [(10.5, "warning", "[x] Low")]


def test_verdicts_are_those_of_a_good_flight_with_a_failsafe(whole):
    levels = {verdict.title: verdict.level.name for verdict in whole.verdicts}
    assert levels.pop("Failsafe") == "BAD"
    assert set(levels.values()) == {"GOOD"}


@pytest.mark.parametrize("missing", sorted(ALL))
def test_a_topic_that_is_missing_costs_its_own_plots_only(tmp_path, missing):
    review = review_flight((write(tmp_path / "log.ulg", topics=ALL - {missing}),), "log", None, None)
    assert sum(len(section.panels) for section in review.sections) >= 20
    lacks = [text for section in review.sections for text in section.missing]
    lacks += [*review.spectra_missing, *review.timeline.missing]
    has_another = {"vehicle_local_position_setpoint", "home_position", "estimator_innovation_variances"}
    assert missing in has_another | {"vehicle_gps_position"} or any(missing in text for text in lacks)


@pytest.mark.parametrize("only", sorted(ALL))
def test_a_log_of_one_topic_has_a_review(tmp_path, only):
    review = review_flight((write(tmp_path / "log.ulg", topics={only}),), "log", None, None)
    assert review.flight.duration_s >= 0.0


def test_what_is_no_log_is_refused_in_one_sentence(tmp_path):
    empty, other, hollow = (tmp_path / name for name in ("empty.ulg", "other.ulg", "hollow.ulg"))
    empty.write_bytes(b"")
    other.write_bytes(b"#!/bin/sh\n")
    write(hollow, topics=set())
    for path, sentence in ((empty, "is empty"), (other, "is not a ULog"), (hollow, "is a log without data")):
        with pytest.raises(ReviewError, match=f"^{path}: {sentence}$"):
            read(path)


def test_states_from_before_the_log_hold_when_it_begins(tmp_path):
    log = UlogWriter(tmp_path / "log.ulg", START_US, {}, {})
    status, attitude = log.add_topic("vehicle_status", {"nav_state": "uint8_t"}), log.add_topic("vehicle_attitude", {})
    status.write({"timestamp": [START_US - 70_000_000, START_US + 2_000_000], "nav_state": [4, 3]})
    attitude.write({"timestamp": START_US + np.arange(50) * 100_000})
    log.close()
    assert read(tmp_path / "log.ulg").topic("vehicle_status").time_s.tolist() == [0.0, 2.0]


def test_a_stray_row_of_a_damaged_log_is_left_out(tmp_path):
    path = write(tmp_path / "log.ulg")
    content = path.read_bytes()
    place = content.index(np.float32(px4_logs.circle(px4_logs.times_us(50.0))[0][200, 0]).tobytes())
    content = content[:place] + np.float32(5000.0).tobytes() + content[place + 4 :]
    middle = len(content) // 2
    path.write_bytes(content[:middle] + b"\xff" * 40 + content[middle + 40 :])
    flight = read(path)
    assert flight.notes
    assert np.nanmax(np.abs(flight.topic("vehicle_local_position")["x"])) <= px4_logs.RADIUS_M
    assert review_flight((path,), "log", None, None).summary


@pytest.mark.parametrize("seed", range(20))
def test_no_damage_ends_in_anything_but_a_review_or_a_sentence(tmp_path, seed):
    rng = np.random.default_rng(seed)
    path = write(tmp_path / "log.ulg")
    content = bytearray(path.read_bytes())
    for place in rng.integers(200, len(content), 60):
        content[place] = rng.integers(256)
    path.write_bytes(content[: rng.integers(len(content) // 4, len(content))])
    try:
        review = review_flight((path,), "log", None, None)
    except ReviewError:
        return
    assert len(review.verdicts) == 7


def test_a_parameter_that_is_no_number_is_left_out_of_the_page(tmp_path):
    path = write(tmp_path / "log.ulg", parameters={"A": float("nan"), "B": 2.0}, defaults={"A": 1.0, "B": 1.0})
    review = review_flight((path,), "log", None, None)
    assert review.changed_parameters == (("B", 2.0, 1.0),)
    assert review_page([review], "log")


def test_a_test_ratio_is_the_squared_innovation_in_gates(tmp_path):
    path = write(tmp_path / "log.ulg", parameters={"EKF2_GPS_P_GATE": 4.0})
    found = {ratio.name: ratio.ratio for ratio in ratios(read(path))}
    assert found["GNSS position"] == pytest.approx((2.0 / 4.0) ** 2)  # the greater of its axes
    assert found["Barometer"] == pytest.approx((0.1 / 5.0) ** 2)


def test_a_spectrum_shows_a_shake_at_its_frequency_with_its_strength(tmp_path):
    (accel, _), missing = spectra(read(write(tmp_path / "log.ulg")))
    assert missing == []
    assert accel.freq_hz[np.argmax(accel.amplitude[:, 2])] == pytest.approx(SHAKE_HZ, abs=accel.freq_hz[0])
    rms = np.sqrt(np.sum(accel.amplitude[:, 2] ** 2))
    assert rms == pytest.approx(SHAKE_M_S2 / np.sqrt(2.0), rel=0.02)
    assert np.all(accel.amplitude[:, :2] == 0.0)


def test_the_vibration_metric_forgets_as_px4s_does(tmp_path):
    flight = read(write(tmp_path / "log.ulg"))
    accel = flight.topic("sensor_combined").vector("accelerometer_m_s2", 3)
    steps = np.linalg.norm(np.diff(accel, axis=0), axis=1)
    expected, value = [], steps[0]
    for step in steps:
        value = (1.0 - METRIC_FORGETS) * value + METRIC_FORGETS * step
        expected.append(value)
    assert metric(flight).values[:, 0] == pytest.approx(expected, rel=1e-6)


def test_without_an_estimate_the_track_is_that_of_gnss(tmp_path):
    path = write(tmp_path / "log.ulg", topics={"vehicle_gps_position"})
    track = review_flight((path,), "log", None, None).track
    assert track.source == "GNSS positions"
    assert np.abs(track.pos_ned).max() < 0.01  # it stands still, and its degrees and metres are whole numbers


def test_thinned_curves_keep_every_peak():
    time_s, values = np.linspace(0.0, 100.0, 250_000), np.zeros((250_000, 2))
    values[123_456] = 7.0, -7.0
    times, thin = thinned(time_s, values)
    assert len(times) == len(thin) <= POINTS_MAX
    assert thin.max(axis=0).tolist() == [7.0, 0.0]
    assert thin.min(axis=0).tolist() == [0.0, -7.0]
    assert np.all(np.diff(times) >= 0.0)
