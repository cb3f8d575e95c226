"""Telemetry log (.tlog): every MAVLink frame of a link behind its time, as ground stations record and replay them.

Each record is the time as a big-endian uint64 in microseconds since 1970, then the raw frame. The times are the
simulated epoch plus simulated time, so the same flight writes the same bytes.
"""

from struct import Struct

from common.clock import SIMULATED_EPOCH_US
from common.log_file import LogFile

_TIME = Struct(">Q")


class TlogWriter(LogFile):
    """Appends frames as they cross a link."""

    def frame(self, time_us: int, frame: bytes) -> None:
        """Records one raw frame, sent or received at simulated `time_us`."""
        if self.is_full:
            self.next_part()
        self.write(_TIME.pack(SIMULATED_EPOCH_US + time_us) + frame)
