"""The end of a return: over the position, down to a waiting height, wait, land."""

from enum import IntEnum
from math import isfinite

from autopilot.navigator.context import NavContext
from autopilot.navigator.modes.land import Landing
from autopilot.navigator.setpoint import Vector

_HEIGHT_M = 0.5  # height error at which a descent ends


class _Phase(IntEnum):
    DESCEND = 0
    WAIT = 1
    LAND = 2


class Arrival:
    """What a return does once it is over its destination."""

    __slots__ = ("_context", "_landing", "_phase", "_target", "_until_us", "_yaw")

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._landing = Landing(context)
        self._phase = _Phase.DESCEND
        self._target: Vector = (0.0, 0.0, 0.0)
        self._yaw = 0.0
        self._until_us = 0

    def start(self, position: Vector, yaw: float, from_d: float) -> None:
        """Begins over a position on the ground [m], at a height (down coordinate), to land with a heading, NaN: any."""
        context = self._context
        self._yaw = yaw if isfinite(yaw) else context.state.yaw_rad
        if context.number("RTL_LAND_DELAY") == 0.0:
            self._target = position
            self._land()
            return
        wait_d = position[2] - context.number("RTL_DESCEND_ALT")
        self._target = (position[0], position[1], max(from_d, wait_d))
        self._phase = _Phase.DESCEND
        context.fly_to(self._target, self._yaw)

    def frame(self) -> None:
        context = self._context
        if self._phase is _Phase.LAND:
            self._landing.frame()
        elif self._phase is _Phase.DESCEND:
            if abs(context.state.estimate.pos_ned[2] - self._target[2]) < _HEIGHT_M:
                self._phase = _Phase.WAIT
                delay_s = context.number("RTL_LAND_DELAY")
                self._until_us = context.state.time_us + int(delay_s * 1e6) if delay_s >= 0.0 else -1
        elif 0 <= self._until_us <= context.state.time_us:
            self._land()

    def _land(self) -> None:
        self._phase = _Phase.LAND
        self._landing.start(self._target[0], self._target[1], self._yaw)
        self._landing.frame()
