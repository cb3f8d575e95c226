"""The motor watch: does every rotor turn as fast as its command asks for? Ten times a second, off the ground.

In: motor commands, and the speeds that the ESCs report. Out: which motors have failed; the control allocation may be
told to do without them (CA_FAILURE_MODE). A failed motor is kept at idle, so that one that works again is noticed.
"""

from collections.abc import Callable, Sequence
from math import sqrt

from autopilot.interface.vehicle_interface import Announcer
from autopilot.interface.vehicle_state import LandedState, Severity, VehicleState
from common.airframes.multirotor import MultirotorAirframe
from common.params import Parameter, ParameterTable

_PERIOD_US = 100_000
_SLOW_FRACTION = 0.5  # of the speed asked for, below which a motor has failed; a weak one still flies; guess
_BACK_US = 500_000  # for which a failed motor must turn as asked before it is used again; guess
_ROTORS_SPARE = 5  # with fewer, nothing can be left out
_VOLTAGE_FRACTION_MIN = 0.6

ReadSpeeds = Callable[[], Sequence[float]]  # [rad/s] of each rotor, as its ESC reports it
LeaveOut = Callable[[Sequence[int]], None]  # tells the control allocation which rotors not to use, from 0


_PX4 = "PX4 1.15 default"

MOTOR_WATCH_PARAMETERS: list[Parameter] = [
    Parameter("FD_ACT_EN", 1, 0, 1, "", "1: motors are watched by the speed their ESCs report", _PX4),
    Parameter("FD_ACT_MOT_THR", 0.2, 0.0, 1.0, "norm", "motor command from which a motor is judged", _PX4),
    Parameter("FD_ACT_MOT_TOUT", 100, 10, 10_000, "ms", "time for which a motor must be too slow", _PX4),
    Parameter("CA_FAILURE_MODE", 1, 0, 1, "",
              "1: the control allocation does without a failed motor, if six or more motors leave enough",
              "PX4's numbers; its default is 0"),
]  # fmt: skip


class MotorWatch:
    """The motors of one vehicle.

    Args:
        state: the vehicle as of this frame.
        params: FD_ACT_*, CA_FAILURE_MODE.
        announcer: where texts go.
        airframe: how fast a rotor turns at which command.
        read_speeds: ESC telemetry; None: there is none, and no motor is judged.
        leave_out: the control allocation; None: it cannot be told.
    """

    __slots__ = (
        "_airframe",
        "_announcer",
        "_commands",
        "_is_enabled",
        "_least_command",
        "_leave_out",
        "_next_us",
        "_params",
        "_patience_us",
        "_read_speeds",
        "_since_us",
        "_state",
        "failed",
    )  # fmt: skip

    def __init__(
        self,
        state: VehicleState,
        params: ParameterTable,
        announcer: Announcer,
        airframe: MultirotorAirframe,
        read_speeds: ReadSpeeds | None,
        leave_out: LeaveOut | None,
    ) -> None:
        self._state = state
        self._params = params
        self._announcer = announcer
        self._airframe = airframe
        self._read_speeds = read_speeds
        self._leave_out = leave_out
        self._next_us = 0
        self._commands: Sequence[float] = (0.0,) * len(airframe.rotors)  # at the last look
        self.failed: tuple[int, ...] = ()  # rotors, from 0
        self._since_us = [0] * len(airframe.rotors)  # when each was last as it should be (failed: as it should not be)
        self._load()
        params.on_change(self._on_parameter)

    def reset(self) -> None:
        """The vehicle has just been armed."""
        self._change(())
        self._since_us = [self._state.time_us] * len(self._since_us)

    def has_failure(self) -> bool:
        """Whether a motor has failed, as of this frame."""
        state = self._state
        if self._read_speeds is not None and self._is_enabled and state.time_us >= self._next_us:
            self._next_us = state.time_us + _PERIOD_US
            if state.landed_state is not LandedState.ON_GROUND:
                self._judge(self._read_speeds())
        return bool(self.failed)

    def is_stuck(self) -> bool:
        """Nothing holds it in the air."""
        return False

    def _judge(self, speeds: Sequence[float]) -> None:
        now_us = self._state.time_us
        # A rotor that is still on its way to a new command is not slow
        commands = [min(pair) for pair in zip(self._state.actuators.command, self._commands, strict=False)]
        self._commands = self._state.actuators.command
        top = self._top_speed()
        failed = set(self.failed)
        for rotor in range(len(self._since_us)):
            command = commands[rotor]
            is_slow = speeds[rotor] < _SLOW_FRACTION * self._speed_fraction(command) * top
            has_failed = rotor in self.failed
            if is_slow == has_failed or (not has_failed and command < self._least_command):
                self._since_us[rotor] = now_us
            elif now_us - self._since_us[rotor] > (_BACK_US if has_failed else self._patience_us):
                failed ^= {rotor}
                how = ("works again", Severity.NOTICE) if has_failed else ("has failed", Severity.EMERGENCY)
                self._announcer.statustext(how[1], f"Motor {rotor + 1} {how[0]}")
        self._change(tuple(sorted(failed)))

    def _change(self, failed: tuple[int, ...]) -> None:
        if failed == self.failed:
            return
        self.failed = failed
        if self._leave_out is not None and len(self._since_us) - len(failed) >= _ROTORS_SPARE - 1:
            if len(self._since_us) >= _ROTORS_SPARE and int(self._params["CA_FAILURE_MODE"]):
                self._leave_out(failed)

    def _speed_fraction(self, command: float) -> float:
        curve = self._airframe.rotor_model.command_curve
        return curve * command + (1.0 - curve) * sqrt(max(command, 0.0))

    def _top_speed(self) -> float:
        """[rad/s] at full command and the present voltage."""
        battery = self._airframe.battery
        fraction = self._state.samples.battery.voltage_v / (battery.cells * battery.full_cell_v)
        return self._airframe.rotor_model.max_speed_rad_s * min(max(float(fraction), _VOLTAGE_FRACTION_MIN), 1.0)

    def _load(self) -> None:
        self._is_enabled = bool(self._params["FD_ACT_EN"])
        self._least_command = float(self._params["FD_ACT_MOT_THR"])
        self._patience_us = int(self._params["FD_ACT_MOT_TOUT"]) * 1000

    def _on_parameter(self, parameter: Parameter) -> None:
        if parameter.name.startswith("FD_ACT_"):
            self._load()
