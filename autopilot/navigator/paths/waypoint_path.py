"""A way of straight stretches, flown one after the other: around a fence, back along a mission or along its own track.

In: points. Out: setpoints; corners are passed with the speed with which the turn fits into the acceptance radius.
"""

from collections.abc import Sequence
from math import hypot, isfinite, nan, sqrt

from autopilot.navigator.context import NavContext
from autopilot.navigator.mission.mission_route import corner_accel
from autopilot.navigator.setpoint import Vector

CORNER_RADIUS_M = 1.0  # a corner counts as reached; below the margin by which ways keep off a fence; guess
END_RADIUS_M = 1.0  # horizontally; what follows corrects the rest
_SLOWEST_CORNER_M_S = 0.5  # slower than this it is simpler to stop


class WaypointPath:
    """The way being flown.

    Args:
        context: what the navigator's modes share.
    """

    __slots__ = ("_context", "_from", "_i_point", "points")

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self.points: list[Vector] = []
        self._i_point = 0
        self._from: Vector = (0.0, 0.0, 0.0)

    @property
    def left(self) -> int:
        """How many points are still to be reached."""
        return len(self.points) - self._i_point

    def start(self, start: Vector, points: Sequence[Vector]) -> None:
        """Begins at a position [m] to fly over the points; there is at least one."""
        self.points = list(points)
        self._i_point = 0
        self._from = start
        self._fly()

    def stop(self) -> None:
        """Forgets the way."""
        self.points = []
        self._i_point = 0

    def frame(self) -> bool:
        """Goes on to the next point when one is reached; true once the last one is."""
        if self._i_point >= len(self.points):
            return True
        context = self._context
        north, east, down = context.state.estimate.pos_ned
        target = self.points[self._i_point]
        is_last = self._i_point + 1 == len(self.points)
        radius = END_RADIUS_M if is_last else CORNER_RADIUS_M
        if hypot(north - target[0], east - target[1]) > radius:
            return False
        if abs(down - target[2]) > context.alt_radius():
            return False
        self._i_point += 1
        if is_last:
            return True
        self._from = target
        self._fly()
        return False

    def _fly(self) -> None:
        context = self._context
        target = self.points[self._i_point]
        yaw = context.heading_to(self._from, target, nan)
        context.fly_to(target, yaw, self._from, self._exit_speed(target), CORNER_RADIUS_M)

    def _exit_speed(self, target: Vector) -> float:
        """Speed [m/s] at the corner: the turn fits into its radius, and the next stretch is long enough to brake."""
        if self._i_point + 1 >= len(self.points):
            return 0.0
        start, following = self._from, self.points[self._i_point + 1]
        in_north, in_east = target[0] - start[0], target[1] - start[1]
        out_north, out_east = following[0] - target[0], following[1] - target[1]
        in_length, out_length = hypot(in_north, in_east), hypot(out_north, out_east)
        if in_length < max(0.5, abs(target[2] - start[2])) or out_length < max(0.5, abs(following[2] - target[2])):
            return 0.0  # a steep or very short stretch
        context = self._context
        limits = context.craft.limits
        accel = corner_accel(context)
        cosine = (in_north * out_north + in_east * out_east) / (in_length * out_length)
        tan_half_sq = max(1.0 - cosine, 1e-9) / max(1.0 + cosine, 1e-6)
        cruise = context.cruise_speed if isfinite(context.cruise_speed) else context.number(limits.cruise_speed)
        speed = min(sqrt(accel * CORNER_RADIUS_M / sqrt(tan_half_sq)), sqrt(accel * out_length), cruise)
        return speed if speed > _SLOWEST_CORNER_M_S else 0.0
