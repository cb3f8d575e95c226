"""The crash check: does the rover move when it drives? ArduPilot's, with its numbers, each frame while armed.

In: what the motors are told, and the estimate. Out: whether it is stuck, which the failsafe HG_RO_CRASH_ACT answers. A
pilot who drives by throttle is not judged: he sees what stands in the way. Tipping over is PX4's failure detector's
(FD_FAIL_R).
"""

from math import hypot

from autopilot.interface.mode_spec import ModeTable
from autopilot.interface.vehicle_state import VehicleState
from common.params import Parameter, ParameterTable

_SLOW_M_S = 0.08  # ArduPilot: CRASH_CHECK_VEL_MIN
_TURNING_RAD_S = 0.087  # 5 deg/s, as ArduPilot
_THROTTLE_MIN = 0.05  # ArduPilot: CRASH_CHECK_THROTTLE_MIN
_PATIENCE_US = 2_000_000  # ArduPilot: CRASH_CHECK_TRIGGER_SEC

STUCK_PARAMETERS = [
    Parameter("HG_RO_CRASH_ACT", 1, 0, 6, "",
              "it drives by itself and does not get on for 2 s: 0 warn, 1 hold, 2 return, 5 terminate, 6 disarm",
              "ours, after ArduPilot's FS_CRASH_CHECK, which is off by default"),
]  # fmt: skip


class StuckWatch:
    """Whether one rover gets on.

    Args:
        state: the vehicle as of this frame.
        params: HG_RO_CRASH_ACT.
        modes: which of them are driven by sticks.
        motors: outputs that drive it.
    """

    __slots__ = ("_modes", "_motors", "_moved_us", "_params", "_state")

    def __init__(self, state: VehicleState, params: ParameterTable, modes: ModeTable, motors: tuple[int, ...]) -> None:
        self._state = state
        self._params = params
        self._modes = modes
        self._motors = motors
        self._moved_us = 0

    def reset(self) -> None:
        """The vehicle has just been armed."""
        self._moved_us = self._state.time_us

    def has_failure(self) -> bool:
        """Of its motors nobody tells."""
        return False

    def is_stuck(self) -> bool:
        """Whether it has not got on for a while, as of this frame."""
        state = self._state
        command = state.actuators.command
        throttle = sum(command[motor] for motor in self._motors) / len(self._motors)  # not what turns it
        north, east, _ = state.estimate.vel_ned
        moves = hypot(north, east) > _SLOW_M_S or abs(state.estimate.omega_frd[2]) > _TURNING_RAD_S
        if abs(throttle) < _THROTTLE_MIN or moves or self._modes[state.mode].needs_sticks:
            self._moved_us = state.time_us
        return state.time_us - self._moved_us > _PATIENCE_US
