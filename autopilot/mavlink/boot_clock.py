"""The clock that clients see: it begins again when the flight controller restarts, while simulated time goes on.

In: payloads with simulated times, as they are sent. Out: the same with times since the last boot. One place for all
messages; before the first restart nothing is touched.
"""

from functools import cache
from struct import calcsize

from autopilot.mavlink.wire.codec import MessageType, field_positions

_FIELDS = {"time_boot_ms": 1000, "event_time_boot_ms": 1000, "time_usec": 1}  # [us] per unit
_NOT_OURS = frozenset({"PING"})  # carries the asker's time back


class BootClock:
    """Time since boot, of one vehicle."""

    __slots__ = ("boot_us",)

    def __init__(self) -> None:
        self.boot_us = 0  # simulated time of the last restart

    def shown_us(self, time_us: int) -> int:
        """A simulated time as clients see it; what was before the restart is 0."""
        return max(time_us - self.boot_us, 0)

    def shown(self, kind: MessageType, payload: bytes, now_us: int) -> bytes:
        """A payload with its times since boot; dates, and times that are not known, stay."""
        for at, size, unit_us in _time_fields(kind.name):
            value_us = int.from_bytes(payload[at : at + size], "little") * unit_us
            if 0 < value_us <= now_us:
                span_us = unit_us << 8 * size  # a field of 32 bits begins again after it
                value_us += (now_us - value_us) // span_us * span_us
                since = self.shown_us(value_us) % span_us // unit_us
                payload = payload[:at] + since.to_bytes(size, "little") + payload[at + size :]
        return payload


@cache
def _time_fields(name: str) -> tuple[tuple[int, int, int], ...]:
    """Where the times of a message are, their sizes [bytes] and units [us]."""
    if name in _NOT_OURS:
        return ()
    return tuple(
        (at, calcsize(f"<{code}"), _FIELDS[field])
        for field, (at, code) in field_positions(name).items()
        if field in _FIELDS
    )
