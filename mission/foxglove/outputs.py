"""Where a flight goes for Foxglove: into `flight.mcap`, and to who is connected.

In: a flight that has not begun. Out: the same messages at each sink; each has channels of its own, because what a live
viewer hears begins when they come. Foxglove's package is imported here, only when it is asked for.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mission.flight_base import FlightBase
from mission.foxglove.flight_export import FlightExport
from mission.foxglove.live_server import LiveServer
from mission.foxglove.mcap_file import FILE, McapFile


class FoxgloveOutputs:
    """The sinks of one flight.

    Args:
        has_file: `flight.mcap` is written.
        port: of loopback that Foxglove connects to; None: none.

    Raises:
        OSError: the port is in use.
    """

    def __init__(self, *, has_file: bool, port: int | None = None) -> None:
        self._has_file = has_file
        self._server = None if port is None else LiveServer(port, "Honeyguide")
        self._file: McapFile | None = None
        self._exports: list[FlightExport] = []

    @property
    def url(self) -> str:
        """What Foxglove connects to; empty: nothing."""
        return "" if self._server is None else self._server.url

    def begin(self, flight: FlightBase, folder: Path, path_ned: Sequence[Any], *, has_camera_thread: bool) -> None:
        """Before the first frame.

        Args:
            flight: what is shown.
            folder: of the run.
            path_ned: [m] (n, 3) of its plan.
            has_camera_thread: images are rendered while the flight goes on, which then has no time of its own for them.
        """
        contexts = []
        if self._has_file:
            self._file = McapFile(folder / FILE, flight.troubles.note)
            contexts.append(self._file.context)
        if self._server is not None:
            contexts.append(self._server.context)
        self._exports = [
            FlightExport(flight, context, path_ned, has_camera_thread=has_camera_thread) for context in contexts
        ]

    def frame(self) -> None:
        """After each frame of the flight."""
        if self._server is not None:
            for topic in self._server.newly_heard():
                self._exports[-1].heard(topic)
        for export in self._exports:
            export.frame()

    def close(self) -> None:
        """Completes the file and ends the connections; again it does nothing."""
        for export in self._exports:
            export.close()
        self._exports = []
        if self._file is not None:
            self._file.close()
            self._file = None
        if self._server is not None:
            self._server.close()
            self._server = None
