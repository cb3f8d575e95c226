"""Betaflight's SITL as its simulator link shows it, after src/platform/SIMULATOR/sitl.c of 4.6: strict where it is.

Its clock runs at the rate that the last two states gave it, it answers a state once, takes no state that is older than
the last or the first after half a second of silence, crashes by one that comes before its sensors are there, loses its
receiver for good by sticks that come too early, and arms at low throttle only. Its command line and MSP are at a TCP
port, one client at a time. As a program it flies by a plain law; it answers at once, for rows of speed.
"""

import socket
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from math import asin, atan2, isfinite, radians
from pathlib import Path
from struct import Struct, pack
from typing import NamedTuple

STATE, STICKS, MOTORS = Struct("<18d"), Struct("<d16H"), Struct("<Hxx16f")
GAP_S = 0.5  # of silence, after which a state only restarts its clock
DELTA_MAX_S = 0.02  # of stamps, from which on the rate stays
LEAST_RATE = 1e-3  # below it its clock stands
LOOP_S = 1e-3  # pid_process_denom 8 of 8 kHz
CALIBRATION_S = 1.25
SETTLES_LOOPS = 50  # until its receiver is there
RXLOSS, THROTTLE, CALIB, ARM_SWITCH = 1 << 2, 1 << 7, 1 << 12, 1 << 28
ANGLE_LIMIT_RAD, RATE_LIMIT_RAD_S = radians(60.0), radians(400.0)
NAMES = set(
    "pid_process_denom motor_idle min_check angle_limit angle_p_gain p_yaw f_yaw rates_type roll_expo pitch_expo "
    "yaw_expo roll_rc_rate pitch_rc_rate yaw_rc_rate roll_srate pitch_srate yaw_srate rc_smoothing throttle_boost "
    "pwr_on_arm_grace small_angle auto_disarm_delay runaway_takeoff_prevention failsafe_delay failsafe_procedure "
    "failsafe_throttle failsafe_throttle_low_delay failsafe_landing_time failsafe_recovery_delay".split()
)
EEPROM = "eeprom.bin"
PORTS = (9001, 9003, 9004, 5761)
"""Of motors, states, sticks, and its first UART."""


class State(NamedTuple):
    """What it knows of the vehicle."""

    stamp_s: float
    gyro_frd: tuple[float, ...]
    accel_turned: tuple[float, ...]
    wxyz: tuple[float, ...]
    pressure_pa: float


def parse(data: bytes) -> State | None:
    """A state: what is longer is cut, what is shorter is none."""
    if len(data) < STATE.size:
        return None
    n = STATE.unpack(data[: STATE.size])
    return State(n[0], n[1:4], n[4:7], n[7:11], n[17])


class ItsClock:
    """The clock of its program, which states set."""

    def __init__(self, now_s: float = 0.0) -> None:
        self.rate, self.time_s = 1.0, 0.0
        self._stamp_s, self._heard_s, self._before_s, self._looked_s = 0.0, now_s, now_s, now_s

    def look(self, now_s: float) -> float:
        """Its time [s]."""
        self.time_s += self.rate * (now_s - self._looked_s)
        self._looked_s = now_s
        return self.time_s

    def state(self, stamp_s: float, now_s: float) -> bool:
        """Whether a state is taken."""
        self.look(now_s)
        if now_s > self._heard_s + GAP_S:
            self._stamp_s, self._heard_s = stamp_s, now_s
            return False
        delta_s = stamp_s - self._stamp_s
        if delta_s < 0.0:
            return False
        if 0.0 < delta_s < DELTA_MAX_S and now_s > self._before_s:
            self.rate = delta_s / (now_s - self._before_s)
        self._stamp_s, self._heard_s, self._before_s = stamp_s, now_s, now_s
        return True


class Receiver:
    """Its sticks, and whether they arm it."""

    def __init__(self, is_set_up: bool = True) -> None:
        self.channels = (1500, 1500, 1000, 1500, *(1000,) * 4, *(1500,) * 8)
        self.flags = CALIB
        self.is_armed = False
        self.is_set_up = is_set_up
        self._is_refused = False

    def take(self, channels: Sequence[int], is_early: bool, time_s: float) -> None:
        if is_early:
            self.flags |= RXLOSS
        self.channels = tuple(channels)
        self.look(time_s)

    def look(self, time_s: float) -> None:
        """What its switches do."""
        is_on = self.is_set_up and 1700 <= self.channels[4] <= 2100
        if time_s >= CALIBRATION_S:
            self.flags &= ~CALIB
        is_low = self.channels[2] < 1050
        self.flags = self.flags & ~THROTTLE if is_low else self.flags | THROTTLE
        if not is_on:
            self.is_armed = self._is_refused = False
            self.flags &= ~ARM_SWITCH
        elif not self.is_armed:
            self._is_refused = self._is_refused or bool(self.flags & (RXLOSS | THROTTLE | CALIB))
            self.is_armed = not self._is_refused
            self.flags |= ARM_SWITCH if self._is_refused else 0


def law(state: State, channels: Sequence[int], idle: float) -> list[float]:
    """The commands [0..1] of rear right, front right, rear left and front left, in angle mode."""
    w, x, y, z = state.wxyz
    roll = atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = asin(min(max(2.0 * (w * y - z * x), -1.0), 1.0))
    roll_stick, pitch_stick, yaw_stick = ((channels[k] - 1500) / 500.0 for k in (0, 1, 3))
    p, q, r = state.gyro_frd
    right = 0.12 * (ANGLE_LIMIT_RAD * roll_stick - roll) - 0.03 * p
    up = 0.12 * (-ANGLE_LIMIT_RAD * pitch_stick - pitch) - 0.03 * q
    clockwise = 0.08 * (RATE_LIMIT_RAD_S * yaw_stick - r)
    if channels[2] < 1050:
        return [idle] * 4
    throttle = idle + (1.0 - idle) * (channels[2] - 1050) / 950.0
    mixed = (
        throttle - right - up - clockwise,
        throttle - right + up + clockwise,
        throttle + right - up + clockwise,
        throttle + right + up - clockwise,
    )
    return [min(max(value, idle), 1.0) for value in mixed]


class BetaflightStandIn:
    """One program.

    Args:
        motors_port: where its motors are sent to; may be set later.
        state_port: where it takes states; 0: any free one.
        sticks_port: where it takes sticks.
        msp_port: of its first UART.
        version: of its firmware.
        motor_count: of its mixer.
        is_set_up: its switches are known to it.
        settles_loops: until its receiver is there.
    """

    def __init__(
        self,
        motors_port: int = 0,
        state_port: int = 0,
        sticks_port: int = 0,
        msp_port: int = 0,
        *,
        version: tuple[int, int, int] = (4, 6, 0),
        motor_count: int = 4,
        is_set_up: bool = True,
        settles_loops: int = SETTLES_LOOPS,
    ) -> None:
        self.version, self.motor_count, self._settles_loops = version, motor_count, settles_loops
        self.state_socket, self.sticks_socket = _udp(state_port), _udp(sticks_port)
        self.motors_port, self.ports = (
            motors_port,
            (0, self.state_socket.getsockname()[1], self.sticks_socket.getsockname()[1]),
        )
        self._out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.clock = ItsClock(time.perf_counter())
        self.receiver = Receiver(is_set_up)
        self.state: State | None = None
        self.faults: list[str] = []
        self.loop_count = self.state_count = self.sticks_count = 0
        self.idle = 0.15
        self.command_line = CommandLine(self, msp_port)
        self.msp_port = self.command_line.port
        self.answer: Callable[[bytes], None] = self.send

    def send(self, data: bytes) -> None:
        self._out.sendto(data, ("127.0.0.1", self.motors_port))

    def step(self, wait_s: float = 1.0) -> bool:
        """Takes one state and answers it, if it is not one that stops its clock; False: none has come."""
        self.state_socket.settimeout(wait_s)
        try:
            data = self.state_socket.recv(65_535)
        except TimeoutError:
            return False
        now_s = time.perf_counter()
        self._take_sticks()
        state = parse(data)
        if state is None or not self.clock.state(state.stamp_s, now_s):
            return True
        self.state_count += 1
        self._check(state)
        self.state = state
        if self.clock.rate >= LEAST_RATE:  # its next loop comes, and to us at once
            self.clock.time_s += LOOP_S
            self.loop_count += 1
            self.receiver.look(self.clock.time_s)
            self.answer(self.motors())
        return True

    def run(self, loops: int) -> None:
        """So many loops, as long as there are states."""
        end = self.loop_count + loops
        while self.loop_count < end and self.step():
            pass

    def motors(self) -> bytes:
        pulses = [1000.0] * 16
        if self.receiver.is_armed and self.state is not None:
            commands = law(self.state, self.receiver.channels, self.idle)
            pulses[:4] = [1000.0 + 1000.0 * command for command in commands]
        return MOTORS.pack(self.motor_count, *pulses)

    def _take_sticks(self) -> None:
        while True:
            try:
                data = self.sticks_socket.recv(65_535, socket.MSG_DONTWAIT)
            except BlockingIOError:
                return
            if len(data) < STICKS.size:
                continue
            self.sticks_count += 1
            channels = STICKS.unpack(data[: STICKS.size])[1:]
            if any(not 750 <= pulse <= 2250 for pulse in channels):
                self.faults.append(f"no pulses: {channels}")
            self.receiver.take(channels, self.loop_count < self._settles_loops, self.clock.time_s)

    def _check(self, state: State) -> None:
        numbers = (*state.gyro_frd, *state.accel_turned, *state.wxyz, state.pressure_pa)
        if not all(map(isfinite, numbers)):
            self.faults.append("not a number")
        elif abs(sum(value * value for value in state.wxyz) - 1.0) > 1e-3:
            self.faults.append(f"no attitude: {state.wxyz}")

    def close(self) -> None:
        for each in (self.state_socket, self.sticks_socket, self._out):
            each.close()
        self.command_line.close()


class CommandLine:
    """MSP, and behind `#` its command line, for one client after the other.

    Args:
        owner: whose it is.
        port: 0: any free one.
    """

    def __init__(self, owner: BetaflightStandIn, port: int) -> None:
        self._owner = owner
        self._server = socket.create_server(("127.0.0.1", port))
        self._server.settimeout(0.05)
        self._is_closed = False
        self.port: int = self._server.getsockname()[1]
        self.lines: list[str] = []
        self.is_saved = threading.Event()
        self.is_mute = False
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _serve(self) -> None:
        while not self._is_closed:
            try:
                peer, _ = self._server.accept()
            except TimeoutError:
                continue
            with peer, suppress(OSError):
                peer.settimeout(5.0)
                self._talk(peer)
        self._server.close()

    def _talk(self, peer: socket.socket) -> None:
        received, is_open = b"", False
        while data := peer.recv(4096):
            received += data
            if self.is_mute:
                continue
            if not is_open and received.startswith(b"$M<") and len(received) >= 6:
                peer.sendall(self._answer(received[4]))
                received = b""
            elif not is_open and received[:1] == b"#":
                is_open, received = True, received[1:]
                peer.sendall(b"\r\nEntering CLI Mode, type 'exit' to reboot, or 'help'\r\n\r\n# ")
            while is_open and b"\n" in received:
                line, _, received = received.partition(b"\n")
                peer.sendall(self._said(line.decode()))

    def _answer(self, code: int) -> bytes:
        status = pack("<HHHIBHBBBBI", 125, 0, 33, 0, 0, 0, 3, 0, 0, 29, self._owner.receiver.flags) + bytes(4)
        payload = {2: b"BTFL", 3: bytes(part % 256 for part in self._owner.version), 150: status}.get(code)
        if payload is None:
            return b"$M!" + bytes((0, code, code))
        check = 0
        for byte in (len(payload), code, *payload):
            check ^= byte
        return b"$M>" + bytes((len(payload), code)) + payload + bytes((check,))

    def _said(self, line: str) -> bytes:
        self.lines.append(line)
        words = line.split()
        if words[:1] == ["save"]:
            self.is_saved.set()
            return b"save\r\n\r\n# saving\r\n\r\nRebooting"
        is_known = words[:1] in (["aux"], ["feature"], ["rxfail"]) or (words[:1] == ["set"] and words[1] in NAMES)
        told = f"{line}\r\n" + ("" if is_known else f"###ERROR IN {words[0]}: INVALID NAME: {words[1:2]}###\r\n")
        return f"{told}\r\n# ".encode()

    def close(self) -> None:
        self._is_closed = True
        self._thread.join(10.0)


def _udp(port: int) -> socket.socket:
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.bind(("127.0.0.1", port))
    return made


def program(loops: int | None) -> None:
    """As the original in its folder: until it is told to save, or killed; or for so many loops, once it is set up."""
    eeprom = Path(EEPROM)
    is_set_up = eeprom.exists()
    flown = BetaflightStandIn(*PORTS, is_set_up=is_set_up)
    while not flown.command_line.is_saved.is_set():
        flown.step(0.1)
        if is_set_up and loops is not None and flown.loop_count >= loops:
            sys.exit(3)
    eeprom.write_text("\n".join(flown.command_line.lines))
    for word in range(3):
        print(f"[FLASH_ProgramWord]{word:#x}")
    flown.close()


def measured(motors_port: int, state_port: int, sticks_port: int, msp_port: int, seconds: float) -> None:
    """Answers at once for some simulated seconds, then tells what it has counted."""
    flown = BetaflightStandIn(motors_port, state_port, sticks_port, msp_port)
    loops = round(1.05 * seconds / LOOP_S) + 4 * SETTLES_LOOPS  # it settles, and some states come twice
    while flown.loop_count < loops and flown.step(5.0):
        pass
    flown.close()
    exchanged_us = round(flown.loop_count * LOOP_S * 1e6)
    print(f"faults={len(flown.faults)} exchanged_us={exchanged_us} clock_us={exchanged_us}")


if __name__ == "__main__":
    if len(sys.argv) > 3:
        measured(*map(int, sys.argv[1:5]), float(sys.argv[5]))
    else:
        program(int(sys.argv[2]) if len(sys.argv) > 2 else None)
