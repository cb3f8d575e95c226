"""Folders of MAVLink FTP that ArduPilot's clients look for: `@MISSION`, `@SYS`, `APM/LOGS`. None is on a disk.

In: the vehicle's lists, logs and links. Out: files made when they are opened; an uploaded list is taken when its file
is closed, as a whole or not at all.
"""

from collections.abc import Callable, Mapping
from functools import partial

from autopilot.interface.item_lists import ListKind
from autopilot.interface.platform import LogFile, StoredLogs
from autopilot.interface.vehicle_state import Severity
from autopilot.mavlink.channel import Endpoint
from autopilot.mavlink.services.files.ftp_files import FtpError, Nak, OpenFile, Snapshot, VirtualEntry, VirtualFolder
from autopilot.mavlink.services.identity import banner
from autopilot.mavlink.services.mission_protocol import MissionService
from autopilot.mavlink.telemetry.board import FREE_BYTES
from autopilot.mavlink.wire.mission_file import HEADER, ITEM, MissionFileError, packed_items, unpacked_items

MISSION_FILES = {"mission.dat": ListKind.MISSION, "fence.dat": ListKind.FENCE, "rally.dat": ListKind.RALLY}
LAST_LOG = "LASTLOG.TXT"


def virtual_folders(endpoint: Endpoint, missions: MissionService) -> Mapping[str, VirtualFolder]:
    """The folders of a vehicle by their paths; none in PX4's dialect."""
    if endpoint.dialect.name != "ardupilot":
        return {}
    return {
        "@MISSION": MissionFolder(endpoint, missions),
        "@SYS": SystemFolder(endpoint),
        "APM/LOGS": LogFolder(endpoint),
    }


class _ReadOnly:
    """A folder in which nothing is written."""

    def open_to_write(self, _: str, /) -> OpenFile:
        raise FtpError(Nak.FILE_PROTECTED)


class MissionFolder:
    """Mission, fence and rally points as files."""

    def __init__(self, endpoint: Endpoint, missions: MissionService) -> None:
        self._endpoint = endpoint
        self._missions = missions

    def entries(self) -> list[VirtualEntry]:
        sizes = {
            name: HEADER.size + self._missions.served_count(kind) * ITEM.size for name, kind in MISSION_FILES.items()
        }
        return [VirtualEntry(name, size) for name, size in sizes.items()]

    def open(self, name: str) -> OpenFile:
        kind = _kind(name)
        return Snapshot(packed_items(kind, self._missions.served(kind), self._missions.current_seq(kind)))

    def open_to_write(self, name: str) -> OpenFile:
        return _ListUpload(self._endpoint, self._missions, _kind(name), name)


def _kind(name: str) -> ListKind:
    kind = MISSION_FILES.get(name)
    if kind is None:
        raise FileNotFoundError
    return kind


class _ListUpload:
    """A list on its way in."""

    size = 0

    def __init__(self, endpoint: Endpoint, missions: MissionService, kind: ListKind, name: str) -> None:
        self._endpoint = endpoint
        self._missions = missions
        self._kind = kind
        self._name = name
        self._content = bytearray()
        self._longest = HEADER.size + ITEM.size * (endpoint.vehicle.lists.capacity(kind) + 1)  # home besides

    def read(self, offset: int, count: int) -> bytes:
        return bytes(self._content[offset : offset + count])

    def write(self, offset: int, data: bytes) -> None:
        end = offset + len(data)
        if end > self._longest:
            raise FtpError(Nak.INVALID_DATA_SIZE)
        self._content.extend(bytes(max(end - len(self._content), 0)))
        self._content[offset:end] = data

    def close(self) -> None:
        if not self._content:
            return
        missions, kind = self._missions, self._kind
        try:
            items = unpacked_items(kind, bytes(self._content), missions.served(kind))
            refusal = missions.take_file(kind, items)
        except MissionFileError as error:
            refusal = str(error)
        if refusal:
            self._endpoint.text(Severity.WARNING, f"{self._name} not taken: {refusal}")
            raise FtpError(Nak.FAIL)

    def abandon(self) -> None:
        """A file that is not complete changes nothing."""


class SystemFolder(_ReadOnly):
    """What runs here, as text."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self._files: Mapping[str, Callable[[], str]] = {
            "memory.txt": self._memory,
            "tasks.txt": self._tasks,
            "threads.txt": self._threads,
            "uarts.txt": self._links,
            "version.txt": lambda: banner(endpoint.dialect) + "\n",
        }

    def entries(self) -> list[VirtualEntry]:
        return [VirtualEntry(name, len(text())) for name, text in self._files.items()]

    def open(self, name: str) -> OpenFile:
        text = self._files.get(name)
        if text is None:
            raise FileNotFoundError
        return Snapshot(text().encode("ascii", "replace"))

    def _memory(self) -> str:
        return f"MemInfoV1\nA constant: the process takes what it needs\nFREE={FREE_BYTES}\n"

    def _threads(self) -> str:
        return "ThreadsV2\nestimator and control  RATE=250\ncommander, navigator, MAVLink  RATE=50\n"

    def _tasks(self) -> str:
        load = 100.0 * self._endpoint.vehicle.state.load
        return f"TasksV2\nframe  RATE=50 LOAD={load:.1f}%\n"

    def _links(self) -> str:
        channels = self._endpoint.channels
        lines = [
            f"LINK{i} {channel.link.role.name} CLIENTS={len(channel.clients)}" for i, channel in enumerate(channels)
        ]
        return "\n".join(["UARTV1", *lines]) + "\n"


class LogFolder(_ReadOnly):
    """The flight logs, as they are: PX4's format. What is written to while it is read ends where it ended then."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint

    @property
    def _stored(self) -> StoredLogs:
        stored = self._endpoint.vehicle.host.logs
        if stored is None:
            raise FileNotFoundError
        return stored

    def entries(self) -> list[VirtualEntry]:
        if self._endpoint.vehicle.host.logs is None:
            return []
        logs = self._stored.logs()
        files = [VirtualEntry(log.name, log.size, log.time_s) for log in logs]
        return [*files, VirtualEntry(LAST_LOG, len(str(len(logs))) + 1)]

    def open(self, name: str) -> OpenFile:
        logs = self._stored.logs()
        if name == LAST_LOG:
            return Snapshot(f"{len(logs)}\n".encode("ascii"))
        log = next((log for log in logs if log.name == name), None)
        if log is None:
            raise FileNotFoundError
        return _LogReader(self._stored, log)


class _LogReader:
    """A log while it is read."""

    def __init__(self, stored: StoredLogs, log: LogFile) -> None:
        self.size = log.size
        self._read = partial(stored.read, log.name)

    def read(self, offset: int, count: int) -> bytes:
        return self._read(offset, max(min(count, self.size - offset), 0))

    def write(self, _: int, __: bytes, /) -> None:
        raise FtpError(Nak.FILE_PROTECTED)

    def close(self) -> None:
        """Nothing is kept."""

    abandon = close
