"""Logs of flights: when they begin and end, what clients see of them."""

import errno
from pathlib import Path

import pytest
from pyulog import ULog

from autopilot.params import parameter_table
from common.state_folder import StateFolder
from mission.console.host_troubles import REPORTED_MAX, SILENCE_US, Troubles
from mission.flight import Flight, FlightConfig
from mission.log.stored_logs import LOGS_KEPT_MAX, FlightLogs
from sim.world.world import WorldConfig

BARE = WorldConfig(trees_per_ha=0.0)


class Stream:
    """A log that is only a header."""

    def __init__(self):
        self.listeners = []

    def listen(self, listener):
        self.listeners.append(listener)
        return b"header"

    def stop_listening(self, listener):
        self.listeners.remove(listener)

    def flush(self):
        pass


def stored(folder, mode, stream=None):
    params = parameter_table()
    params.set("SDLOG_MODE", mode)
    return FlightLogs(folder, stream or Stream(), params, print)


def names(logs):
    return [log.name for log in logs.logs()]


@pytest.mark.parametrize(
    ("mode", "after_boot", "armed_twice"),
    [(-1, 0, 0), (0, 0, 2), (1, 1, 2), (2, 1, 1)],
)
def test_mode_says_when_logs_begin_and_end(tmp_path, mode, after_boot, armed_twice):
    logs = stored(tmp_path, mode)
    assert len(names(logs)) == after_boot
    for is_armed in (False, True, True, False, True, False):
        logs.frame(is_armed=is_armed)
    assert len(names(logs)) == armed_twice
    logs.end()


def test_names_count_on_over_runs(tmp_path):
    for _ in range(2):
        logs = stored(tmp_path, 2)
        logs.end()
    assert names(logs) == ["log_00001.ulg", "log_00002.ulg"]


def test_oldest_log_gives_way(tmp_path):
    for i in range(1, LOGS_KEPT_MAX + 1):
        (tmp_path / f"log_{i:05}.ulg").touch()
    logs = stored(tmp_path, 2)
    assert len(names(logs)) == LOGS_KEPT_MAX
    assert names(logs)[0] == "log_00002.ulg"
    logs.end()


def test_log_without_its_definitions_is_removed(tmp_path):
    (tmp_path / "log_00003.ulg.part").write_bytes(b"hea")
    logs = stored(tmp_path, 0)
    assert list(tmp_path.iterdir()) == []
    assert names(logs) == []


def test_erase_keeps_the_log_being_written_and_what_is_no_log(tmp_path):
    (tmp_path / "log_00001.ulg").touch()
    (tmp_path / "notes.txt").touch()
    logs = stored(tmp_path, 2)
    assert logs.erase() == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["log_00002.ulg", "notes.txt"]
    logs.end()
    assert logs.erase() == 1
    assert logs.read("log_00002.ulg", 0, 10) == b""


def test_log_of_a_flight_in_the_state_folder_begins_and_ends_with_arming(tmp_path):
    state = StateFolder(tmp_path)
    flight = Flight(FlightConfig(world=BARE), state=state)
    assert flight.host.storage is state
    flight.run(lambda flight: flight.controller.state.is_ready_to_arm)
    flight.controller.arm(force=False)
    armed_us = flight.time_us
    flight.run(lambda flight: flight.time_us >= armed_us + 2_000_000)
    flight.controller.disarm(force=True)
    flight.run(lambda flight: flight.time_us >= armed_us + 5_000_000)
    flight.close()
    state.close()
    (path,) = (tmp_path / "logs").iterdir()
    times = ULog(str(path)).get_dataset("vehicle_attitude").data["timestamp"]
    assert armed_us - 1_000_000 <= times[0] <= armed_us + 20_000
    assert armed_us + 2_000_000 <= times[-1] <= armed_us + 2_100_000


def test_growing_log_of_the_run_is_what_the_file_will_begin_with(tmp_path):
    flight = Flight(FlightConfig(world=BARE), folder=tmp_path)
    flight.run(lambda flight: flight.time_us >= 1_500_000)
    (log,) = flight.host.logs.logs()
    content = flight.host.logs.read(log.name, 0, log.size)
    assert flight.host.logs.erase() == 0
    flight.close()
    assert log.name == "flight.ulg"
    assert len(content) == log.size > 10_000
    assert (tmp_path / "flight.ulg").read_bytes()[: log.size] == content
    assert flight.host.logs.logs()[0].size >= log.size


def test_parameter_change_is_in_the_log(tmp_path):
    flight = Flight(FlightConfig(world=BARE), folder=tmp_path)
    flight.frame()
    flight.params.set("MIS_TAKEOFF_ALT", 7.5)
    flight.run(lambda flight: flight.time_us >= 1_500_000)
    flight.close()
    ulog = ULog(str(tmp_path / "flight.ulg"))
    assert [(name, value) for _, name, value in ulog.changed_parameters] == [("MIS_TAKEOFF_ALT", 7.5)]


def test_log_from_boot_goes_on_in_the_next_one_when_it_is_large(tmp_path, monkeypatch):
    monkeypatch.setattr("mission.log.stored_logs.PART_BYTES_MAX", 1000)
    stream = Stream()
    logs = stored(tmp_path, 2, stream)
    for _ in range(3):
        for listener in list(stream.listeners):
            listener(bytes(994))
        logs.frame(is_armed=False)
    assert names(logs) == [f"log_{k:05}.ulg" for k in range(1, 5)]
    assert len(stream.listeners) == 1
    logs.end()


def test_log_that_cannot_be_written_ends_and_the_next_one_is_tried(tmp_path, monkeypatch):
    reported, stream, params = [], Stream(), parameter_table()
    logs = FlightLogs(tmp_path, stream, params, reported.append)
    logs.frame(is_armed=True)
    logs._file.close()
    monkeypatch.setattr(logs, "_file", FullFile())
    for _ in range(3):
        stream.listeners[0](b"row")
    logs.frame(is_armed=True)
    assert (reported, stream.listeners) == (["log_00001.ulg ended: No space left on device"], [])
    for is_armed in (True, False, True):
        logs.frame(is_armed=is_armed)
    assert names(logs) == ["log_00001.ulg", "log_00002.ulg"]
    assert len(reported) == 1
    logs.end()


class FullFile:
    """A file on a full disk."""

    def write(self, _):
        raise OSError(28, "No space left on device")

    flush = close = lambda self: self.write(b"")


def test_a_disk_that_becomes_read_only_is_told_and_ends_no_flight(tmp_path, monkeypatch):
    for i in range(1, LOGS_KEPT_MAX + 1):
        (tmp_path / f"log_{i:05}.ulg").touch()
    reported = []
    params = parameter_table()
    params.set("SDLOG_MODE", 0)
    stream = Stream()
    logs = FlightLogs(tmp_path, stream, params, reported.append)

    def refuse(*_, **__):
        raise OSError(errno.EROFS, "Read-only file system")

    for name in ("open", "unlink", "replace"):
        monkeypatch.setattr(Path, name, refuse)
    for is_armed in (True, True, False):
        logs.frame(is_armed=is_armed)
    assert logs.erase() == 0
    assert logs.read("log_00001.ulg", 0, 10) == b""
    assert reported == [f"log_{LOGS_KEPT_MAX + 1:05}.ulg ended: Read-only file system"]
    assert len(logs.logs()) == LOGS_KEPT_MAX
    assert stream.listeners == []


def test_a_log_begun_between_two_writes_starts_with_the_first_row_that_it_gets(tmp_path):
    flight = Flight(FlightConfig(world=BARE))
    flight.run(lambda flight: flight.time_us >= 1_300_000)
    records = []
    header = flight.recorder.listen(records.append)
    flight.run(lambda flight: flight.time_us >= 2_500_000)
    flight.close()
    (tmp_path / "log.ulg").write_bytes(header + b"".join(records))
    log = ULog(str(tmp_path / "log.ulg"))
    times_us = log.get_dataset("vehicle_attitude").data["timestamp"]
    assert times_us[0] < 1_300_000
    assert log.start_timestamp == times_us[0]


def test_troubles_are_told_once_and_of_many_kinds_few_are_remembered():
    now_us = 0
    troubles = Troubles(lambda: now_us)
    for _ in range(20):
        now_us += SILENCE_US // 10
        troubles.note("flight.ulg ended")
    assert troubles.take() == ["flight.ulg ended"]
    for k in range(10 * REPORTED_MAX):
        troubles.note(f"photo {k} not stored")
    assert len(troubles.take()) == 10 * REPORTED_MAX
    assert len(troubles._noted_us) <= REPORTED_MAX
    now_us += SILENCE_US + 1
    troubles.note(f"photo {10 * REPORTED_MAX - 1} not stored")
    assert len(troubles.take()) == 1
