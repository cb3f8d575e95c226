"""Where a flight goes for Foxglove: into `flight.mcap`, and to who is connected.

In: a flight that has not begun. Out: the same messages at each sink; each has channels of its own, because what a live
viewer hears begins when they come. Foxglove's package is imported here, only when it is asked for.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mission.flight_base import FlightBase
from mission.foxglove.flight_export import FlightExport
from mission.foxglove.mcap_file import FILE, McapFile


class FoxgloveOutputs:
    """The sinks of one flight.

    Args:
        has_file: `flight.mcap` is written.
    """

    def __init__(self, *, has_file: bool) -> None:
        self._has_file = has_file
        self._file: McapFile | None = None
        self._exports: list[FlightExport] = []

    def begin(self, flight: FlightBase, folder: Path, path_ned: Sequence[Any]) -> None:
        """Before the first frame.

        Args:
            flight: what is shown.
            folder: of the run.
            path_ned: [m] (n, 3) of its plan.
        """
        if self._has_file:
            self._file = McapFile(folder / FILE, flight.troubles.note)
            self._exports.append(FlightExport(flight, self._file.context, path_ned))

    def frame(self) -> None:
        """After each frame of the flight."""
        for export in self._exports:
            export.frame()

    def close(self) -> None:
        """Completes the file; again it does nothing."""
        if self._file is not None:
            self._file.close()
            self._file = None
        self._exports.clear()
