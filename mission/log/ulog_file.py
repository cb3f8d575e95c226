"""A ULog read, whoever wrote it: damaged ones as far as they go, hostile ones refused instead of read for ever."""

from collections import Counter
from collections.abc import Sequence
from contextlib import redirect_stdout
from io import BytesIO, StringIO
from pathlib import Path
from struct import Struct
from struct import error as struct_error

from pyulog import ULog
from pyulog.exceptions import ULogException

_DAMAGE = (ULogException, struct_error, EOFError, ValueError, KeyError, IndexError, TypeError, OverflowError)
MAGIC = b"ULog\x01\x12\x35"  # a version follows
MAX_VISITS = 100  # of one place in the file, by seeking
_HEAD_BYTES, _HEADER = 16, Struct("<HB")  # of the file; of a message: its size and kind
_KINDS = frozenset(b"BFIMPQARDLCSO")  # of messages
_FLAGS, _INCOMPATIBLE_AT, _DATA_APPENDED = ord("B"), 11, 1


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


def is_whole(path: Path) -> bool:
    """Whether a ULog ends with the end of a message, and has none before that no logger writes.

    What was cut off exactly between two messages is not noticed, nor is anything of logs to which data was appended,
    or of what is no ULog.

    Raises:
        OSError: it cannot be read.
    """
    content = path.read_bytes()
    if not content.startswith(MAGIC):
        return True
    at = _HEAD_BYTES
    while at + _HEADER.size <= len(content):
        size, kind = _HEADER.unpack_from(content, at)
        if kind not in _KINDS:
            return False
        flags_at = at + _INCOMPATIBLE_AT
        if kind == _FLAGS and flags_at < len(content) and content[flags_at] & _DATA_APPENDED:
            return True
        at += _HEADER.size + size
    return at == len(content)
