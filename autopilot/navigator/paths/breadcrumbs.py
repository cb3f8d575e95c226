"""The vehicle's own track since take-off, kept short enough to remember: what a smart return flies back along.

A position is kept every SRTL_ACCURACY metres. When SRTL_POINTS are full, points on a straight line are dropped (Ramer,
1972; Douglas and Peucker, 1973), and loops are cut where the track comes close to itself.
"""

import numpy as np
from numpy.typing import NDArray

from autopilot.interface.vehicle_state import Mode, Severity
from autopilot.navigator.context import NavContext
from autopilot.navigator.setpoint import Vector

_PERIOD_US = 200_000  # between two looks; at the highest speed that is within the default accuracy
_ROOM_FRACTION = 0.9  # of the points: if tidying leaves more, there is no room to go on
_DENSE_MAX = 600  # points among which loops are looked for; bounds the time that takes
_ROWS = 32  # points whose passages are looked for at once
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
            if len(self.points) > _ROOM_FRACTION * most:
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
    i_leg = np.repeat(np.arange(len(counts)), counts)
    fraction = (np.arange(len(i_leg)) - (np.cumsum(counts) - counts)[i_leg]) / counts[i_leg]
    between = points[i_leg] + fraction[:, None] * (points[1:] - points[:-1])[i_leg]
    return np.concatenate([between, points[-1:]])


def without_straights(points: _Array, tolerance_m: float) -> _Array:
    """The points that are needed to stay within the tolerance of the track, shape (points, 3)."""
    is_kept = np.zeros(len(points), dtype=bool)
    is_kept[[0, -1]] = True
    parts = [(0, len(points) - 1)]
    while parts:
        first, last = parts.pop()
        if last - first < 2:
            continue
        off_sq = _off_segment_sq(points[first + 1 : last], points[first], points[last])
        i_worst = int(off_sq.argmax())
        if off_sq[i_worst] > tolerance_m * tolerance_m:
            middle = first + 1 + i_worst
            is_kept[middle] = True
            parts += [(first, middle), (middle, last)]
    return points[is_kept]


def without_loops(points: _Array, near_m: float) -> _Array:
    """The track without the ways that lead back to where it has been.

    From each point it goes on at the end of the last later stretch that passes near it.
    """
    kept = [0]
    i_point = first = 0
    passages = _last_passages(points, 0, near_m)
    while i_point < len(points) - 1:
        if i_point >= first + _ROWS:
            first, passages = i_point, _last_passages(points, i_point, near_m)
        i_point = max(int(passages[i_point - first]), i_point + 1)
        kept.append(i_point)
    return points[kept]


def _last_passages(points: _Array, first: int, near_m: float) -> NDArray[np.int64]:
    """Number of the end of the last stretch after the next two that passes near each of some points; 0 if none does.

    For _ROWS points from `first` on at once: one by one they would take longer than a frame of the vehicle has.
    """
    here = points[first : first + _ROWS] - points[first]  # from there: large numbers would cancel
    starts, ends = points[first + 2 : -1] - points[first], points[first + 3 :] - points[first]
    if not len(starts):
        return np.zeros(len(here), np.int64)
    edge = ends - starts
    length_sq = np.maximum(np.sum(edge * edge, axis=1), 1e-9)
    along = here @ edge.T - np.sum(starts * edge, axis=1)
    fraction = np.minimum(np.maximum(along / length_sq, 0.0), 1.0)
    off_sq = np.sum(here * here, axis=1)[:, None] - 2.0 * here @ starts.T + np.sum(starts * starts, axis=1)
    off_sq += fraction * (fraction * length_sq - 2.0 * along)
    is_later = np.arange(len(starts)) >= np.arange(len(here))[:, None]
    is_near = is_later & (off_sq < near_m * near_m)
    last = len(starts) - 1 - np.argmax(is_near[:, ::-1], axis=1)
    return np.where(is_near.any(axis=1), first + 3 + last, 0)


def _off_segment_sq(points: _Array, start: _Array, end: _Array) -> _Array:
    """Square of the distance [m²] of each point from a straight stretch."""
    edge, there = end - start, points - start
    length_sq = max(float(edge @ edge), 1e-9)
    along = there @ edge
    fraction = np.minimum(np.maximum(along / length_sq, 0.0), 1.0)
    off_sq: _Array = np.einsum("ij,ij->i", there, there) + fraction * (fraction * length_sq - 2.0 * along)
    return off_sq
