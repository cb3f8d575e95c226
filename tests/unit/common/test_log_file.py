"""Logs that grow for days and logs that cannot be written: parts that can be read, and no exception."""

import errno
from io import BytesIO

import numpy as np
import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import all as mavlink
from pyulog import ULog

from common.logs import log_file
from common.logs.log_file import PARTS_KEPT_MAX, LogFile
from common.logs.tlog import TlogWriter
from common.logs.ulog import UlogWriter


class FullDisk(BytesIO):
    """Takes so many bytes; of more it tells when it is written or when it is flushed."""

    def __init__(self, room, *, at_flush=False):
        super().__init__()
        self._room = room
        self._at_flush = at_flush

    def write(self, data):
        if not self._at_flush:
            self._fill(len(data))
        return super().write(data)

    def flush(self):
        self._fill(self.tell())

    def _fill(self, count):
        if self.tell() + count > self._room:
            raise OSError(errno.ENOSPC, "No space left on device")


@pytest.fixture
def small_parts(monkeypatch):
    monkeypatch.setattr(log_file, "PART_BYTES_MAX", 10_000)


def names(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize("at_flush", [False, True])
def test_a_full_disk_ends_the_log_and_is_told_once(at_flush):
    reported = []
    log = LogFile(FullDisk(1000, at_flush=at_flush), reported.append)
    for _ in range(50):
        assert log.write(bytes(100)) == 100
        log.flush()
    log.close()
    assert reported == ["log ended: No space left on device"]


def test_a_full_disk_noticed_when_the_log_is_closed_is_told():
    reported = []
    log = LogFile(FullDisk(10, at_flush=True), reported.append)
    log.write(bytes(100))
    log.close()
    assert reported == ["log ended: No space left on device"]


def test_who_does_not_listen_gets_the_exception():
    log = LogFile(FullDisk(10))
    with pytest.raises(OSError, match="No space"):
        log.write(bytes(100))


def test_every_part_of_a_ulog_is_a_whole_log_and_no_row_is_lost(tmp_path, small_parts):
    with UlogWriter(tmp_path / "flight.ulg", 0, {"sys_name": "x"}, {"A": 1.0}) as log:
        topic = log.add_topic("place", {"x": "float"})
        for second in range(40):
            log.go_on(second * 1000)
            topic.write({"timestamp": second * 1000 + np.arange(50), "x": np.zeros(50)})
            if second == 1:
                log.parameter("A", 2.0)
    parts = [tmp_path / "flight.ulg", *(tmp_path / f"flight-{k}.ulg" for k in range(2, 5))]
    assert names(tmp_path) == sorted(path.name for path in parts)
    logs = [ULog(str(path)) for path in parts]
    times = [time for part in logs for time in part.data_list[0].data["timestamp"]]
    assert times == [second * 1000 + k for second in range(40) for k in range(50)]
    assert [part.initial_parameters["A"] for part in logs] == [1.0, 2.0, 2.0, 2.0]
    assert [part.start_timestamp for part in logs] == [
        0,
        *(part.data_list[0].data["timestamp"][0] for part in logs[1:]),
    ]


def test_every_part_of_a_telemetry_log_can_be_read(tmp_path, small_parts):
    sender = mavlink.MAVLink(None)
    with TlogWriter(tmp_path / "flight.tlog") as log:
        for k in range(1000):
            log.frame(k * 1000, mavlink.MAVLink_heartbeat_message(2, 12, 0, k, 0, 3).pack(sender))
    modes = []
    assert len(log.parts()) > 1
    for part in log.parts():
        reader = mavutil.mavlink_connection(str(part))
        while (message := reader.recv_match(type="HEARTBEAT")) is not None:
            modes.append(message.custom_mode)
        reader.close()
    assert modes == list(range(1000))


def test_the_oldest_parts_give_way(tmp_path, small_parts):
    log = LogFile(tmp_path / "flight.tlog")
    for _ in range(12):
        log.write(bytes(10_000))
        assert log.is_full
        log.next_part()
    assert names(tmp_path) == sorted([*(f"flight-{k}.tlog" for k in range(6, 13)), "flight-13.tlog.part"])
    assert len(names(tmp_path)) == PARTS_KEPT_MAX == len(log.parts())
    log.close()
    assert [path.name for path in log.parts()] == [f"flight-{k}.tlog" for k in range(6, 14)]
    assert all(path.exists() for path in log.parts())
