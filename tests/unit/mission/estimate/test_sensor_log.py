"""Reading recorded sensors: PX4 logs of two ages, sensor CSVs, gaps, rates, damage."""

import numpy as np
import pytest

from autopilot.estimator.params import ESTIMATOR_PARAMETERS
from common.geodesy import ned_from_geodetic
from common.params import ParameterTable
from mission.estimate.sensor_csv import read_csv
from mission.estimate.sensor_log import SensorLogError, prepare
from mission.estimate.sensor_ulog import MAGIC, read_ulog
from tests.unit.mission.estimate.synthetic_log import (
    GPS_DELAY_US,
    HOME,
    IMU_US,
    START_US,
    Flight,
    csv_lines,
    only,
    px4_tables,
    write_ulog,
)

TABLE = ParameterTable(ESTIMATOR_PARAMETERS)


@pytest.fixture(scope="module")
def flight():
    return Flight(10.0)


def read_back(tmp_path, tables, **options):
    path = tmp_path / "flight.ulg"
    write_ulog(path, tables, **options)
    return read_ulog(path)


@pytest.mark.parametrize("is_old", [False, True])
def test_logs_of_both_ages_give_the_sensors_in_si(tmp_path, flight, is_old):
    recording = read_back(tmp_path, px4_tables(flight, is_old))
    np.testing.assert_array_equal(recording.imu["time_us"], flight.time_us)
    np.testing.assert_allclose(recording.imu["gyro_frd"], flight.gyro, atol=1e-6)
    np.testing.assert_allclose(recording.imu["accel_frd"], flight.accel, atol=1e-5)
    np.testing.assert_allclose(recording.imu["dt_s"], IMU_US * 1e-6, rtol=1e-6)
    np.testing.assert_array_equal(recording.fixes["time_us"], flight.time_us[flight.fix])
    np.testing.assert_allclose(recording.fixes["lat_deg"], flight.places[:, 0], atol=0.6e-7)
    np.testing.assert_allclose(recording.fixes["lon_deg"], flight.places[:, 1], atol=0.6e-7)
    np.testing.assert_allclose(recording.fixes["alt_m"], flight.places[:, 2], atol=0.6e-3)
    np.testing.assert_array_equal(recording.baro["time_us"], flight.time_us[flight.slow])
    np.testing.assert_allclose(recording.baro["pressure_pa"], flight.pressure, rtol=2e-7)
    np.testing.assert_allclose(recording.mag["field_frd_gauss"], flight.mag, atol=1e-7)
    assert recording.range["is_valid"].all()
    assert not recording.is_own
    assert [track.name for track in recording.tracks] == ["log's own estimate"]


def test_the_receivers_delay_is_a_parameter_of_the_log_or_px4s_default(tmp_path, flight):
    tables = px4_tables(flight, is_old=True)
    delayed = read_back(tmp_path, tables, parameters={"EKF2_GPS_DELAY": 200.0})
    assert delayed.fixes["time_us"][0] == flight.time_us[flight.fix][0] + GPS_DELAY_US - 200_000
    nonsense = read_back(tmp_path, tables, parameters={"EKF2_GPS_DELAY": float("nan")})
    assert nonsense.fixes["time_us"][0] == flight.time_us[flight.fix][0] + GPS_DELAY_US - 110_000


def test_vehicle_imu_stands_in_for_sensor_combined(tmp_path, flight):
    tables = px4_tables(flight)
    del tables["sensor_combined"]
    fields = {"timestamp_sample": "uint64_t", "delta_angle": "float[3]", "delta_velocity": "float[3]"}
    fields |= dict.fromkeys(("delta_angle_dt", "delta_velocity_dt"), "uint32_t")
    columns = {
        "timestamp": flight.time_us + 900,
        "timestamp_sample": flight.time_us,
        "delta_angle": flight.gyro * 0.004,
        "delta_velocity": flight.accel * 0.004,
        **dict.fromkeys(("delta_angle_dt", "delta_velocity_dt"), IMU_US),
    }
    recording = read_back(tmp_path, tables | {"vehicle_imu": (fields, columns)})
    np.testing.assert_array_equal(recording.imu["time_us"], flight.time_us)
    np.testing.assert_allclose(recording.imu["accel_frd"], flight.accel, rtol=1e-5, atol=1e-5)
    slow = only((fields, columns), np.arange(len(flight.time_us)) % 125 == 0)  # 2 Hz, as PX4 logs it by default
    with pytest.raises(SensorLogError, match=r"no IMU samples: .* vehicle_imu is missing or slower than 40 Hz"):
        read_back(tmp_path, tables | {"vehicle_imu": slow})


def test_logs_of_2017_carry_barometer_and_magnetometer_beside_the_imu(tmp_path, flight):
    fields, columns = px4_tables(flight)["sensor_combined"]
    fields |= {"magnetometer_timestamp_relative": "int32_t", "magnetometer_ga": "float[3]"}
    fields |= {"baro_timestamp_relative": "int32_t", "baro_alt_meter": "float"}
    relative = np.where(np.arange(len(flight.time_us)) % 10 == 0, -2_000, 2**31 - 1)
    columns |= {"magnetometer_timestamp_relative": relative, "magnetometer_ga": flight.field}
    columns |= {"baro_timestamp_relative": relative, "baro_alt_meter": 488.0 - flight.pos_ned[:, 2]}
    log = prepare(read_back(tmp_path, {"sensor_combined": (fields, columns)}), TABLE)
    np.testing.assert_array_equal(log.mag["time_us"], flight.time_us[::10] - 2_000)
    np.testing.assert_array_equal(log.baro["time_us"], flight.time_us[::10] - 2_000)
    assert log.baro["pressure_pa"][0] == pytest.approx(101325.0 * (1.0 - 488.0 / 44330.77) ** 5.2558797, rel=1e-6)


def test_only_a_range_finder_that_faces_down_is_read(tmp_path, flight):
    tables = px4_tables(flight)
    fields, columns = tables["distance_sensor"]
    columns = columns | {"current_distance": np.where(flight.slow % 20 == 0, 60.0, 3.0)}
    log = read_back(tmp_path, tables | {"distance_sensor": (fields, columns)})
    np.testing.assert_array_equal(log.range["is_valid"], flight.slow % 20 != 0)
    for other in ({"orientation": 0}, {"signal_quality": 0}):
        log = read_back(tmp_path, tables | {"distance_sensor": (fields, columns | other)})
        assert not log.range["is_valid"].any()


def test_the_origin_is_the_mean_place_of_a_standing_vehicle(tmp_path, flight):
    log = prepare(read_back(tmp_path, px4_tables(flight)), TABLE)
    offset = ned_from_geodetic(log.origin.lat_deg, log.origin.lon_deg, log.origin.alt_m, HOME)
    standing = flight.time_us[flight.fix] - START_US < 6.5e6
    assert np.linalg.norm(offset) < 4.0 * 0.3 * np.sqrt(3.0 / np.count_nonzero(standing))
    moving = only(px4_tables(flight)["vehicle_gps_position"], ~standing)
    late = prepare(read_back(tmp_path, px4_tables(flight) | {"vehicle_gps_position": moving}), TABLE)
    first = flight.places[~standing][0]
    np.testing.assert_allclose((late.origin.lat_deg, late.origin.lon_deg), first[:2], atol=1e-8)


def test_without_a_fix_there_is_no_origin(tmp_path, flight):
    tables = px4_tables(flight)
    fields, columns = tables["vehicle_gps_position"]
    log = prepare(read_back(tmp_path, tables | {"vehicle_gps_position": (fields, columns | {"fix_type": 1})}), TABLE)
    assert log.origin is None
    assert not len(log.gnss)
    assert any("no GNSS fix" in note for note in log.recording.notes)


def test_samples_faster_than_the_tick_are_merged_without_losing_motion(tmp_path, flight):
    fields, columns = px4_tables(flight)["sensor_combined"]
    quick_us = 1_000
    columns |= {"timestamp": START_US + quick_us * np.arange(1, len(flight.time_us) + 1), "gyro_integral_dt": quick_us}
    log = prepare(read_back(tmp_path, {"sensor_combined": (fields, columns)}), TABLE)
    np.testing.assert_array_equal(np.diff(log.imu["time_us"]), 4 * quick_us)
    np.testing.assert_allclose(log.imu["dt_s"], 4e-6 * quick_us, rtol=1e-6)
    for name, truth in (("gyro_frd", flight.gyro), ("accel_frd", flight.accel)):
        np.testing.assert_allclose(log.imu[name], truth[: len(log.imu) * 4].reshape(-1, 4, 3).mean(axis=1), atol=1e-5)


@pytest.mark.parametrize("has_integral_dt", [True, False])
def test_jitter_loses_no_time(tmp_path, flight, has_integral_dt):
    fields, columns = px4_tables(flight)["sensor_combined"]
    rng = np.random.default_rng(3)
    steps_us = rng.integers(2_500, 7_000, len(flight.time_us))
    columns |= {"timestamp": START_US + np.cumsum(steps_us)}
    # as PX4's old simulator wrote it: a part of the time that passed
    columns |= {"gyro_integral_dt": (0.95 * steps_us).astype(int) if has_integral_dt else 0}
    log = prepare(read_back(tmp_path, {"sensor_combined": (fields, columns)}), TABLE)
    assert log.imu["dt_s"][1:].sum() == pytest.approx(log.duration_s, rel=1e-3)


def test_gaps_are_held_filled_or_start_anew(tmp_path, flight):
    tables = px4_tables(flight)
    seconds = flight.time_s
    held, filled, long = (2.0, 2.04), (4.0, 4.5), (6.0, 8.0)
    is_kept = np.ones(len(seconds), dtype=bool)
    for start, end in (held, filled, long):
        is_kept &= (seconds <= start) | (seconds > end)
    tables["sensor_combined"] = only(tables["sensor_combined"], is_kept)
    log = prepare(read_back(tmp_path, tables), TABLE)
    since_s = np.diff(log.imu["time_us"]) * 1e-6
    first_of_second = log.stretches[1][0]
    inside = np.delete(since_s, first_of_second - 1)
    assert inside.max() == pytest.approx(0.044, abs=1e-6)
    np.testing.assert_allclose(log.imu["dt_s"][1:first_of_second], since_s[: first_of_second - 1], atol=2e-4)
    assert len(log.stretches) == 2
    assert log.imu["time_us"][first_of_second] == START_US + 8_004_000
    assert any("2 gap(s) in the IMU samples, 2.51 s together" in note for note in log.recording.notes)
    assert any("1 gap(s) above 1 s" in note for note in log.recording.notes)


def test_a_truncated_log_is_read_as_far_as_it_goes(tmp_path, flight):
    path = tmp_path / "flight.ulg"
    write_ulog(path, px4_tables(flight))
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    recording = read_ulog(path)
    assert 100 < len(recording.imu) < len(flight.time_us)


def test_a_log_that_pyulog_would_read_for_ever_is_refused(tmp_path):
    path = tmp_path / "flight.ulg"
    path.write_bytes(MAGIC + b"\x01" + bytes(8) + b"\xff\x20\x00")  # a record of type 0, longer than the file
    with pytest.raises(SensorLogError, match="damaged so that no ULog reader can follow it"):
        read_ulog(path)


def test_a_damaged_log_is_refused_or_read(tmp_path):
    path = tmp_path / "flight.ulg"
    write_ulog(path, px4_tables(Flight(3.0)))
    content = path.read_bytes()
    rng = np.random.default_rng(1)
    outcomes = set()
    for k in range(60):
        damaged = bytearray(content)
        for place in rng.integers(0, 3_000 if k % 2 else len(content) - 8, size=12):
            damaged[place : place + 4] = rng.bytes(4)
        path.write_bytes(damaged)
        try:
            log = prepare(read_ulog(path), TABLE)
            assert (np.diff(log.imu["time_us"]) > 0).all()
            outcomes.add("read")
        except SensorLogError as error:
            assert str(error).startswith(f"{path}: ")
            outcomes.add("refused")
    assert outcomes == {"read", "refused"}


def test_a_parameter_of_a_damaged_type_is_left_out(tmp_path):
    path = tmp_path / "flight.ulg"
    write_ulog(path, px4_tables(Flight(3.0)))
    content = path.read_bytes()
    for name in (b"EKF2_MAG_NOISE", b"EKF2_GPS_DELAY"):
        path.write_bytes(content.replace(b"float " + name, b"fl\xbfat " + name, 1))
        recording = read_ulog(path)
        assert name.decode() not in recording.parameters
        assert len(recording.parameters) == 1


def test_a_csv_gives_what_the_log_gives(tmp_path, flight):
    path = tmp_path / "flight.csv"
    path.write_text("\n".join(csv_lines(flight)))
    log = prepare(read_csv(path), TABLE)
    same = prepare(read_back(tmp_path, px4_tables(flight)), TABLE)
    for name in ("imu", "gnss", "baro", "mag"):
        for field in getattr(log, name).dtype.names:
            np.testing.assert_allclose(getattr(log, name)[field], getattr(same, name)[field], rtol=1e-6, atol=1e-5)


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("5,imu,1,2,3", "line 3: imu needs 6 values (gx, gy, gz, ax, ay, az), not 3"),
        ("5,gyro,1,2,3", "line 3: sensor 'gyro' is none of imu, gnss, baro, mag, range"),
        ("5", "line 3: sensor '' is none of imu, gnss, baro, mag, range"),
        ("1.5,range,3", "line 3: time_us '1.5' is no whole number of microseconds from 0 on"),
        ("-4,range,3", "line 3: time_us '-4' is no whole number of microseconds from 0 on"),
        ("5,baro,high,20", "line 3: pressure_pa 'high' is no number"),
        ("5,gnss,91,8,488,0,0,0,1,1,1,3,12", "line 3: lat_deg 91 is out of range"),
        ("5,mag,nan,0,0", "line 3: x nan is out of range"),
    ],
)
def test_a_wrong_csv_line_is_named(tmp_path, line, sentence):
    path = tmp_path / "flight.csv"
    path.write_text(f"time_us,sensor\n4,imu,0,0,0,0,0,-9.8\n{line}\n")
    with pytest.raises(SensorLogError) as raised:
        read_csv(path)
    assert str(raised.value) == f"{path}: {sentence}"
