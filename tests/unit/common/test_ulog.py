"""Flight logs, read back by pyulog."""

from io import BytesIO

import numpy as np
import pytest
from pyulog import ULog

from common.files import part_path
from common.logs.ulog import SYNC_EVERY_BYTES, SYNC_MAGIC, UlogWriter

FIELDS = {"x": "float", "q": "float[4]", "xy_valid": "bool", "ref_timestamp": "uint64_t", "delta": "int64_t"}
INFO = {"sys_name": "Honeyguide", "ver_sw_release": 0x00_01_00_FF, "boot": ["one", "two"]}
PARAMETERS = {"MPC_XY_P": 0.95, "COM_OBL_RC_ACT": 3}


def columns(count, start_us=1_000):
    rng = np.random.default_rng(4)
    return {
        "timestamp": start_us + 4_000 * np.arange(count),
        "x": rng.normal(size=count),
        "q": rng.normal(size=(count, 4)),
        "xy_valid": np.arange(count) % 2 == 0,
        "ref_timestamp": np.full(count, 2**63 + 5, dtype=np.uint64),
        "delta": -np.arange(count) * 10**12,
    }


def write_log(target, count=50):
    with UlogWriter(target, 1_000, INFO, PARAMETERS, {"MPC_XY_P": 0.9, "COM_OBL_RC_ACT": 3}) as log:
        first = log.add_topic("vehicle_local_position", FIELDS)
        second = log.add_topic("vehicle_local_position", FIELDS, multi_id=1)
        first.write(columns(count))
        second.write_row(7_000, 1.5, 0.0, 0.1, 0.2, 0.3, True, 2**63 + 1, -3)
        log.message(8_000, 4, "Wind 5 m/s, größer als üblich")
        log.parameter("MPC_XY_P", 1.25)


def bytes_of_log(count=50):
    stream = BytesIO()
    write_log(stream, count)
    return stream.getvalue()


def test_pyulog_reads_the_rows_back():
    log = ULog(BytesIO(bytes_of_log()))
    assert not log.file_corruption
    data = log.get_dataset("vehicle_local_position").data
    expected = columns(50)
    assert data["timestamp"].tolist() == expected["timestamp"].tolist()
    assert data["x"] == pytest.approx(expected["x"].astype(np.float32), abs=0.0)
    for k in range(4):
        assert data[f"q[{k}]"] == pytest.approx(expected["q"][:, k].astype(np.float32), abs=0.0)
    assert data["xy_valid"].tolist() == expected["xy_valid"].tolist()
    assert data["ref_timestamp"].tolist() == expected["ref_timestamp"].tolist()
    assert data["delta"].tolist() == expected["delta"].tolist()


def test_one_row_equals_a_column_of_one():
    one_by_one, in_columns = BytesIO(), BytesIO()
    with UlogWriter(one_by_one, 0, {}, {}) as log:
        log.add_topic("t", FIELDS).write_row(5, 1.0, 2.0, 3.0, 4.0, 5.0, True, 6, -7)
    rows = {"timestamp": [5], "x": [1.0], "q": [[2.0, 3.0, 4.0, 5.0]], "xy_valid": [True]}
    with UlogWriter(in_columns, 0, {}, {}) as log:
        log.add_topic("t", FIELDS).write(rows | {"ref_timestamp": [6], "delta": [-7]})
    assert one_by_one.getvalue() == in_columns.getvalue()


def test_a_structured_array_is_taken_as_rows():
    rows = np.zeros(3, dtype=[("timestamp", "u8"), ("value", "f4"), ("unused", "f8")])
    rows["timestamp"], rows["value"] = [1, 2, 3], [4, 5, 6]
    stream = BytesIO()
    with UlogWriter(stream, 0, {}, {}) as log:
        log.add_topic("t", {"value": "float"}).write(rows)
    assert ULog(BytesIO(stream.getvalue())).get_dataset("t").data["value"].tolist() == [4, 5, 6]


def test_instances_messages_parameters_and_information_are_read():
    log = ULog(BytesIO(bytes_of_log()))
    assert log.get_dataset("vehicle_local_position", 1).data["x"].tolist() == [1.5]
    assert [(m.timestamp, m.log_level_str(), m.message) for m in log.logged_messages] == [
        (8_000, "WARNING", "Wind 5 m/s, größer als üblich")
    ]
    assert log.initial_parameters == pytest.approx(PARAMETERS)
    assert log.get_default_parameters(0) == pytest.approx({"MPC_XY_P": 0.9})
    assert [(name, value) for _, name, value in log.changed_parameters] == [("MPC_XY_P", 1.25)]
    assert log.msg_info_dict["sys_name"] == "Honeyguide"
    assert log.get_version_info() == (0, 1, 0, 255)
    assert log.msg_info_multiple_dict["boot"] == [["one", "two"]]


def test_every_field_starts_at_a_multiple_of_its_size():
    stream = BytesIO()
    with UlogWriter(stream, 0, {}, {}) as log:
        log.add_topic("t", {"a": "uint8_t", "b": "double", "c": "char[3]", "d": "float", "e": "int16_t"})
    sizes = {"uint64_t": 8, "uint8_t": 1, "double": 8, "char": 1, "float": 4, "int16_t": 2}
    offset = 0
    for type_text, length, _ in ULog(BytesIO(stream.getvalue())).message_formats["t"].fields:
        assert offset % sizes[type_text] == 0
        offset += sizes[type_text] * max(length, 1)
    assert offset == 8 + (1 + 7) + 8 + (3 + 1) + 4 + 2


def test_same_calls_same_bytes():
    assert bytes_of_log() == bytes_of_log()


def test_a_truncated_log_still_reads():
    content = bytes_of_log(count=200)
    for length in range(len(content) - 3_000, len(content), 7):
        log = ULog(BytesIO(content[:length]))
        assert len(log.get_dataset("vehicle_local_position").data["x"]) > 100


def test_a_log_cut_short_by_an_error_is_readable_under_its_part_name(tmp_path):
    path = tmp_path / "flight.ulg"
    with pytest.raises(KeyError), UlogWriter(path, 0, INFO, PARAMETERS) as log:
        topic = log.add_topic("t", {"value": "float"})
        topic.write_row(1, 2.0)
        topic.write({"timestamp": [2]})
    assert not path.exists()
    assert ULog(str(part_path(path))).get_dataset("t").data["value"].tolist() == [2.0]


def test_reading_resumes_at_a_sync_message_after_damage():
    stream = BytesIO()
    with UlogWriter(stream, 0, INFO, PARAMETERS) as log:
        topic = log.add_topic("vehicle_local_position", FIELDS)
        for start_us in range(0, 16_000_000, 400_000):
            topic.write(columns(100, start_us))
    content = bytearray(stream.getvalue())
    assert content.count(SYNC_MAGIC) == len(content) // SYNC_EVERY_BYTES
    damaged = SYNC_EVERY_BYTES // 2
    content[damaged : damaged + 300] = b"\xff" * 300
    read = ULog(BytesIO(bytes(content)))
    assert read.file_corruption
    times_us = read.get_dataset("vehicle_local_position").data["timestamp"]
    assert times_us[-1] == 15_996_000
    assert len(times_us) > 2_500  # of 4,000: at most one stretch between two sync messages is lost


def test_wrong_declarations_are_refused():
    log = UlogWriter(BytesIO(), 0, {}, {})
    with pytest.raises(ValueError, match="no ULog type"):
        log.add_topic("t", {"value": "float32"})
    with pytest.raises(ValueError, match="comes by itself"):
        log.add_topic("t", {"timestamp": "uint64_t"})
    log.add_topic("t", {"value": "float"}).write_row(0, 1.0)
    with pytest.raises(ValueError, match="after the first row"):
        log.add_topic("late", {"value": "float"})


def test_a_topic_is_declared_once_and_alike():
    log = UlogWriter(BytesIO(), 0, {}, {})
    log.add_topic("t", {"value": "float"})
    with pytest.raises(ValueError, match="declared twice"):
        log.add_topic("t", {"value": "float"})
    with pytest.raises(ValueError, match="other fields"):
        log.add_topic("t", {"value": "double"}, multi_id=1)
