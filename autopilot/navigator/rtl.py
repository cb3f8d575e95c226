"""Return: climb, fly home, descend, wait, land."""

from enum import IntEnum
from math import hypot

from autopilot.navigator.context import NavContext
from autopilot.navigator.land import Landing
from autopilot.navigator.setpoint import Vector

_HEIGHT_M = 0.5  # height error at which a climb or descent of the return ends
_HOME_M = 1.0  # distance from home at which the way home ends; the landing corrects the rest


class _Phase(IntEnum):
    CLIMB = 0
    CRUISE = 1
    DESCEND = 2
    WAIT = 3
    LAND = 4


class Return:
    """Mode Return. Nearer to home than RTL_MIN_DIST it does not climb first."""

    __slots__ = ("_context", "_home_yaw", "_landing", "_phase", "_start", "_target", "_until_us")

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._landing = Landing(context)
        self._phase = _Phase.CLIMB
        self._start: Vector = (0.0, 0.0, 0.0)
        self._target: Vector = (0.0, 0.0, 0.0)  # home, at the height of the way back
        self._home_yaw = 0.0
        self._until_us = 0

    def start(self) -> None:
        context = self._context
        context.reset_speeds()
        if context.number("RTL_SPEED") > 0.0:
            context.cruise_speed = context.number("RTL_SPEED")
        state = context.state
        home = state.home_ned
        self._home_yaw = state.home_yaw_rad
        here = context.stop_point()
        back_d = here[2]
        if hypot(here[0] - home[0], here[1] - home[1]) > context.number("RTL_MIN_DIST"):
            back_d = min(back_d, home[2] - context.number("RTL_RETURN_ALT"))
        self._target = (home[0], home[1], back_d)
        self._start = (here[0], here[1], back_d)
        self._phase = _Phase.CLIMB
        context.fly_to(self._start, state.yaw_rad)

    def frame(self) -> None:
        context = self._context
        if context.is_on_ground:
            return
        phase = self._phase
        if phase is _Phase.LAND:
            self._landing.frame()
            return
        pos = context.state.estimate.pos_ned
        target = self._target
        if phase is _Phase.CLIMB:
            if pos[2] < target[2] + _HEIGHT_M:
                self._phase = _Phase.CRUISE
                yaw = context.heading_to(self._start, target, float("nan"))
                context.fly_to(target, yaw, self._start)
        elif phase is _Phase.CRUISE:
            if hypot(pos[0] - target[0], pos[1] - target[1]) < _HOME_M:
                self._arrive()
        elif phase is _Phase.DESCEND:
            if abs(pos[2] - target[2]) < _HEIGHT_M:
                self._phase = _Phase.WAIT
                delay_s = context.number("RTL_LAND_DELAY")
                self._until_us = context.state.time_us + int(delay_s * 1e6) if delay_s >= 0.0 else -1
        elif self._until_us >= 0 and context.state.time_us >= self._until_us:
            self._land()

    def _arrive(self) -> None:
        context = self._context
        if context.number("RTL_LAND_DELAY") == 0.0:
            self._land()
            return
        north, east, back_d = self._target
        wait_d = context.state.home_ned[2] - context.number("RTL_DESCEND_ALT")
        self._target = (north, east, max(back_d, wait_d))
        self._phase = _Phase.DESCEND
        context.fly_to(self._target, self._home_yaw)

    def _land(self) -> None:
        self._phase = _Phase.LAND
        self._landing.start(self._target[0], self._target[1], self._home_yaw)
        self._landing.frame()
