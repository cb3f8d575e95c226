"""MAVLink 2 signatures: what goes out is signed, and what comes in must be by somebody who knows the key.

A signature is 13 bytes behind the checksum: link id, 48 bits of time in 10 us since 2015, and the first 48 bits of
SHA-256 over key, frame, link id and time. Time is wall time, given by the host as a callable, because the other end's
is; a flight in lockstep has its simulated date instead. A clock that must never go back is kept with the key.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from hashlib import sha256
from hmac import compare_digest
from pathlib import Path
from typing import Protocol

from autopilot.mavlink.transport.links import Link
from autopilot.mavlink.wire.codec import SIGNATURE_LENGTH, Frame, known_type
from common.files import write_durably

KEY_LENGTH = 32
EPOCH_UNIX_US = 1_420_070_400_000_000  # 2015-01-01 00:00 UTC
TICK_US = 10
MINUTE_TICKS = 6_000_000
RETRY_TICKS = MINUTE_TICKS // 6  # after which a state that could not be stored is tried again
STREAMS_MAX = 256  # (sysid, compid, link id) remembered against replays; no more are let in
TIMESTAMP_MAX = (1 << 48) - 1
TIMESTAMP_SANE_MAX = TIMESTAMP_MAX // 2  # the year 2059: a clock that starts later soon has nowhere to go

_SETUP_SIGNING_ID = known_type("SETUP_SIGNING").msg_id
_MAY_BE_UNSIGNED = {known_type(name).msg_id for name in ("RADIO_STATUS", "RADIO")}  # radios do not know the key


@dataclass(frozen=True, slots=True)
class SigningState:
    """What outlives a flight; an empty key: signing is off."""

    key: bytes = b""
    timestamp: int = 0  # [10 us] since 2015: nothing was sent or believed after it, or in the minute after it
    is_complete: bool = False  # it is the last one: nothing came after it at all


class SigningStore(Protocol):
    """Where the state is kept."""

    def load(self) -> SigningState: ...

    def save(self, state: SigningState) -> None: ...


class MemoryStore:
    """Keeps the state as long as the process lives."""

    def __init__(self, state: SigningState | None = None) -> None:
        self._state = state or SigningState()

    def load(self) -> SigningState:
        return self._state

    def save(self, state: SigningState) -> None:
        self._state = state


class FileStore:
    """Keeps the state in a file that its owner alone may read; it must lie where clients cannot get at files."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def load(self) -> SigningState:
        """What the file holds; nothing if there is none.

        Raises:
            ValueError: it holds something else.
        """
        if not self._path.exists():
            return SigningState()
        try:
            content = json.loads(self._path.read_text(encoding="utf-8"))
            is_complete = content.get("is_complete") is True
            state = SigningState(bytes.fromhex(content["key"]), int(content["timestamp"]), is_complete)
        except (AttributeError, ValueError, KeyError, TypeError, OverflowError, RecursionError) as error:
            raise ValueError(f"{self._path}: is no signing key") from error
        if len(state.key) not in (0, KEY_LENGTH) or not 0 <= state.timestamp <= TIMESTAMP_MAX:
            raise ValueError(f"{self._path}: is no signing key")
        return state

    def save(self, state: SigningState) -> None:
        content = {"key": state.key.hex(), "timestamp": state.timestamp, "is_complete": state.is_complete}
        write_durably(self._path, json.dumps(content).encode(), mode=0o600)


@dataclass(frozen=True, slots=True)
class SigningConfig:
    """What the host gives."""

    store: SigningStore
    unix_us: Callable[[], int]  # wall time
    is_required: bool = False  # unsigned frames are refused on this machine's own links too


class Judgement(Enum):
    """What becomes of a frame that has come in."""

    TAKEN = auto()
    UNSIGNED = auto()
    FORGED = auto()  # wrong key, seen before, or too old


class Signer:
    """The key, the clock, and who has been heard up to which time."""

    def __init__(self, config: SigningConfig) -> None:
        self._config = config
        self.on_trouble: Callable[[str], None] = lambda _: None  # hears when key or time cannot be stored
        state = config.store.load()
        self._key = state.key
        # Saved once a minute: what was sent after the last time must not be sent again, and what was heard until then
        # must not be believed again. Stations follow our clock, so they are ahead of it as soon as they hear us.
        margin = 0 if state.is_complete else MINUTE_TICKS
        self._timestamp = self._heard_before = state.timestamp + margin if state.key else 0
        self._save_at = self._timestamp
        self._streams: dict[tuple[int, int, int], int] = {}

    @property
    def has_key(self) -> bool:
        return bool(self._key)

    @property
    def is_watching(self) -> bool:
        """Whether frames that come in must be judged at all."""
        return self._config.is_required or self.has_key

    def set_up(self, key: bytes, timestamp: int) -> None:
        """Takes a new key; one of zeros turns signing off."""
        if key != self._key:
            self._streams.clear()
        self._key = b"" if not any(key) else key
        if timestamp <= TIMESTAMP_SANE_MAX:
            self._timestamp = max(self._timestamp, timestamp)
        self.save()

    def save(self, *, is_last: bool = False) -> None:
        """Stores key and time; `is_last`: nothing is sent or believed after it."""
        try:
            self._config.store.save(SigningState(self._key, self._timestamp, is_last))
            self._save_at = self._timestamp + MINUTE_TICKS
        except OSError as error:  # a full disk is no reason to fall from the sky
            self._save_at = self._timestamp + RETRY_TICKS
            self.on_trouble(f"Signing key and time not stored: {error.strerror}")

    def _save_if_due(self) -> None:
        if self._timestamp >= self._save_at:
            self.save()

    def signature(self, frame: bytes, link_id: int) -> bytes:
        """What goes behind a frame that announces a signature."""
        self._timestamp = min(max(self._now(), self._timestamp + 1), TIMESTAMP_MAX)
        self._save_if_due()
        tail = bytes([link_id]) + self._timestamp.to_bytes(6, "little")
        return tail + sha256(self._key + frame + tail).digest()[:6]

    def judge(self, frame: Frame, link: Link) -> Judgement:
        """Whether to take a frame that came in on `link`."""
        if frame.is_signed and self.has_key:
            return Judgement.TAKEN if self._is_genuine(frame) else Judgement.FORGED
        if link.is_internal or frame.kind.msg_id in _MAY_BE_UNSIGNED:
            return Judgement.TAKEN
        if self._config.is_required:
            is_first_key = frame.kind.msg_id == _SETUP_SIGNING_ID and not self.has_key and link.is_trusted
            return Judgement.TAKEN if is_first_key else Judgement.UNSIGNED
        return Judgement.TAKEN if link.is_trusted or not self.has_key else Judgement.UNSIGNED

    def _is_genuine(self, frame: Frame) -> bool:
        """Whether the signature is right and newer than all before; then the clock follows it."""
        raw = frame.raw
        tail = raw[-SIGNATURE_LENGTH:-6]
        if not compare_digest(sha256(self._key + raw[:-6]).digest()[:6], raw[-6:]):
            return False
        stream = (frame.sysid, frame.compid, tail[0])
        timestamp = int.from_bytes(tail[1:], "little")
        last = self._streams.get(stream)
        if last is None:
            is_old = timestamp + MINUTE_TICKS < max(self._timestamp, self._now()) or timestamp <= self._heard_before
            if is_old or len(self._streams) >= STREAMS_MAX:
                return False
        elif timestamp <= last:
            return False
        self._streams[stream] = timestamp
        self._timestamp = max(self._timestamp, timestamp)
        self._save_if_due()
        return True

    def _now(self) -> int:
        return (self._config.unix_us() - EPOCH_UNIX_US) // TICK_US
