"""File transfer in small pieces: what requests cost, checksums over several frames, listings that are kept.

The costs are counted, not measured, so that a flight in lockstep is the same each time. One unit is about 1 us.
"""

import zlib
from collections import Counter, OrderedDict, deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from autopilot.mavlink.channel import Channel, Sender
from autopilot.mavlink.services.files.ftp_files import FtpError, OpenFile

WORK_PER_FRAME = 2_000  # what is beyond is paid back in the next frames
REQUEST_WORK = 100
QUEUE_MAX = 64  # requests that wait for their turn,
QUEUE_MAX_PER_CHANNEL = 8  # what is beyond is dropped, and the client asks again
CHECKSUMS_MAX = 8
CHECKSUM_BYTES = 1 << 19  # of one piece,
CHECKSUM_WORK = 500  # and what it costs
LISTINGS_KEPT_MAX = 8
LISTING_KEPT_US = 30_000_000

Done = Callable[[int], None]
Failed = Callable[[FtpError | OSError], None]


class Budget:
    """The work of one frame, and the requests that wait because it is used up."""

    def __init__(self) -> None:
        self._left = WORK_PER_FRAME
        self._waiting: deque[tuple[Sender, bytes]] = deque()
        self._own: Counter[Channel] = Counter()  # of those that wait

    @property
    def has_waiting(self) -> bool:
        return bool(self._waiting)

    @property
    def is_left(self) -> bool:
        return self._left > 0

    def charge(self, work: int) -> None:
        self._left -= work

    def renew(self) -> None:
        """Another frame begins."""
        self._left = min(self._left + WORK_PER_FRAME, WORK_PER_FRAME)

    def wait(self, sender: Sender, raw: bytes) -> None:
        """Keeps a request for later, if there is room and it is not there already."""
        if len(self._waiting) >= QUEUE_MAX or self._own[sender.channel] >= QUEUE_MAX_PER_CHANNEL:
            return
        if (sender, raw) not in self._waiting:
            self._waiting.append((sender, raw))
            self._own[sender.channel] += 1

    def take(self) -> tuple[Sender, bytes]:
        """The request that has waited longest."""
        sender, raw = self._waiting.popleft()
        self._own[sender.channel] -= 1
        if not self._own[sender.channel]:
            del self._own[sender.channel]
        return sender, raw


@dataclass(slots=True)
class _Checksum:
    raw: bytes  # the request
    file: OpenFile
    done: Done
    failed: Failed
    value: int = 0xFFFFFFFF
    offset: int = 0


class Checksums:
    """Those under way; one per client, who asks for another when it has given up the first."""

    def __init__(self) -> None:
        self._jobs: OrderedDict[Sender, _Checksum] = OrderedDict()

    def has(self, sender: Sender, raw: bytes) -> bool:
        job = self._jobs.get(sender)
        return job is not None and job.raw == raw

    def begin(self, sender: Sender, raw: bytes, file: OpenFile, done: Done, failed: Failed) -> None:
        """CRC32 without the inversions at both ends, as PX4 and MAVSDK compute it."""
        self._jobs.pop(sender, None)
        self._jobs[sender] = _Checksum(raw, file, done, failed)
        if len(self._jobs) > CHECKSUMS_MAX:
            self._jobs.popitem(last=False)

    def go_on(self, budget: Budget) -> None:
        """Reads on, one file after the other, until the frame's work is done."""
        while self._jobs and budget.is_left:
            sender, job = self._jobs.popitem(last=False)
            if not sender.channel.is_open:
                continue
            budget.charge(CHECKSUM_WORK)
            try:
                data = job.file.read(job.offset, CHECKSUM_BYTES)
            except (FtpError, OSError) as error:
                job.failed(error)
                continue
            if not data:
                job.done(job.value ^ 0xFFFFFFFF)
                continue
            job.value = zlib.crc32(data, job.value)
            job.offset += len(data)
            self._jobs[sender] = job


@dataclass(slots=True)
class _Listing:
    entries: Sequence[bytes]
    used_us: int


class Listings:
    """Folders as they were when a client began to read them."""

    def __init__(self) -> None:
        self._kept: OrderedDict[tuple[Channel, int, bytes], _Listing] = OrderedDict()

    def get(self, sender: Sender, opcode: int, name: bytes, now_us: int) -> Sequence[bytes] | None:
        listing = self._kept.get((sender.channel, opcode, name))
        if listing is None or now_us - listing.used_us > LISTING_KEPT_US:
            return None
        listing.used_us = now_us
        return listing.entries

    def keep(self, sender: Sender, opcode: int, name: bytes, now_us: int, entries: Sequence[bytes]) -> None:
        self._kept.pop((sender.channel, opcode, name), None)
        self._kept[sender.channel, opcode, name] = _Listing(entries, now_us)
        if len(self._kept) > LISTINGS_KEPT_MAX:
            self._kept.popitem(last=False)
