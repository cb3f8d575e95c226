"""What a pilot asks for by the sticks besides flying: to take over, to arm, to change the mode.

In: `state.sticks`, when a message came. Out: requests to the commander, as a client would make them.
"""

from typing import Protocol

from autopilot.commander.failsafe import STICKS_LOST
from autopilot.inputs.sticks import Sticks
from autopilot.interface.mode_spec import ModeTable
from autopilot.interface.vehicle_interface import Announcer
from autopilot.interface.vehicle_state import LandedState, Mode, Reply, Severity, VehicleState, Verdict
from common.params import Parameter, ParameterTable

_LOW_THROTTLE = -0.8  # of thrust modes, for arming (PX4)
_MIDDLE_THROTTLE = 0.2  # where the stick rests in the middle, for arming (PX4)
_CORNER = 0.9  # of the yaw stick, for the arming gesture
_CENTRE = 0.1  # of the other two
_SWITCH_POSITIONS = 6


class Authority(Protocol):
    """The commander, as the pilot sees it."""

    announcer: Announcer

    def arm(self, *, force: bool) -> Reply: ...

    def disarm(self, *, force: bool) -> Reply: ...

    def request_mode(self, mode: Mode) -> Reply: ...


class Pilot:
    """The pilot of one vehicle.

    Args:
        state: the vehicle as of this frame.
        params: COM_RC_*, COM_RCL_EXCEPT, COM_FLTMODE*, MAN_ARM_GESTURE.
        sticks: its sticks.
        modes: those that the vehicle has.
    """

    __slots__ = (
        "_arm_hold_us", "_corner", "_corner_since_us", "_count", "_count_armed", "_exceptions", "_has_gesture",
        "_is_done", "_is_missed", "_modes", "_override", "_params", "_speed_max", "_state", "_sticks",
        "_switch_channel", "_switch_position", "_switched",
    )  # fmt: skip

    def __init__(self, state: VehicleState, params: ParameterTable, sticks: Sticks, modes: ModeTable) -> None:
        self._state = state
        self._params = params
        self._sticks = sticks
        self._modes = modes
        self._switched = {spec.switch: spec.mode for spec in modes.values() if spec.switch is not None}
        self._count = 0  # of messages read
        self._count_armed = 0  # of messages heard before arming
        self._is_missed = False  # the loss of the sticks has been reported
        self._corner = 0  # the yaw stick with the throttle down: 1 right, -1 left
        self._is_done = False  # it has been acted on
        self._corner_since_us = 0
        self._switch_position = 0
        self._load()
        params.on_change(self._on_parameter)

    @property
    def is_heard(self) -> bool:
        return self._sticks.is_heard(self._state.time_us)

    def on_armed(self) -> None:
        """Sticks are missed only once they are heard while armed, or in a mode that is flown by them."""
        self._sticks.forget(self._state.time_us)
        self._count_armed = self._state.sticks.count
        self._is_missed = False

    def arming_reason(self, mode: Mode) -> str:
        """Why the sticks forbid arming in a mode; empty if they do not."""
        if not self._is_flown(mode) or not self.is_heard:
            return ""  # without sticks the mode itself is refused, or needs none
        throttle = self._state.sticks.throttle
        if self._modes[mode].rests_in_middle or self._sticks.rests_in_middle:
            return "throttle above the middle" if throttle > _MIDDLE_THROTTLE else ""
        return "throttle is not low" if throttle > _LOW_THROTTLE else ""

    def _is_flown(self, mode: Mode) -> bool:
        """Whether a mode follows the sticks."""
        return self._modes[mode].needs_sticks or (mode is Mode.HOLD and self._state.sticks.steer_hold)

    def failures(self) -> int:
        """STICKS_LOST, unless the mode in which they were lost is excepted; otherwise 0."""
        state = self._state
        sticks = state.sticks
        if not 0 < sticks.heard_until_us < state.time_us:
            self._is_missed = False
        elif not self._is_missed:
            is_heard_armed = sticks.count != self._count_armed or sticks.is_ardupilot  # its radio is always there
            is_expected = is_heard_armed or self._modes[state.mode].needs_sticks
            self._is_missed = is_expected and not self._modes[state.mode].exception & self._exceptions
        return STICKS_LOST if self._is_missed else 0

    def frame(self, commander: Authority) -> None:
        """Does what the last message asks for, once."""
        sticks = self._state.sticks
        if sticks.count == self._count:
            return
        self._count = sticks.count
        if self._switch_channel:
            self._read_switch(commander)
        if self._has_gesture and sticks.throttle < _LOW_THROTTLE:
            self._read_gesture(commander)
        else:
            self._corner = 0
        if sticks.speed > self._speed_max and self._sticks.takes_over and self._may_take_over():
            self._take_over(commander)

    def _take_over(self, commander: Authority) -> None:
        for mode in (Mode.POSITION, Mode.ALTITUDE):
            if commander.request_mode(mode).verdict is Verdict.ACCEPTED:
                commander.announcer.statustext(Severity.INFO, f"Pilot took over: mode {mode.name.capitalize()}")
                return

    def _may_take_over(self) -> bool:
        state = self._state
        return state.is_flying and bool(self._override & self._modes[state.mode].override)

    def _read_gesture(self, commander: Authority) -> None:
        """Arms and disarms by the yaw stick while the throttle is down."""
        state = self._state
        sticks = state.sticks
        corner = 0
        if abs(sticks.yaw) > _CORNER and abs(sticks.roll) < _CENTRE and abs(sticks.pitch) < _CENTRE:
            corner = 1 if sticks.yaw > 0.0 else -1
        if corner != self._corner:
            self._corner = corner
            self._corner_since_us = state.time_us
            self._is_done = False
        is_due = corner != 0 and not self._is_done and state.time_us - self._corner_since_us >= self._arm_hold_us
        if not is_due or state.landed_state is not LandedState.ON_GROUND:
            return
        self._is_done = True
        if corner == -1:
            _ask(commander, "Disarm", commander.disarm(force=False))
        elif state.is_armed or self._is_flown(state.mode):
            _ask(commander, "Arm", commander.arm(force=False))
        else:
            commander.announcer.statustext(Severity.WARNING, "Arm: not in a mode flown by sticks")

    def _read_switch(self, commander: Authority) -> None:
        """Changes the mode when the mode switch has come to another position that has one."""
        position = self._sticks.switch_position(self._switch_channel, _SWITCH_POSITIONS)
        if position in (0, self._switch_position):
            return
        self._switch_position = position
        mode = self._switched.get(int(self._params[f"COM_FLTMODE{position}"]))
        if mode is not None:
            _ask(commander, "Mode switch", commander.request_mode(mode))

    def _load(self) -> None:
        params = self._params
        self._override = int(params["COM_RC_OVERRIDE"])
        self._speed_max = 0.01 * float(params["COM_RC_STICK_OV"])
        self._exceptions = int(params["COM_RCL_EXCEPT"])
        self._has_gesture = bool(params["MAN_ARM_GESTURE"])
        self._arm_hold_us = int(params["COM_RC_ARM_HYST"]) * 1000
        self._switch_channel = int(params["RC_MAP_FLTMODE"])

    def _on_parameter(self, parameter: Parameter) -> None:
        if parameter.name.startswith(("COM_RC", "MAN_ARM", "RC_MAP")):
            self._load()


def _ask(commander: Authority, what: str, reply: Reply) -> None:
    """Tells the pilot why a request was refused."""
    if reply.verdict is not Verdict.ACCEPTED:
        commander.announcer.statustext(Severity.WARNING, f"{what}: {reply.reason}")
