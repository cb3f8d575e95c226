"""What the machine around the flight controller provides: files, logs, and a memory that outlives a restart.

The flight controller knows these forms only; whoever builds it (mission.flight) fills them in. Each may be missing.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from autopilot.interface.vehicle_state import Severity
from autopilot.payload.camera.ports import FrameSource, ImageServer, VideoStream
from autopilot.payload.camera.storage import MediaFolder
from common.clock import SIMULATED_EPOCH_US
from common.folder import ConfinedFolder

LogListener = Callable[[bytes], None]


@dataclass(frozen=True, slots=True)
class LogFile:
    """A flight log that can be downloaded."""

    name: str
    size: int  # [bytes], grows while it is being written
    time_s: int  # Unix time of its beginning


class StoredLogs(Protocol):
    """The logs of this flight and of earlier ones."""

    def logs(self) -> Sequence[LogFile]:
        """The oldest first; new ones come at the end."""
        ...

    def read(self, name: str, offset: int, count: int) -> bytes:
        """Bytes of a log; fewer at its end, none if it is gone."""
        ...

    def erase(self) -> int:
        """Removes all logs but the one being written; returns how many."""
        ...


class LogStream(Protocol):
    """The log of the running flight as it comes about."""

    def listen(self, listener: LogListener) -> bytes:
        """The log's header and definitions; from now on `listener` gets whole data records."""
        ...

    def stop_listening(self, listener: LogListener) -> None: ...

    def statustext(self, severity: Severity, text: str) -> None:
        """Logs a text."""
        ...

    def topics(self) -> Sequence[str]:
        """Names of what is logged."""
        ...

    def latest(self, topic: str) -> Mapping[str, Any] | None:
        """The last row of a topic by field; None if there is none yet.

        Raises:
            KeyError: no such topic.
        """
        ...


class Storage(Protocol):
    """Records that outlive a restart. A record is a JSON object."""

    def read(self, record: str) -> dict[str, Any]:
        """The record with all changes noted; empty if there is none, or none that can be read."""
        ...

    def note(self, record: str, changes: Mapping[str, Any]) -> None:
        """Adds or replaces keys; kept from the moment this returns, even if the process is killed then."""
        ...

    def write(self, record: str, content: Mapping[str, Any]) -> None:
        """Replaces the record as a whole; kept from the moment this returns, even if power is lost then."""
        ...


@dataclass(slots=True)
class Host:
    """All of it."""

    files: ConfinedFolder | None = None
    logs: StoredLogs | None = None
    log_stream: LogStream | None = None
    storage: Storage | None = None
    frames: FrameSource | None = None  # None: the vehicle carries no camera
    media: MediaFolder | None = None  # None: there is no card in the camera
    stream: ImageServer | None = None  # the camera's image and its files over HTTP
    video: VideoStream | None = None  # for ground stations
    read_truth: Callable[[], Any] | None = None  # a simulator's body state: for telemetry, never for the controller
    boot_unix_us: int = SIMULATED_EPOCH_US  # the date of power-on

    @property
    def live_stream(self) -> VideoStream | None:
        """What stations are told of, and may start and stop."""
        return self.video or self.stream
