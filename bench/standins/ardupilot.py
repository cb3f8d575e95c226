"""ArduPilot's SITL as its JSON interface shows it, written after libraries/SITL/SIM_JSON.cpp: strict where it is.

It sends its servos, waits for a state, asks again after a second, looks for keys by substring as `strstr` does and
reads numbers as `sscanf` does, adds up its clock in whole microseconds, and does not count a frame that it could not
read. As a program it flies nothing and answers at once: for rows of speed.
"""

import re
import socket
import sys
from collections.abc import Callable, Sequence
from struct import Struct
from typing import NamedTuple

MAGIC_16, MAGIC_32 = 18458, 29569
RESEND_S = 1.0
DT_MAX_S = 0.1
_NUMBER = rb"[ \t]*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"
_VECTOR = {n: re.compile(rb"\[" + rb",".join([_NUMBER] * n)) for n in (3, 4)}
_SCALAR = re.compile(_NUMBER)
# section, key, how many numbers; in the order of its table
_REQUIRED = ((b"", b"timestamp", 1), (b"imu", b"gyro", 3), (b"imu", b"accel_body", 3))
_REQUIRED_TOO = ((b"", b"position", 3), (b"", b"velocity", 3))
_EITHER = ((b"", b"attitude", 3), (b"", b"quaternion", 4))
_MAY_BE = (b"airspeed", b"rng_1")


class State(NamedTuple):
    """What it reads of an answer."""

    timestamp: float
    gyro: tuple[float, ...]
    accel_body: tuple[float, ...]
    position: tuple[float, ...]
    velocity: tuple[float, ...]
    quaternion: tuple[float, ...]
    airspeed: float | None
    """[m/s] true; None: it takes the speed over the ground."""
    rng_1: float | None


class Unreadable(ValueError):
    """It would print "Failed to find key", and not count the frame."""


def parse(datagram: bytes) -> State:
    """The state between the last two newlines."""
    end = datagram.rfind(b"\n")
    begin = datagram.rfind(b"\n", 0, end) if end > 0 else -1
    if begin < 0:
        raise Unreadable("no text between two newlines")
    text = datagram[begin + 1 : end]
    found = {key: _look_up(text, section, key, count) for section, key, count in _REQUIRED + _REQUIRED_TOO}
    for section, key, count in _EITHER:
        if key in text:
            found[key] = _look_up(text, section, key, count)
    if b"quaternion" not in found:
        raise Unreadable("quaternion")
    may_be = (_look_up(text, b"", key, 1)[0] if key in text else None for key in _MAY_BE)
    return State(
        found[b"timestamp"][0],
        found[b"gyro"],
        found[b"accel_body"],
        found[b"position"],
        found[b"velocity"],
        found[b"quaternion"],
        *may_be,
    )


def _look_up(text: bytes, section: bytes, key: bytes, count: int) -> tuple[float, ...]:
    start = text.find(section)
    at = text.find(key, start) if start >= 0 else -1
    if at < 0:
        raise Unreadable(key.decode())
    after = at + len(key) + 2  # `":`, and not a space more
    pattern = _SCALAR if count == 1 else _VECTOR[count]
    match = pattern.match(text, after)
    if match is None:
        raise Unreadable(key.decode())
    return tuple(float(number) for number in match.groups())


class ArduPilotStandIn:
    """One SITL.

    Args:
        port: of the physics.
        control: the pulses [us] of the next frame, from the state of the last; None: 1000 each.
        channel_count: 16 or 32.
        resend_s: after so much silence it asks again.
    """

    def __init__(
        self,
        port: int,
        control: Callable[[State | None], Sequence[int]] | None = None,
        channel_count: int = 16,
        resend_s: float = RESEND_S,
    ) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.settimeout(resend_s)
        self._physics = ("127.0.0.1", port)
        self._control = control or (lambda _: [1000] * channel_count)
        self._layout = Struct(f"<HHI{channel_count}H")
        self._magic = MAGIC_16 if channel_count == 16 else MAGIC_32
        self.frame_count = 0
        self.resent_count = 0
        self.unreadable_count = 0
        self.is_reset_seen = False
        self.time_us = 0  # its clock
        self.state: State | None = None

    def packet(self) -> bytes:
        pulses = list(self._control(self.state))
        pulses += [0] * ((16 if self._magic == MAGIC_16 else 32) - len(pulses))
        return self._layout.pack(self._magic, 1200, self.frame_count, *pulses)

    def send(self) -> None:
        """Asks, and does not wait."""
        self.socket.sendto(self.packet(), self._physics)

    def ask(self) -> bytes:
        """Asks, as often as it takes, and returns the answer."""
        self.send()
        while True:
            try:
                return self.socket.recv(65_535)
            except TimeoutError:
                self.resent_count += 1
                self.send()

    def frame(self) -> None:
        """One frame."""
        self.take(self.ask())

    def take(self, answer: bytes) -> None:
        """Reads an answer, and counts the frame if that could be read."""
        try:
            state = parse(answer)
        except Unreadable:
            self.unreadable_count += 1
            return
        last = 0.0 if self.state is None else self.state.timestamp
        dt = state.timestamp - last
        if dt < 0.0:
            self.is_reset_seen = True
            dt = 0.0
        if 0.0 < dt < DT_MAX_S:
            self.time_us += int(dt * 1e6)
        self.state = state
        self.frame_count += 1

    def close(self) -> None:
        self.socket.close()


def main(port: int, seconds: float) -> None:
    """Answers at once for some simulated seconds, then tells what it has counted."""
    sitl = ArduPilotStandIn(port)
    first = sitl.frame_count
    sitl.frame()
    step_us = round(sitl.state.timestamp * 1e6) if sitl.state is not None else 0
    while sitl.frame_count * step_us < seconds * 1e6:
        sitl.frame()
    faults = sitl.unreadable_count + sitl.resent_count + sitl.is_reset_seen
    print(f"faults={faults} exchanged_us={(sitl.frame_count - first) * step_us} clock_us={sitl.time_us}")


if __name__ == "__main__":
    main(int(sys.argv[1]), float(sys.argv[2]))
