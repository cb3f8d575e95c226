"""The vehicle's own track since take-off, kept short enough to remember: what a smart return flies back along.

A place is kept every SRTL_ACCURACY metres. When SRTL_POINTS are full, what lies on a straight line is dropped (Ramer,
1972; Douglas and Peucker, 1973), and loops are cut where the track comes close to itself.
"""

import numpy as np
from numpy.typing import NDArray

from autopilot.navigator.context import NavContext
from autopilot.navigator.setpoint import Vector
from autopilot.vehicle import Mode, Severity

_PERIOD_US = 200_000  # between two looks; at the highest speed that is within the default accuracy
_ROOM_SHARE = 0.9  # of the points: if tidying leaves more, there is no room to go on
_DENSE_MAX = 1_000  # points among which loops are looked for; bounds the time that takes
_Array = NDArray[np.float64]


class Breadcrumbs:
    """The track of one vehicle."""

    __slots__ = ("_context", "_is_full", "_next_us", "points")

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self.points: list[Vector] = []  # [m] from the take-off on
        self._is_full = False
        self._next_us = 0

    def clear(self) -> None:
        """The vehicle has just been armed."""
        self.points = []
        self._is_full = False
        self._next_us = 0

    def refusal(self) -> str:
        """Why there is no way back; empty if there is one."""
        if self._is_full:
            return "the way back is too long to remember"
        return "" if self.points else "no way back is known"

    def frame(self) -> None:
        """Remembers where the vehicle has been; called while armed."""
        context = self._context
        state = context.state
        if state.time_us < self._next_us:
            return
        self._next_us = state.time_us + _PERIOD_US
        if self._is_full or not context.has_position or context.is_on_ground or state.mode is Mode.SMART_RETURN:
            return
        pos = state.estimate.pos_ned
        here = (float(pos[0]), float(pos[1]), float(pos[2]))
        points = self.points
        if points and _distance_sq(points[-1], here) < context.number("SRTL_ACCURACY") ** 2:
            return
        points.append(here)
        most = context.number("SRTL_POINTS")
        if len(points) >= most:
            self.tidy()
            if len(self.points) > _ROOM_SHARE * most:
                self._is_full = True
                context.announcer.statustext(Severity.WARNING, "Smart return is not possible any more: track too long")

    def tidy(self) -> None:
        """Drops what the way back does not need: points on a line, and loops."""
        accuracy = self._context.number("SRTL_ACCURACY")
        if len(self.points) < 2:
            return
        dense = with_steps(np.array(self.points), accuracy)
        points = without_straights(without_loops(dense, accuracy), 0.5 * accuracy)
        self.points = [(float(north), float(east), float(down)) for north, east, down in points]


def _distance_sq(a: Vector, b: Vector) -> float:
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2


def with_steps(points: _Array, longest_m: float) -> _Array:
    """The track with points between, so that no step is longer; with longer steps where there would be too many."""
    lengths = np.sqrt(np.sum(np.diff(points, axis=0) ** 2, axis=1))
    step_m = max(longest_m, float(lengths.sum()) / _DENSE_MAX)
    counts = np.maximum(np.ceil(lengths / step_m).astype(np.int64), 1)
    parts = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(points[:-1], points[1:], counts, strict=True)]
    return np.concatenate([*parts, points[-1:]])


def without_straights(points: _Array, tolerance_m: float) -> _Array:
    """The points that are needed to stay within the tolerance of the track, shape (points, 3)."""
    is_kept = np.zeros(len(points), dtype=bool)
    is_kept[[0, -1]] = True
    parts = [(0, len(points) - 1)]
    while parts:
        first, last = parts.pop()
        if last - first < 2:
            continue
        off = _off_segment(points[first + 1 : last], points[first], points[last])
        i_worst = int(np.argmax(off))
        if off[i_worst] > tolerance_m:
            middle = first + 1 + i_worst
            is_kept[middle] = True
            parts += [(first, middle), (middle, last)]
    return points[is_kept]


def without_loops(points: _Array, near_m: float) -> _Array:
    """The track without the ways that lead back to where it has been.

    From each point it goes on at the end of the last later stretch that passes near it.
    """
    kept = [0]
    i_point = 0
    while i_point < len(points) - 1:
        i_point = max(_last_passage(points, i_point, near_m), i_point + 1)
        kept.append(i_point)
    return points[kept]


def _last_passage(points: _Array, i_point: int, near_m: float) -> int:
    """Number of the end of the last stretch after the next two that passes near a point; 0 if none does."""
    starts, ends = points[i_point + 2 : -1], points[i_point + 3 :]
    way = ends - starts
    length_sq = np.maximum(np.sum(way * way, axis=1), 1e-9)
    share = np.clip(np.sum((points[i_point] - starts) * way, axis=1) / length_sq, 0.0, 1.0)
    off_sq = np.sum((starts + share[:, None] * way - points[i_point]) ** 2, axis=1)
    near = np.flatnonzero(off_sq < near_m * near_m)
    return i_point + 3 + int(near[-1]) if len(near) else 0


def _off_segment(points: _Array, start: _Array, end: _Array) -> _Array:
    """Distance [m] of each point from a straight stretch."""
    way = end - start
    length_sq = max(float(way @ way), 1e-9)
    share = np.clip((points - start) @ way / length_sq, 0.0, 1.0)
    off: _Array = np.sqrt(np.sum((start + share[:, None] * way - points) ** 2, axis=1))
    return off
