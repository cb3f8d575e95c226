"""A ULog read, whoever wrote it: damaged ones as far as they go, hostile ones refused instead of read for ever."""

from collections import Counter
from collections.abc import Sequence
from contextlib import redirect_stdout
from io import BytesIO, StringIO
from pathlib import Path
from struct import error as struct_error

from pyulog import ULog
from pyulog.exceptions import ULogException

_DAMAGE = (ULogException, struct_error, EOFError, ValueError, KeyError, IndexError, TypeError, OverflowError)
MAX_VISITS = 100  # of one place in the file, by seeking


class UlogDamage(ValueError):
    """A log that no reader can follow; the message is one sentence."""


class _AdvancingStream(BytesIO):
    """The bytes of a log; refuses to be read in circles, as pyulog would read some damaged headers for ever."""

    def __init__(self, content: bytes) -> None:
        super().__init__(content)
        self._visits: Counter[int] = Counter()

    def seek(self, offset: int, whence: int = 0, /) -> int:
        position = super().seek(offset, whence)
        self._visits[position] += 1
        if self._visits[position] > MAX_VISITS:
            raise EOFError  # not among the errors that pyulog swallows
        return position


def read_topics(path: Path, topics: Sequence[str]) -> ULog:
    """The log with these topics.

    Raises:
        OSError: it cannot be read.
        UlogDamage: it is none, or damaged so that it cannot be followed.
    """
    content = path.read_bytes()
    try:
        with redirect_stdout(StringIO()):  # pyulog prints what it finds damaged
            return ULog(_AdvancingStream(content), list(topics))
    except _DAMAGE as error:
        raise UlogDamage(f"{path}: damaged so that no ULog reader can follow it") from error
