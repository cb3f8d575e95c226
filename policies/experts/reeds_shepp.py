"""Reeds-Shepp paths: the shortest ways between two poses of a car that steers at most so much and may reverse.

J. A. Reeds, L. A. Shepp, "Optimal paths for a car that goes both forwards and backwards", Pacific J. Math. 145 (1990):
a shortest path is one of 48 words of at most five pieces, arcs of the smallest radius or straight lines. Twelve of them
are solved below; time reversed and the plane mirrored, they give the others.

Frames are Unity's: x right, z forward, yaw clockwise from +z. A right turn raises the yaw, a left turn lowers it.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEFT, STRAIGHT, RIGHT = -1, 0, 1
_HALF = np.pi / 2
_PIECES = 5


@dataclass(frozen=True, slots=True)
class ReedsSheppPath:
    """Pieces that are driven one after another."""

    turns: NDArray[np.int64]  # (pieces,) LEFT, STRAIGHT or RIGHT
    lengths_m: Array  # (pieces,), negative: in reverse
    radius_m: float

    @property
    def length_m(self) -> float:
        return float(np.abs(self.lengths_m).sum())

    def poses(self, start: Array, spacing_m: float) -> tuple[Array, NDArray[np.int64]]:
        """Poses along the path from `start` (x, z, yaw), (n, 3), and the way each is driven: 1 ahead, -1 back."""
        poses = [np.asarray(start, dtype=np.float64)[None]]
        directions = [np.ones(1, dtype=np.int64)]
        for turn, length in zip(self.turns, self.lengths_m, strict=True):
            count = max(1, int(np.ceil(abs(length) / spacing_m)))
            poses.append(moved(poses[-1][-1], int(turn), length * np.arange(1, count + 1) / count, self.radius_m))
            directions.append(np.full(count, 1 if length >= 0.0 else -1))
        directions[0] = directions[min(1, len(directions) - 1)][:1]
        return np.concatenate(poses), np.concatenate(directions)


def moved(pose: Array, turn: int, length_m: "float | Array", radius_m: float) -> Array:
    """The pose (x, z, yaw) after a piece of each length, shape (..., 3)."""
    x, z, yaw = (float(value) for value in pose)
    lengths = np.asarray(length_m, dtype=np.float64)
    if turn == STRAIGHT:
        return np.stack([x + lengths * np.sin(yaw), z + lengths * np.cos(yaw), np.full_like(lengths, yaw)], axis=-1)
    after = yaw + turn * lengths / radius_m
    x_after = x + turn * radius_m * (np.cos(yaw) - np.cos(after))  # round a centre at its right or its left
    z_after = z + turn * radius_m * (np.sin(after) - np.sin(yaw))
    return np.stack([x_after, z_after, after], axis=-1)


def paths_by_length(start: Array, goal: Array, radius_m: float) -> Iterator[ReedsSheppPath]:
    """The paths from one pose (x, z, yaw) to another, one per word that leads there, the shortest first."""
    words, totals = _words(*_local(np.asarray(start, float), np.asarray(goal, float), radius_m))
    for k in np.argsort(totals):
        if np.isfinite(totals[k]):
            is_driven = np.abs(words[k]) > 1e-9
            yield ReedsSheppPath(np.array(_TURNS[k])[is_driven], words[k][is_driven] * radius_m, radius_m)


def shortest_path(start: Array, goal: Array, radius_m: float) -> ReedsSheppPath:
    """The shortest path from one pose (x, z, yaw) to another."""
    return next(paths_by_length(start, goal, radius_m))


def shortest_lengths(starts: Array, goals: Array, radius_m: float) -> Array:
    """Lengths [m] of the shortest paths between poses, shapes (..., 3)."""
    _, totals = _words(*_local(np.asarray(starts, float), np.asarray(goals, float), radius_m))
    return np.asarray(totals.min(axis=0) * radius_m)


def _local(start: Array, goal: Array, radius_m: float) -> tuple[Array, Array, Array]:
    """The goal in the start's frame as the paper has it: x ahead, y left, angle counter-clockwise; in radii."""
    gap = (goal - start)[..., :2] / radius_m
    sin, cos = np.sin(start[..., 2]), np.cos(start[..., 2])
    ahead = gap[..., 0] * sin + gap[..., 1] * cos
    left = -gap[..., 0] * cos + gap[..., 1] * sin
    return ahead, left, start[..., 2] - goal[..., 2]


def _words(x: Array, y: Array, phi: Array) -> tuple[Array, Array]:
    """Lengths of the pieces of every word, shape (words, 5, ...), and their sums; infinite: it does not lead there."""
    words = np.zeros((4 * len(_FORMULAS), _PIECES, *np.shape(x)))
    flips = ((1, 1), (-1, 1), (1, -1), (-1, -1))  # of time (x, phi and the lengths) and of the plane (y, phi)
    with np.errstate(invalid="ignore"):  # where a word does not exist its lengths are NaN
        for i_flip, (time, plane) in enumerate(flips):
            for k, (_, formula) in enumerate(_FORMULAS):
                for j, piece in enumerate(formula(time * x, plane * y, time * plane * phi)):
                    words[i_flip * len(_FORMULAS) + k, j] = time * np.asarray(piece)
    totals = np.abs(words).sum(axis=1)
    return words, np.where(np.isnan(totals), np.inf, totals)


# The words. Each takes the goal (x, y, phi) and gives the signed lengths of its pieces in radii; the first turn is to
# the left. The comments show them with their directions: + ahead, - in reverse, a quarter: an arc of 90 deg.


def _wrapped(angle: Array) -> Array:
    """In [-pi, pi)."""
    return np.asarray((angle + np.pi) % (2.0 * np.pi) - np.pi)


def _same(x: Array, y: Array, phi: Array) -> tuple[Array, Array]:
    """Distance and bearing between the centres of the first circle and of a last circle on the same side."""
    a, b = x - np.sin(phi), y - 1.0 + np.cos(phi)
    return np.hypot(a, b), np.arctan2(b, a)


def _other(x: Array, y: Array, phi: Array) -> tuple[Array, Array]:
    """The same with the last circle on the other side."""
    a, b = x + np.sin(phi), y - 1.0 - np.cos(phi)
    return np.hypot(a, b), np.arctan2(b, a)


def _lsl(x: Array, y: Array, phi: Array) -> tuple[Array, ...]:  # L+ S+ L+
    u, t = _same(x, y, phi)
    return t, u, _wrapped(phi - t)


def _lsr(x: Array, y: Array, phi: Array) -> tuple[Array, ...]:  # L+ S+ R+
    gap, bearing = _other(x, y, phi)
    u = np.sqrt(gap**2 - 4.0)
    t = _wrapped(bearing + np.arctan2(2.0, u))
    return t, u, _wrapped(t - phi)


def _lrl_cusp_ahead(x: Array, y: Array, phi: Array) -> tuple[Array, ...]:  # L+ R- L+
    gap, bearing = _same(x, y, phi)
    a = np.arccos(gap / 4.0)
    t, u = _wrapped(bearing + _HALF + a), _wrapped(np.pi - 2.0 * a)
    return t, -u, _wrapped(phi - t - u)


def _lrl_cusp_back(x: Array, y: Array, phi: Array) -> tuple[Array, ...]:  # L+ R- L-
    gap, bearing = _same(x, y, phi)
    a = np.arccos(gap / 4.0)
    t, u = _wrapped(bearing + _HALF + a), _wrapped(np.pi - 2.0 * a)
    return t, -u, -_wrapped(t + u - phi)


def _lrl_late_cusp(x: Array, y: Array, phi: Array) -> tuple[Array, ...]:  # L+ R+ L-
    gap, bearing = _same(x, y, phi)
    u = np.arccos(1.0 - gap**2 / 8.0)
    t = _wrapped(bearing + _HALF - np.arcsin(2.0 * np.sin(u) / np.maximum(gap, 1e-12)))
    return t, u, -_wrapped(t - u - phi)


def _lrlr_one_cusp(x: Array, y: Array, phi: Array) -> tuple[Array, ...]:  # L+ R+ L- R-, the middle arcs alike
    gap, bearing = _other(x, y, phi)
    is_near = gap <= 2.0
    a = np.arccos(np.where(is_near, gap + 2.0, gap - 2.0) / 4.0)
    t = _wrapped(bearing + _HALF + np.where(is_near, a, -a))
    u = np.where(is_near, a, np.pi - a)
    return t, u, -u, -_wrapped(phi - t + 2.0 * u)


def _lrlr_two_cusps(x: Array, y: Array, phi: Array) -> tuple[Array, ...]:  # L+ R- L- R+, the middle arcs alike
    gap, bearing = _other(x, y, phi)
    u = np.arccos(np.where(gap**2 <= 20.0, (20.0 - gap**2) / 16.0, np.nan))
    t = _wrapped(bearing + _HALF + np.arcsin(2.0 * np.sin(u) / np.maximum(gap, 1e-12)))
    return t, -u, -u, _wrapped(t - phi)


def _lrsl(x: Array, y: Array, phi: Array) -> tuple[Array, ...]:  # L+ R-quarter S- L-
    gap, bearing = _same(x, y, phi)
    u = np.sqrt(gap**2 - 4.0) - 2.0
    t = _wrapped(bearing + _HALF + np.arctan2(2.0, u + 2.0))
    return t, np.full_like(t, -_HALF), -u, -_wrapped(t - phi + _HALF)


def _lsrl(x: Array, y: Array, phi: Array) -> tuple[Array, ...]:  # L+ S+ R+quarter L-
    gap, bearing = _same(x, y, phi)
    u = np.sqrt(gap**2 - 4.0) - 2.0
    t = _wrapped(bearing + _HALF - np.arctan2(u + 2.0, 2.0))
    return t, u, np.full_like(t, _HALF), -_wrapped(t - phi - _HALF)


def _lrsr(x: Array, y: Array, phi: Array) -> tuple[Array, ...]:  # L+ R-quarter S- R-
    gap, bearing = _other(x, y, phi)
    t, u = _wrapped(bearing + _HALF), np.where(gap >= 2.0, gap - 2.0, np.nan)
    return t, np.full_like(t, -_HALF), -u, -_wrapped(phi - t - _HALF)


def _lslr(x: Array, y: Array, phi: Array) -> tuple[Array, ...]:  # L+ S+ L+quarter R-
    gap, bearing = _other(x, y, phi)
    t, u = bearing, np.where(gap >= 2.0, gap - 2.0, np.nan)
    return t, u, np.full_like(t, _HALF), -_wrapped(phi - t - _HALF)


def _lrslr(x: Array, y: Array, phi: Array) -> tuple[Array, ...]:  # L+ R-quarter S- L-quarter R+
    gap, bearing = _other(x, y, phi)
    u = np.where(gap >= 4.0, np.sqrt(gap**2 - 4.0) - 4.0, np.nan)
    t = _wrapped(bearing + _HALF + np.arctan2(2.0, u + 4.0))
    return t, np.full_like(t, -_HALF), -u, np.full_like(t, -_HALF), _wrapped(t - phi)


_FORMULAS: tuple[tuple[str, Callable[[Array, Array, Array], tuple[Array, ...]]], ...] = (
    ("LSL", _lsl),
    ("LSR", _lsr),
    ("LRL", _lrl_cusp_ahead),
    ("LRL", _lrl_cusp_back),
    ("LRL", _lrl_late_cusp),
    ("LRLR", _lrlr_one_cusp),
    ("LRLR", _lrlr_two_cusps),
    ("LRSL", _lrsl),
    ("LSRL", _lsrl),
    ("LRSR", _lrsr),
    ("LSLR", _lslr),
    ("LRSLR", _lrslr),
)
_SIDE = {"L": LEFT, "S": STRAIGHT, "R": RIGHT}
_TURNS = [  # of every word, in the order of `_words`: mirroring the plane swaps left and right
    [plane * _SIDE[letter] for letter in name.ljust(_PIECES, "S")] for plane in (1, 1, -1, -1) for name, _ in _FORMULAS
]
