"""Follow me on wheels: the place beside the target is navigator's, the way there is a rover's."""

from math import atan2, cos, dist, hypot, pi

from autopilot.navigator.context import NavContext
from autopilot.navigator.modes.follow import Follow
from autopilot.navigator.setpoint import Vector
from common.attitude import wrapped

_PER_S = 0.5  # speed towards the place per metre that it is away; guess
_STAND_M_S = 0.15  # slower than this it stands
_MOVES_M_S = 0.4  # faster than this it moves on; guess
_BACK_M_S = 1.5  # up to which it backs away from a target that comes nearer, rather than turning round; guess
_BEHIND = -0.5  # cosine of the angle to the place from which that is behind
_SAME_PLACE_M = 1.0  # a place beside a target that stands wanders by no more: its noise; guess


class RoverFollow(Follow):
    """Mode Follow: as those that fly, but for heights and sideways; it stands where the target stands."""

    __slots__ = ("_place",)

    def __init__(self, context: NavContext) -> None:
        super().__init__(context)
        self._place: Vector | None = None  # [m] beside a target that stands

    def start(self) -> None:
        super().start()
        self._place = None

    def _fly(self, pos_ned: Vector, vel_ned: Vector, yaw: float) -> None:  # noqa: ARG002
        if hypot(vel_ned[0], vel_ned[1]) < (_STAND_M_S if self._place is None else _MOVES_M_S):
            self._go_beside(pos_ned)
        else:
            self._place = None
            self._go_along(pos_ned, vel_ned)

    def _go_beside(self, pos_ned: Vector) -> None:
        """To a place that stands: as to any, and no more once it is there."""
        if self._place is None or dist(self._place[:2], pos_ned[:2]) > _SAME_PLACE_M:
            self._place = pos_ned
            self._context.fly_to(pos_ned, self._context.state.yaw_rad)

    def _go_along(self, pos_ned: Vector, vel_ned: Vector) -> None:
        """With a place that moves, and to it."""
        context = self._context
        here = context.state.estimate.pos_ned
        vel_north, vel_east = (vel_ned[i] + _PER_S * (pos_ned[i] - here[i]) for i in range(2))
        speed = min(hypot(vel_north, vel_east), context.number(context.craft.limits.cruise_speed))
        if speed < _STAND_M_S:
            context.setpoint.drive(speed=0.0, yaw_rate=0.0)
            return
        course = atan2(vel_east, vel_north)
        if speed < _BACK_M_S and cos(course - context.state.yaw_rad) < _BEHIND:
            context.setpoint.drive(speed=-speed, yaw=wrapped(course + pi))
        else:
            context.setpoint.drive(speed=speed, yaw=course)

    def _hold_still(self) -> None:
        self._place = None
        self._context.setpoint.drive(speed=0.0, yaw_rate=0.0)
