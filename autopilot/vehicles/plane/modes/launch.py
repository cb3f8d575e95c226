"""Launch detection: a plane that is held in the hand, or stands on a catapult, is thrown. PX4's FW_LAUN_*.

In: the accelerometer. Out: whether it was thrown: along its nose it felt more than FW_LAUN_AC_THLD for FW_LAUN_AC_T.
"""

from math import radians

from autopilot.interface.vehicle_state import Severity
from autopilot.navigator.context import NavContext

_ROLL_MAX_RAD, _PITCH_MAX_RAD = radians(35.0), radians(50.0)  # of a plane that can fly on from the hand; guess


class LaunchDetector:
    """Detects one throw."""

    __slots__ = ("_context", "_is_reported", "_since_us", "is_thrown")

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self.start()

    def start(self) -> None:
        """Waits for a throw, the next one."""
        self._since_us = 0  # when the acceleration began; 0: it is not felt
        self._is_reported = False
        self.is_thrown = False

    @property
    def is_used(self) -> bool:
        """Whether take-offs begin with a throw: FW_LAUN_DETCN_ON."""
        return self._context.number("FW_LAUN_DETCN_ON") != 0.0

    def frame(self) -> bool:
        """Takes a frame of the accelerometer; whether it was thrown."""
        context = self._context
        if self.is_thrown:
            return True
        if not self._is_reported:
            self._is_reported = True
            context.announcer.statustext(Severity.NOTICE, "Launch: waiting for the throw")
        state = context.state
        if not state.samples.imu.accel_frd[0] > context.number("FW_LAUN_AC_THLD"):
            self._since_us = 0
            return False
        if not self._since_us:
            self._since_us = state.time_us
        if state.time_us - self._since_us < 1e6 * context.number("FW_LAUN_AC_T"):
            return False
        if abs(state.roll_rad) > _ROLL_MAX_RAD or abs(state.pitch_rad) > _PITCH_MAX_RAD:
            context.announcer.statustext(Severity.WARNING, "Launch ignored: not held level")
            self.start()
            return False
        context.announcer.statustext(Severity.INFO, "Launch detected")
        self.is_thrown = True
        return True
