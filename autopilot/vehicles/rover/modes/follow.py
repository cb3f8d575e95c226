"""Follow me on wheels: the place beside the target is navigator's, the way there is a rover's."""

from math import atan2, cos, hypot, pi

from autopilot.navigator.modes.follow import Follow
from autopilot.navigator.setpoint import Vector
from common.attitude import wrapped

_PER_S = 0.5  # speed towards the place per metre that it is away; guess
_STAND_M_S = 0.15  # slower than this it stands
_BACK_M_S = 1.5  # up to which it backs away from a target that comes nearer, rather than turning round; guess
_BEHIND = -0.5  # cosine of the angle to the place from which that is behind


class RoverFollow(Follow):
    """Mode Follow: as those that fly, but for heights and sideways; it stands where the target stands."""

    __slots__ = ()

    def _fly(self, pos_ned: Vector, vel_ned: Vector, yaw: float) -> None:  # noqa: ARG002
        context = self._context
        here, stop_m = context.state.estimate.pos_ned, context.number("HG_RO_HOLD_RAD")
        away = (pos_ned[0] - here[0], pos_ned[1] - here[1])
        vel_north, vel_east = (vel_ned[i] + _PER_S * away[i] for i in range(2))
        speed = min(hypot(vel_north, vel_east), context.number(context.craft.limits.cruise_speed))
        if speed < _STAND_M_S or (hypot(*away) < stop_m and hypot(vel_ned[0], vel_ned[1]) < _STAND_M_S):
            context.setpoint.drive(speed=0.0, yaw_rate=0.0)
            return
        course = atan2(vel_east, vel_north)
        if speed < _BACK_M_S and cos(course - context.state.yaw_rad) < _BEHIND:
            context.setpoint.drive(speed=-speed, yaw=wrapped(course + pi))
        else:
            context.setpoint.drive(speed=speed, yaw=course)

    def _hold_still(self) -> None:
        self._context.setpoint.drive(speed=0.0, yaw_rate=0.0)
