"""One recording: frames at a fixed rate of simulated time, into an MPEG-4 file."""

from concurrent.futures import Future
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from autopilot.camera.picture import add_frame, video_writer
from autopilot.camera.ports import RawFrame
from autopilot.camera.storage import MediaFolder

RATE_HZ = 10.0
PERIOD_US = 100_000


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

    def close(self) -> None:
        """Completes the file; a frame that has not been delivered is left out, so that nobody waits for it."""
        if self._pending is not None and self._pending.done():
            add_frame(self._writer, self._pending.result().rgb)
        self._pending = None
        if self._writer is not None and self._part is not None:
            self._writer.release()
            self._writer = None
            self._media.keep(self._part, self.name)
