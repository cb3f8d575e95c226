"""One recording: frames at a fixed rate of simulated time, into an MPEG-4 file."""

from concurrent.futures import Future
from contextlib import suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from autopilot.payload.camera.image_file import add_frame, video_writer
from autopilot.payload.camera.ports import RawFrame
from autopilot.payload.camera.storage import MediaFolder

RATE_HZ = 10.0
PERIOD_US = 100_000
# What completing the file takes beyond what can be seen of it: buffers not written yet, a frame, and the index.
ROOM_BYTES = 256 << 10
INDEX_BYTES_PER_FRAME = 16


class Recording:
    """A video being written.

    Args:
        media: where it is kept when it is complete.
        name: of the file.
        size: width and height.
        time_us: when it begins.
    """

    def __init__(self, media: MediaFolder, name: str, size: tuple[int, int], time_us: int) -> None:
        self.size = size
        self.start_us = time_us
        self.due_us = time_us
        self.name = name
        self._media = media
        self._last: NDArray[np.uint8] | None = None
        self._pending: Future[RawFrame] | None = None
        self._frames = 0
        self._part: Path | None = media.open_path(f"{Path(name).stem}.part.mp4")
        self._writer = None if self._part is None else video_writer(self._part, RATE_HZ, size)

    @property
    def is_open(self) -> bool:
        return self._writer is not None

    @property
    def wants_frame(self) -> bool:
        """The one before has been delivered; on a slow host it is shown twice instead."""
        return self._pending is None

    def expect(self, frame: "Future[RawFrame]") -> None:
        self._pending = frame

    def advance(self) -> None:
        """Writes the frame that is due."""
        self.due_us += PERIOD_US
        if self._pending is not None and self._pending.done():
            self._last = self._pending.result().rgb
            self._pending = None
        if self._last is not None:
            add_frame(self._writer, self._last)
            self._frames += 1
        if self._part is not None:
            with suppress(OSError):  # it has gone; said when it is completed
                self._media.growing_bytes = self._part.stat().st_size

    @property
    def has_room(self) -> bool:
        """Whether the storage takes another frame."""
        return self._media.free_bytes > ROOM_BYTES + INDEX_BYTES_PER_FRAME * self._frames

    def close(self) -> bool:
        """Completes the file; whether it is stored.

        A frame that has not been delivered is left out, so that nobody waits for it.
        """
        if self._pending is not None and self._pending.done():
            add_frame(self._writer, self._pending.result().rgb)
        self._pending = None
        if self._writer is not None and self._part is not None:
            self._writer.release()
            self._writer = None
            return self._media.keep(self._part, self.name)
        return False
