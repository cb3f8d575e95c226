"""The estimator alone over recorded sensors, from the log to the folder with the results."""

import json
from io import BytesIO, StringIO

import numpy as np
import pytest
from pyulog import ULog
from rich.console import Console
from typer.testing import CliRunner

from autopilot.ports import POSITION_VALID, VELOCITY_VALID, Estimate
from mission.cli import app
from mission.estimate.estimate import EstimateError, _csv, _show, estimate_log, run_log
from mission.estimate.estimate_difference import difference
from mission.estimate.estimate_noise import SETTLE_US, found_noise
from mission.estimate.estimate_plots import _broken
from mission.estimate.estimate_run import EVENT_DTYPE, OUTPUT_DTYPE, SOURCES, Replay
from mission.estimate.estimate_summary import summarise_replay
from mission.estimate.sensor_log import Track, row_dtype
from tests.unit.mission.estimate.synthetic_log import (
    BARO_STD,
    GPS_STD,
    GPS_VEL_STD,
    GYRO_BIAS,
    HOME,
    MAG_STD,
    START_US,
    Flight,
    csv_lines,
    only,
    px4_tables,
    write_ulog,
)

FILES = {"estimate.ulg", "estimate.csv", "summary.json", "estimate.png", "innovations.png"}


@pytest.fixture(scope="module")
def flight():
    return Flight()


@pytest.fixture(scope="module")
def whole(tmp_path_factory, flight):
    """The folder with the results of a PX4 log; and its summary, CSV columns and console text."""
    folder = tmp_path_factory.mktemp("flight")
    write_ulog(folder / "flight.ulg", px4_tables(flight))
    return folder / "results", estimated(folder / "flight.ulg", folder / "results")


@pytest.fixture(scope="module")
def results(whole):
    """The folder with the results of a PX4 log."""
    return whole[0]


def estimated(log, folder=None, **options):
    """Summary, CSV columns and console text of a log's estimate, whose folder holds all files."""
    console = Console(file=StringIO(), width=140)
    estimate_log(log, folder, console, **options)
    folder = folder or log.with_name(f"{log.stem}-estimate")
    assert {path.name for path in folder.iterdir()} == FILES
    summary = json.loads((folder / "summary.json").read_text())
    return summary, np.genfromtxt(folder / "estimate.csv", delimiter=",", names=True), console.file.getvalue()


def without_pictures(log, **options):
    """The same without a folder: most of the time of an estimate goes into its pictures."""
    console = Console(file=StringIO(), width=140)
    estimation = run_log(log, {}, lambda *_: None, **options)
    sensors, table = estimation.sensors, estimation.table
    summary = summarise_replay(
        sensors, estimation.replay, estimation.noise, {name: float(table[name]) for name in table}
    )
    columns = np.genfromtxt(BytesIO(_csv(sensors, estimation.replay)), delimiter=",", names=True)
    _show(summary, log.parent, estimation.taken_s, console)
    return json.loads(json.dumps(summary.as_json())), columns, console.file.getvalue()


@pytest.mark.parametrize("form", ["new", "old", "csv"])
def test_the_estimate_follows_a_recorded_flight(tmp_path, flight, whole, form):
    log = tmp_path / "flight.any"
    if form == "csv":
        log.write_text("\n".join(csv_lines(flight)))
    else:
        write_ulog(log, px4_tables(flight, is_old=form == "old"))
    summary, columns, text = whole[1] if form == "new" else estimated(log)
    truth = np.searchsorted(flight.time_us, columns["time_us"])
    # Home is found again to the mean of 30 fixes, the rest to a few of them.
    for name, true in zip(("north_m", "east_m", "down_m"), flight.pos_ned[truth].T, strict=True):
        assert np.abs(columns[name] - true).max() < 0.4
    for name, true in zip(("vel_n_m_s", "vel_e_m_s", "vel_d_m_s"), flight.vel_ned[truth].T, strict=True):
        assert np.abs(columns[name] - true).max() < 0.15
    yaw_error = (columns["yaw_deg"] - np.degrees(flight.yaw[truth]) + 180.0) % 360.0 - 180.0
    assert np.abs(yaw_error).max() < 4.0  # until it moves, heading is as good as the unknown field of the body lets it
    assert np.abs(columns["roll_deg"]).max() < 0.5
    assert np.abs(columns["pitch_deg"]).max() < 0.5
    assert columns["lat_deg"][0] == pytest.approx(HOME.lat_deg, abs=4e-6)
    np.testing.assert_allclose(summary["final_gyro_bias_frd_rad_s"], GYRO_BIAS, atol=3e-4)
    assert summary["duration_s"] == pytest.approx(24.0, abs=0.01)
    assert summary["sources"]["gnss_pos"]["judged"] == summary["sources"]["gnss_pos"]["fused"] > 110
    assert summary["notes"] == []
    assert "gnss_vel" in text
    if form == "csv":
        assert summary["differences"] == {}
    else:
        answer = summary["differences"]["log's own estimate"]["rms"]
        assert max(answer["pos_n_m"], answer["pos_e_m"], answer["pos_d_m"]) < 0.25
        assert max(answer["vel_n_m_s"], answer["vel_e_m_s"], answer["vel_d_m_s"]) < 0.06
        assert 0.0 < answer["tilt_deg"] < 0.2
        assert 0.0 < answer["yaw_deg"] < 0.8


def test_innovations_of_known_noise_lie_in_their_band(tmp_path):
    flight = Flight(60.0)
    log = tmp_path / "flight.ulg"
    noise = {
        "EKF2_GPS_P_NOISE": GPS_STD,
        "EKF2_GPS_V_NOISE": GPS_VEL_STD,
        "EKF2_GPS_CORR": 0.01,
        "EKF2_BARO_NOISE": BARO_STD,
        "EKF2_MAG_NOISE": MAG_STD,
        "EKF2_ACC_NOISE": 0.03,
        "EKF2_GPS_DELAY": 130.0,
    }
    tables = px4_tables(flight)
    fields, columns = tables["vehicle_gps_position"]
    tables["vehicle_gps_position"] = (fields, columns | {"eph": 0.1, "epv": 0.1, "s_variance_m_s": 0.1})
    write_ulog(log, tables, noise, sys_name="Honeyguide")
    summary, _, _ = without_pictures(log)
    for name in ("gnss_vel", "mag", "baro"):
        source = summary["sources"][name]
        components = {"gnss_vel": 3, "mag": 3, "baro": 1}[name]
        spread = 4.0 * np.sqrt(0.95 * 0.05 / (source["judged"] * components))
        assert source["in_band"] == pytest.approx(0.95, abs=0.01 + spread), name
        assert source["judged"] == source["fused"] + source["rejected"] + source["resets"]
    assert summary["parameters"]["EKF2_MAG_NOISE"] == pytest.approx(MAG_STD)


def test_noise_parameters_of_a_foreign_log_are_not_taken_over(results):
    summary = json.loads((results / "summary.json").read_text())
    assert summary["parameters"]["EKF2_MAG_NOISE"] == pytest.approx(0.05)
    assert summary["parameters"]["EKF2_DRAG_CTRL"] == 0
    assert summary["parameters"]["EKF2_DELAY_MAX"] == pytest.approx(150.0)  # beyond the receiver's 130 ms
    assert summary["sources"]["drag"]["judged"] == 0


def test_the_log_of_the_estimate_has_px4s_topics_and_the_times_of_the_flight(results, flight):
    result = ULog(str(results / "estimate.ulg"))
    topics = {data.name: data.data for data in result.data_list}
    assert {
        "vehicle_attitude",
        "vehicle_local_position",
        "vehicle_global_position",
        "estimator_innovations",
        "estimator_innovation_variances",
        "estimator_sensor_bias",
    } <= set(topics)
    times = topics["vehicle_local_position"]["timestamp"]
    assert START_US < times[0] < times[-1] <= flight.time_us[-1]
    assert np.median(np.diff(times)) == 20_000
    truth = np.searchsorted(flight.time_us, times)
    assert np.abs(topics["vehicle_local_position"]["x"] - flight.pos_ned[truth, 0]).max() < 0.4
    variances = topics["estimator_innovation_variances"]
    assert (variances["baro_vpos"][50:] > 0.0).all()


def with_columns(tables, topic, **changes):
    """The tables with columns of one topic replaced."""
    fields, columns = tables[topic]
    return tables | {topic: (fields, columns | changes)}


def test_noise_is_found_from_the_log(tmp_path):
    log = tmp_path / "flight.ulg"
    write_ulog(log, px4_tables(Flight(60.0)))
    summary, _, text = without_pictures(log)
    true = {"gnss_vel": GPS_VEL_STD, "baro": BARO_STD, "mag": MAG_STD}
    for name, std in true.items():
        source = summary["sources"][name]
        assert source["noise_found"] == pytest.approx(std, rel=0.25), name
        assert source["normalised_by_filter"] < 0.6
        assert 0.85 < source["normalised"] < 1.15
        assert source["in_band"] == pytest.approx(0.95, abs=0.03)
    assert summary["sources"]["gnss_pos"]["noise_found"] == pytest.approx(GPS_STD, rel=0.25)
    assert "0.1 m/s" in text


@pytest.mark.parametrize("spoil", ["nothing", "settling", "resets", "rest", "outliers"])
def test_noise_is_found_in_flight_alone(spoil):
    rng, seconds = np.random.default_rng(1), 100.0
    output, events = np.zeros(1, OUTPUT_DTYPE), {name: np.zeros(0, EVENT_DTYPE) for name in SOURCES}
    baro = np.zeros(int(seconds * 10.0), EVENT_DTYPE)
    baro["time_us"] = START_US + np.arange(1, len(baro) + 1) * 100_000
    baro["innov"][:, 0], baro["innov_var"][:, 0] = rng.normal(0.0, 0.2, len(baro)), 0.4**2
    output["estimate"]["time_us"] = START_US
    some = np.zeros(len(baro), bool)
    if spoil == "settling":
        some = baro["time_us"] <= START_US + SETTLE_US
    elif spoil == "resets":
        some[::10] = baro["is_reset"][::10] = True
    elif spoil == "rest":
        some = (baro["time_us"] > START_US + 40_000_000) & (baro["time_us"] < START_US + 70_000_000)
        events["rest"] = np.zeros(30 * 25, EVENT_DTYPE)
        events["rest"]["time_us"] = START_US + 40_000_000 + np.arange(30 * 25) * 40_000
    elif spoil == "outliers":
        some[::100] = True
    baro["innov"][some, 0] = 0.0 if spoil == "rest" else 5.0
    events["baro"] = baro
    found = found_noise(Replay(output, events, 0))
    assert found.keys() == {"baro"}
    assert found["baro"].std == pytest.approx(0.2, rel=0.08)
    assert found["baro"].scale == pytest.approx(0.5, rel=0.08)


def test_answers_are_not_compared_inside_a_gap_of_ours():
    estimate = np.zeros(100, row_dtype(Estimate))
    estimate["time_us"] = START_US + np.arange(100) * 20_000 + (np.arange(100) >= 50) * 900_000
    estimate["flags"] = POSITION_VALID | VELOCITY_VALID
    estimate["vel_ned"][50:] = 10.0  # it flew on in the gap
    times = START_US + np.arange(290) * 10_000
    vel_ned = np.where(times[:, None] < estimate["time_us"][50], 0.0, np.full(3, 10.0))
    q = np.tile([0.0, 0.0, 0.0, 1.0], (len(times), 1))
    found = difference(estimate, Track("other", None, times, np.zeros((len(times), 3)), vel_ned, times, q), None)
    assert found.largest.vel_m_s == 0.0


def test_parameters_can_be_given(tmp_path, flight):
    log = tmp_path / "flight.ulg"
    write_ulog(log, px4_tables(flight))
    summary, _, _ = estimated(log, parameters=["EKF2_GPS_V_NOISE=0.4", "EKF2_MAG_TYPE=5"])
    assert summary["parameters"]["EKF2_GPS_V_NOISE"] == pytest.approx(0.4)
    assert summary["sources"]["mag"]["judged"] == 0


def test_a_fix_without_velocity_gives_position_in_a_log(tmp_path, flight):
    log = tmp_path / "flight.ulg"
    write_ulog(log, with_columns(px4_tables(flight), "vehicle_gps_position", vel_ned_valid=False))
    summary, columns, text = estimated(log)
    truth = np.searchsorted(flight.time_us, columns["time_us"])
    for name, true in zip(("north_m", "east_m", "down_m"), flight.pos_ned[truth].T, strict=True):
        assert np.abs(columns[name] - true).max() < 1.5
    assert summary["sources"]["gnss_pos"]["fused"] > 110
    assert summary["sources"]["gnss_vel"]["judged"] == 0
    assert "no GNSS velocity is used: the receiver calls it invalid" in text
    summary, _, _ = without_pictures(log, ignores_velocity_flag=True)
    assert summary["sources"]["gnss_vel"]["fused"] > 110


def test_the_note_names_the_criterion_that_no_fix_meets(tmp_path, flight):
    log = tmp_path / "flight.ulg"
    write_ulog(log, with_columns(px4_tables(flight), "vehicle_gps_position", eph=25.0, satellites_used=4))
    _, _, text = without_pictures(log)
    assert (
        "no GNSS fix is accurate enough to be used (satellites at most 4, EKF2_REQ_NSATS asks for 6; "
        "horizontal accuracy at least 25 m, EKF2_REQ_EPH asks for 10 m)"
    ) in text


def test_what_was_never_valid_is_said_in_words(tmp_path, flight):
    log = tmp_path / "flight.ulg"
    write_ulog(log, with_columns(px4_tables(flight), "vehicle_local_position", xy_valid=False))
    summary, _, text = estimated(log)
    assert "nan" not in text
    assert "position and velocity not compared: the log's own estimate was never valid" in text
    assert summary["differences"]["log's own estimate"]["rms"]["pos_n_m"] is None
    assert summary["differences"]["log's own estimate"]["median"]["tilt_deg"] < 0.2


def test_one_damaged_record_of_the_logs_answer_changes_nothing(tmp_path, flight, results):
    tables = px4_tables(flight)
    x = tables["vehicle_local_position"][1]["x"].copy()
    x[60] = 512.0
    log = tmp_path / "flight.ulg"
    write_ulog(log, with_columns(tables, "vehicle_local_position", x=x))
    summary, _, text = without_pictures(log)
    whole = json.loads((results / "summary.json").read_text())
    for figure in ("rms", "median", "largest"):
        found, expected = (s["differences"]["log's own estimate"][figure]["pos_n_m"] for s in (summary, whole))
        assert found == pytest.approx(expected, abs=0.01)
    assert "1 damaged record(s) of the log's own estimate" in text


def test_the_answer_is_compared_at_its_own_times(tmp_path, whole):
    flight = Flight()
    tables = px4_tables(flight)
    rows = flight.every(0.1) + 3  # 12 ms after a row of ours
    rows = rows[rows < len(flight.time_us)]
    fields, columns = tables["vehicle_local_position"]
    moved = {"timestamp": flight.time_us[rows]}
    moved |= dict(zip(("x", "y", "z"), flight.pos_ned[rows].T, strict=True))
    moved |= dict(zip(("vx", "vy", "vz"), flight.vel_ned[rows].T, strict=True))
    tables["vehicle_local_position"] = (fields, {name: moved.get(name, value) for name, value in columns.items()})
    fields, columns = tables["vehicle_attitude"]
    q = np.stack([np.cos(flight.yaw[rows] / 2), *np.zeros((2, len(rows))), np.sin(flight.yaw[rows] / 2)], axis=1)
    tables["vehicle_attitude"] = (fields, {"timestamp": flight.time_us[rows], "q": q})
    log = tmp_path / "flight.ulg"
    write_ulog(log, tables)
    late = without_pictures(log)[0]["differences"]["log's own estimate"]["median"]
    same = whole[1][0]["differences"]["log's own estimate"]["median"]
    assert late["vel_m_s"] == pytest.approx(same["vel_m_s"], abs=0.003)
    assert late["yaw_deg"] == pytest.approx(same["yaw_deg"], abs=0.02)


def test_lines_end_at_gaps_and_where_yaw_turns_over():
    times = np.array([0, 20, 40, 2000, 2020]) * 1000
    broken_us, values = _broken(times, np.arange(5.0))
    assert np.flatnonzero(np.isnan(values)).tolist() == [3]
    assert broken_us[3] == 2_000_000
    _, values = _broken(times, np.arange(5.0), np.array([1]))
    assert np.flatnonzero(np.isnan(values)).tolist() == [1, 4]


def test_a_rejected_fix_is_counted_and_does_not_move_the_estimate(tmp_path, flight):
    tables = px4_tables(flight)
    fields, columns = tables["vehicle_gps_position"]
    latitude = columns["latitude_deg"].copy()
    latitude[[80, 90]] += 30.0 / 111_000.0
    tables["vehicle_gps_position"] = (fields, columns | {"latitude_deg": latitude})
    log = tmp_path / "flight.ulg"
    write_ulog(log, tables)
    summary, columns, _ = estimated(log)
    assert summary["sources"]["gnss_pos"]["rejected"] == 2
    truth = np.searchsorted(flight.time_us, columns["time_us"])
    assert np.abs(columns["north_m"] - flight.pos_ned[truth, 0]).max() < 0.4


def test_without_gnss_attitude_and_height_are_estimated(tmp_path, flight):
    tables = px4_tables(flight)
    del tables["vehicle_gps_position"]
    log = tmp_path / "flight.ulg"
    write_ulog(log, tables)
    summary, columns, text = estimated(log)
    assert summary["origin"] is None
    assert summary["valid"]["position"] == 0.0
    assert "no GNSS fix" in text
    truth = np.searchsorted(flight.time_us, columns["time_us"])
    assert np.abs(columns["down_m"] - flight.pos_ned[truth, 2]).max() < 0.4
    assert np.isnan(columns["lat_deg"]).all()
    assert json.loads((tmp_path / "flight-estimate" / "summary.json").read_text())["differences"] is not None


def test_the_estimator_starts_anew_after_a_long_gap(tmp_path, flight):
    tables = px4_tables(flight)
    is_kept = (flight.time_s <= 12.0) | (flight.time_s > 15.0)
    tables["sensor_combined"] = only(tables["sensor_combined"], is_kept)
    log = tmp_path / "flight.ulg"
    write_ulog(log, tables)
    summary, columns, text = estimated(log)
    assert "the estimator started anew" in text
    truth = np.searchsorted(flight.time_us, columns["time_us"])
    is_late = columns["time_s"] > 20.0
    for name, true in (("vel_n_m_s", flight.vel_ned[truth, 0]), ("vel_e_m_s", flight.vel_ned[truth, 1])):
        assert np.abs(columns[name] - true)[is_late].max() < 0.5
    assert summary["fault_count"] == 0


def test_a_truncated_log_is_estimated_as_far_as_it_goes(tmp_path, flight):
    tables = px4_tables(flight)
    log = tmp_path / "flight.ulg"
    # Rows are written topic by topic; cutting the last topic leaves the sensors whole and half of the attitudes.
    write_ulog(log, tables)
    log.write_bytes(log.read_bytes()[:-2_000])
    summary, _, _ = without_pictures(log)
    assert summary["duration_s"] == pytest.approx(24.0, abs=0.01)


def test_pictures_are_small(results):
    for path in results.glob("*.png"):
        assert 20_000 < path.stat().st_size < 300_000


def refused(*arguments):
    """The sentence on standard error of a command that ends with exit code 2."""
    result = CliRunner().invoke(app, ["estimate", *map(str, arguments)])
    assert result.exit_code == 2
    assert result.stderr.count("\n") == 1
    return result.stderr.removeprefix("honeyguide: ").rstrip()


def test_a_folder_that_is_not_empty_stays_as_it_was(tmp_path, flight):
    log = tmp_path / "flight.ulg"
    write_ulog(log, px4_tables(flight))
    folder = tmp_path / "flight-estimate"
    folder.mkdir()
    (folder / "summary.json").write_text("mine")
    expected = "already exists and is not an empty folder; name another with --output"
    assert refused(log) == f"{folder}: {expected}"
    assert (folder / "summary.json").read_text() == "mine"
    assert [path.name for path in folder.iterdir()] == ["summary.json"]
    assert refused(log, "--output", log) == f"{log}: {expected}"


def test_logs_that_cannot_be_used_are_refused_with_one_sentence(tmp_path):
    tables = px4_tables(Flight(3.0))
    del tables["sensor_combined"]
    blind = tmp_path / "blind.ulg"
    write_ulog(blind, tables)
    assert refused(blind, "--param", "EKF2_X=1") == refused(blind)
    assert refused(blind, "--param", "EKF2_MAG_NOISE") == "--param EKF2_MAG_NOISE: must be NAME=VALUE, with a number"
    assert refused(blind) == (
        f"{blind}: no IMU samples: topic sensor_combined is missing, and vehicle_imu is missing or slower than 40 Hz"
    )
    assert refused(tmp_path / "none.ulg") == f"{tmp_path / 'none.ulg'}: No such file or directory"
    assert refused(tmp_path) == f"{tmp_path}: Is a directory"
    text = tmp_path / "notes.txt"
    text.write_text("hello")
    assert refused(text) == (f"{text}: neither a ULog nor a sensor CSV, whose first line begins with time_us,sensor")
    header = tmp_path / "header.ulg"
    header.write_bytes(blind.read_bytes()[:12])
    assert refused(header) == f"{header}: damaged so that no ULog reader can follow it"
    wrong = tmp_path / "wrong.csv"
    wrong.write_text("time_us,sensor\n5,imu,1\n")
    assert refused(wrong) == f"{wrong}: line 2: imu needs 6 values (gx, gy, gz, ax, ay, az), not 1"
    short = tmp_path / "short.csv"
    short.write_text("\n".join(csv_lines(Flight(0.5))))
    assert refused(short) == f"{short}: 0.50 s of IMU samples, at least 1 s are needed"
    assert not list(tmp_path.glob("*-estimate"))


def test_an_unwritable_place_is_named(tmp_path, flight):
    log = tmp_path / "flight.ulg"
    write_ulog(log, px4_tables(flight))
    blocker = tmp_path / "file"
    blocker.write_text("")
    with pytest.raises(EstimateError, match="file/results: Not a directory"):
        estimate_log(log, blocker / "results", Console(file=StringIO()))
