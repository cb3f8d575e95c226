"""Betaflight's SITL as a board: it stabilises and mixes, our own flight controller holds its sticks.

Each millisecond of motion it gets what our gyro has felt, and the attitude that our estimator believes, never the
truth; the millisecond after it is flown by the motor commands of its next control loop. Our flight controller runs each
tick, as ever, and what its cascade asks for becomes sticks. Betaflight itself has no lockstep: its clock is stopped
between its answer and the next state, by the stamps of states (`PeerClock`), so that it takes one loop for each state.
"""

import socket
from collections.abc import Sequence
from struct import Struct
from typing import Any

import warp as wp

from common.airframes.multirotor import MultirotorAirframe
from common.clock import wall_sleep_s, wall_time_s
from common.kernels import SUBSTEPS, TICK_US, vec8
from sim.boards import betaflight_msp as msp
from sim.boards.betaflight_sticks import AT_REST_US, Sticks
from sim.boards.betaflight_wire import MOTOR_COUNT, PeerClock, motor_commands, state_packet, sticks_packet
from sim.boards.fast_imu import FastImu
from sim.boards.live_rows import LiveRows
from sim.boards.outside import POLL_S, OnWait, PeerError
from sim.boards.own import OwnBoard
from sim.rig import Rig

MOTORS_PORT, STATE_PORT, STICKS_PORT = 9001, 9003, 9004
SETTLE_ANSWERS = 100  # before the first sticks: those that come before its receiver is made are its last
ANSWER_S = 0.004  # of wall clock time; then the state is sent again
SILENT_S = 0.5  # without an answer it may have gone; a state that comes while it starts would end it
WAITING_PACE_S = 1e-3  # between states while it settles
ARMS_US = 2_000_000  # of simulated time, in which it arms
STOPS_US = 100_000  # for which armed motors that have turned stand
RUNNING, STOPPED = 1.0, 0.0  # rates of its clock
_WAIT = Struct("ll").pack(0, round(ANSWER_S * 1e6))  # as of struct timeval
_READ_MAX = 256


class BetaflightBoard:
    """See sim/boards/board.py.

    Args:
        rig: of one vehicle with four motors in X, on the CPU, whose body and flight controller are ours.
        airframe: of the vehicle.
        on_wait: what is done while it is silent.
        ports: where it sends its motors, and where it expects states and sticks; 0 for the first: any free one.
        msp_port: where it answers questions.
        address: of this machine.

    Raises:
        PeerError: the port is taken.
        ValueError: it does not fly such a vehicle.
    """

    is_fast = True

    def __init__(
        self,
        rig: Rig,
        airframe: MultirotorAirframe,
        *,
        on_wait: OnWait,
        ports: tuple[int, int, int] = (MOTORS_PORT, STATE_PORT, STICKS_PORT),
        msp_port: int = msp.PORT,
        address: str = "127.0.0.1",
    ) -> None:
        if rig.vehicle_count != 1:
            raise ValueError("Betaflight flies one vehicle")
        if len(airframe.rotors) != MOTOR_COUNT:
            raise ValueError(f"Betaflight flies {MOTOR_COUNT} motors in X here; {airframe.name} has others")
        self.restart_count = self.exchange_count = self.again_count = self.extra_count = 0
        self.rubbish_count = self.foreign_count = 0
        self._on_wait, self._address, self._msp_port = on_wait, address, msp_port
        self._state_at, self._sticks_at = (address, ports[1]), (address, ports[2])
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind((address, ports[0]))
        except OSError as error:
            self._socket.close()
            raise PeerError(f"UDP port {ports[0]} for Betaflight is in use ({error.strerror})") from error
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, _WAIT)
        self.local_port: int = self._socket.getsockname()[1]
        self.ports = (self.local_port, *ports[1:], msp_port)
        """Of motors, states, sticks, and questions."""
        self.is_ours = False
        """Its program has been started, asked and is watched by who made the board: it is not another one suddenly."""
        self._own, self._imu, self._sticks = OwnBoard(rig), FastImu(rig), Sticks(airframe)
        self._own_commands = wp.zeros(1, dtype=vec8)  # what our own cascade would do: not flown
        autopilot = rig.arrays.autopilot
        self._setpoint, self._control = autopilot.setpoint.numpy()[0], autopilot.control.numpy()[0]  # live
        self._estimate = autopilot.ekf.rows.numpy()[0]["estimate"]
        self._clock = PeerClock()
        self._sample_rows, self._command_rows = LiveRows(), LiveRows()
        self._sender: Any = None
        self._is_to_disarm = False  # it has started while our flight controller was armed
        self._unarmed_us = 0  # for how long it has been asked to arm in vain
        self._is_turning = False  # its motors have turned since it was asked to arm
        self._substep = 0
        self._attitude: list[float] = [0.0, 0.0, 0.0, 1.0]
        self._pressure_pa = 0.0
        self._commands = [0.0] * MOTOR_COUNT

    @property
    def is_there(self) -> bool:
        """It has been heard."""
        return self._sender is not None

    def boot(self, is_chosen: Any) -> None:
        """It is powered by whoever starts it; our flight controller's rows the rig has powered on."""

    def give(self, samples: Any, truth: Any) -> None:
        if self._substep == 0:
            self._own.give(samples, truth)
            self._own.take(self._own_commands)
        self._imu.read()
        if self._sender is None:
            self._await()
        if self._substep == 0:
            self._move_sticks(self._sample_rows.of(samples)[0])
        self._substep = (self._substep + 1) % SUBSTEPS
        self._drain()
        self._send_state(RUNNING)

    def take(self, commands: Any) -> None:
        self._hear()
        self.exchange_count += 1
        self._command_rows.of(commands)[0][:MOTOR_COUNT] = self._commands
        self._control["actuators"]["command"][:MOTOR_COUNT] = self._commands  # who reads what was flown reads it there

    def _move_sticks(self, samples: Any) -> None:
        """What changes each tick: sticks, attitude, pressure."""
        if self._estimate["q_ned_from_frd"].any():
            self._attitude = self._estimate["q_ned_from_frd"].tolist()
        self._pressure_pa = float(samples["baro"]["pressure_pa"])
        is_armed = bool(self._setpoint["is_armed"])
        self._is_to_disarm = self._is_to_disarm and is_armed
        channels_us: Sequence[int] = AT_REST_US
        if not self._is_to_disarm:
            self._check_armed(is_armed)
            has_to_wait = not any(self._commands)  # it arms at low throttle only
            channels_us = self._sticks.channels_us(self._setpoint, self._control, self._attitude, is_low=has_to_wait)
        self._send(self._sticks_at, sticks_packet(wall_time_s(), channels_us))

    def _check_armed(self, is_armed: bool) -> None:
        """Ends the flight if it does not arm, or has disarmed by itself."""
        is_turning = any(self._commands)
        if is_turning or not is_armed:
            self._is_turning, self._unarmed_us = is_turning and is_armed, 0
            return
        self._unarmed_us += TICK_US
        if self._unarmed_us < (STOPS_US if self._is_turning else ARMS_US):
            return
        self._send_state(RUNNING)
        answers = msp.ask(msp.STATUS_EX, address=self._address, port=self._msp_port)
        reasons = msp.arming_reasons(answers[0]) if answers else []
        reported = " ".join(reasons) or "it gives no reason"
        what = "has disarmed by itself" if self._is_turning else "does not arm"
        raise PeerError(f"Betaflight {what} ({reported})")

    def _hear(self) -> None:
        """The loop that answers a state."""
        begun_s = looked_s = wall_time_s()
        while not self._is_answered(wall_time_s() - begun_s):
            now_s = wall_time_s()
            if now_s - looked_s >= POLL_S:
                looked_s = now_s
                self._on_wait(now_s - begun_s)
            if now_s - begun_s < SILENT_S or self._is_reached():
                self.again_count += 1
                self._send_state(RUNNING)
        if self._sender is None:
            self._await()
        self._send_state(STOPPED)

    def _is_answered(self, silent_s: float) -> bool:
        """Takes one datagram, if one comes in time; whether it is the answer, or of one who has just started."""
        received = self._receive()
        if received is None:
            return False
        commands, sender = received
        if sender == self._sender:
            self._commands = commands
            return True
        if silent_s < SILENT_S:
            self.foreign_count += 1
            return False
        self.restart_count += 1
        self._sender, self._is_to_disarm = None, bool(self._setpoint["is_armed"])
        return True

    def _drain(self) -> None:
        """Forgets what has come twice, or too late."""
        while self._receive(socket.MSG_DONTWAIT) is not None:
            self.extra_count += 1

    def _await(self) -> None:
        """Waits until it is there, and has settled."""
        begun_s = heard_s = looked_s = wall_time_s()
        count, is_reached, sender = 0, False, None
        while count < SETTLE_ANSWERS:
            now_s = wall_time_s()
            if now_s - looked_s >= POLL_S:
                looked_s = now_s
                self._on_wait(now_s - begun_s)
            if not is_reached:
                is_reached, heard_s = self._is_reached(), wall_time_s()
                wall_sleep_s(WAITING_PACE_S if is_reached else POLL_S)
                continue
            self._send_state(RUNNING)
            received = self._receive()
            if received is not None:
                begun_s = heard_s = now_s
                count, sender = count + 1, received[1]
                wall_sleep_s(WAITING_PACE_S)
            is_reached = now_s - heard_s < SILENT_S
        self._sender, self._commands = sender, [0.0] * MOTOR_COUNT
        self._unarmed_us, self._is_turning = 0, False

    def _is_reached(self) -> bool:
        """Whether states may be sent: one that comes while it starts would end it."""
        return self.is_ours or msp.is_reached(self._address, self._msp_port)

    def _send_state(self, rate: float) -> None:
        felt = self._imu.samples[0]
        gyro, accel = felt["gyro_frd"].tolist(), felt["accel_frd"].tolist()
        stamp_s = self._clock.stamp_s(rate, wall_time_s())
        self._send(self._state_at, state_packet(stamp_s, gyro, accel, self._attitude, self._pressure_pa))

    def _send(self, at: tuple[str, int], data: bytes) -> None:
        try:
            self._socket.sendto(data, at)
        except OSError:  # it is gone; it says so by its silence
            return

    def _receive(self, flags: int = 0) -> tuple[list[float], Any] | None:
        """The next motor commands and who sent them; None: nothing in time, or rubbish."""
        try:
            data, sender = self._socket.recvfrom(_READ_MAX, flags)
        except (BlockingIOError, ConnectionError):
            return None
        commands = motor_commands(data)
        self.rubbish_count += commands is None
        return None if commands is None else (commands, sender)

    def close(self) -> None:
        self._control["actuators"]["command"][:MOTOR_COUNT] = 0.0  # nobody turns them any more
        self._socket.close()
