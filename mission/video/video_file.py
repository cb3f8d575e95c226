"""Films: RGB images as an mp4 (H.264, yuv420p, what browsers play); PyAV is imported when one is begun."""

from contextlib import suppress
from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from common.files import part_path

_CODEC = "libx264"
# On a chase film of 960 x 540 this preset takes a quarter of the time of libx264's own, for files half as large again.
# The constant rate factor is a guess: lines of a drawing stay sharp.
_OPTIONS = {"preset": "superfast", "crf": "21"}


class VideoError(ValueError):
    """A film that cannot be written; the message is one sentence for the user."""


class Mp4:
    """A film that takes its name when it is complete."""

    def __init__(self, target: Path, image_s: float) -> None:
        """Checks what can be checked before the first image.

        Args:
            target: the file; an existing one is replaced at the end.
            image_s: how long each image is shown [s].

        Raises:
            VideoError: no such folder, or a PyAV without the encoder.
        """
        if not target.parent.is_dir():
            raise VideoError(f"{target}: the folder it would lie in does not exist")
        import av
        from av.codec.codec import UnknownCodecError

        try:
            av.Codec(_CODEC, "w")
        except UnknownCodecError:
            raise VideoError(f"{target}: the installed PyAV has no H.264 encoder ({_CODEC})") from None
        self._av: Any = av
        self._target = target
        self._rate = Fraction(1.0 / image_s).limit_denominator(1000)
        self._container: Any = None
        self._stream: Any = None

    def show(self, image: NDArray[np.uint8]) -> None:
        """Appends an RGB image, shape (height, width, 3); odd sizes lose their last row or column.

        Raises:
            VideoError: the disk is full, or the file cannot be written.
        """
        height, width = (size - size % 2 for size in image.shape[:2])
        frame = self._av.VideoFrame.from_ndarray(np.ascontiguousarray(image[:height, :width]), format="rgb24")
        try:
            if self._container is None:
                self._container = self._av.open(str(part_path(self._target)), "w", format="mp4")
                self._stream = self._container.add_stream(_CODEC, rate=self._rate, options=_OPTIONS)
                self._stream.width, self._stream.height, self._stream.pix_fmt = width, height, "yuv420p"
            self._container.mux(self._stream.encode(frame))
        except OSError as error:
            raise VideoError(f"{self._target}: cannot be written: {error.strerror}") from error

    def close(self) -> None:
        """Completes the file; without an image there is none.

        Raises:
            VideoError: the disk is full.
        """
        if self._container is None:
            return
        try:
            self._container.mux(self._stream.encode())
            self._container.close()
        except OSError as error:
            self._remove()
            raise VideoError(f"{self._target}: cannot be written: {error.strerror}") from error
        part_path(self._target).replace(self._target)

    def _remove(self) -> None:
        """Leaves nothing of a film that did not become complete."""
        with suppress(OSError):  # the disk is still full
            self._container.close()
        part_path(self._target).unlink(missing_ok=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.close()
        elif self._container is not None:
            self._remove()
