"""What has come in on one channel and waits for its turn: nobody gets more of a frame than their share.

In: pieces of bytes from a link. Out: frames, one at a time, until the share is used up; the rest waits here, and what
has not been read waits in the link, whose queue is bounded.
"""

from collections import deque

from autopilot.mavlink.transport.links import Link
from autopilot.mavlink.wire.codec import Frame, FrameReader

BYTES_MAX = 16_384  # of one channel in one frame
FALSE_STARTS_MAX = 64  # of one piece, whose rest is dropped
WASTE_PER_UNIT = 4  # a false start, or a piece with nothing in it, costs a quarter of a frame's work

# One unit of work is a frame read or sent: some 5 us.
WORK_MAX = 100  # of one channel in one frame
WORK_TOTAL = 256  # of all channels together, as long as each gets
WORK_MIN = 8


class Intake:
    """The frames of one link in order.

    Args:
        link: where they come from.
    """

    def __init__(self, link: Link) -> None:
        self._link = link
        self._reader = FrameReader(keeps_unknown=True, false_starts_max=FALSE_STARTS_MAX)
        self._pieces: deque[bytes] = deque()  # one reading of the link at most
        self._frames: deque[Frame] = deque()  # of one piece
        self._bytes_left = 0
        self.work = 0  # units, in this frame
        self._waste = 0

    def fill(self) -> bool:
        """Begins a frame; returns whether anything waits."""
        self.work = 0
        if not self._pieces:
            self._pieces.extend(self._link.receive())
            if not self._pieces:
                return bool(self._frames)
        self._bytes_left = BYTES_MAX
        return True

    def next(self, work_max: int) -> Frame | None:
        """The next frame; None if there is none, or this channel has had its share."""
        while self.work < work_max:
            if self._frames:
                self.work += 1
                return self._frames.popleft()
            if not self._pieces or self._bytes_left <= 0:
                return None
            piece = self._pieces.popleft()
            self._bytes_left -= len(piece)
            self._read(piece)
        return None

    def _read(self, piece: bytes) -> None:
        before = self._reader.false_start_count
        frames = self._reader.feed(piece, is_whole=self._link.keeps_datagrams)
        self._frames.extend(frames)
        self._waste += self._reader.false_start_count - before + (not frames)
        if self._waste >= WASTE_PER_UNIT:
            self.work += self._waste // WASTE_PER_UNIT
            self._waste %= WASTE_PER_UNIT


def fraction(busy_count: int) -> int:
    """Units of work each channel gets in this frame if so many have something to do."""
    return min(WORK_MAX, max(WORK_TOTAL // busy_count, WORK_MIN))
