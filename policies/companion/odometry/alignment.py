"""How far a lens has moved between two pictures whose turn is known: direct alignment of colour and depth.

In: two views, the turn between them, a guess of the way. Out: the way, and how well it fits. Each point of the first
view is put into the second; what grey and inverse depth differ there is made small by Gauss-Newton steps (Kerl, Sturm,
Cremers 2013, "Robust odometry estimation for RGB-D cameras", with three unknowns instead of six), first at half the
size, where the guess may be farther off. What does not fit, since it moves itself or was hidden, counts little.
"""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from policies.companion.odometry.view import View

Floats = NDArray[np.floating[Any]]
_STEPS = (6, 6)  # at most, at half the size and at the whole
_STILL_M = 2e-4  # a smaller step is the last
_SETTLED_M = 0.02  # and after a larger last one nothing is known; guess
_NEAR_M = 0.3  # nearer nothing is put into a picture
_MARGIN = 1.0  # [pixels] from the edge, where slopes are known
_LEAST_POINTS = 60  # of a view; fewer say nothing
_GREY_LEAST = 1.0  # what grey differs at least by: noise, rounding
_INVERSE_LEAST = 0.02  # [1/m] and inverse depth; three times what it does: rounding of level ground stays where it is
_GREY_NOISE, _INVERSE_NOISE = 0.15, 0.1  # of a slope over that of a difference, squared, where all is noise; computed
_FITS = 2.0  # times the usual difference: half of the weight is lost there
_NOBODY_KNOWS = 1e-3  # [1/m²] a way is known no worse
_THIN = 2  # at the whole size every second point in both directions counts: neighbours say the same


@dataclass(frozen=True, eq=False)
class Way:
    """What came of an alignment."""

    moved: NDArray[np.float64]
    """[m] the lens, in the axes of the second view: right, down, ahead."""
    cov: NDArray[np.float64]
    """[m²] (3, 3) if points erred independently, which neighbours do not."""
    fitting: float
    """Fraction of the points that fit, grey and depth both."""
    points: int
    """So many were in both views."""


def align(
    first: View, second: View, turn: NDArray[np.float64], guess: NDArray[np.float64], counts: NDArray[np.bool_]
) -> Way | None:
    """The way of the lens; None where there is too little to see.

    Args:
        first: the older view.
        second: the newer one.
        turn: (3, 3) from the axes of the first to those of the second.
        guess: [m] of the way, in the axes of the second.
        counts: (height, width) of the first: no person is there.
    """
    coarse = np.ascontiguousarray(counts[::2, ::2] & counts[1::2, 1::2])
    way = _aligned(first.half, second.half, turn, guess, coarse, 1, _STEPS[0])
    if way is None:
        return None
    return _aligned(first, second, turn, way.moved, counts, _THIN, _STEPS[1])


def _aligned(
    first: View,
    second: View,
    turn: NDArray[np.float64],
    guess: NDArray[np.float64],
    counts: NDArray[np.bool_],
    thin: int,
    steps: int,
) -> Way | None:
    """At one size."""
    chosen = (slice(thin // 2, None, thin),) * 2
    is_used = (first.is_return & counts)[chosen]
    inverse = first.inverse_depth[chosen][is_used]
    if len(inverse) < _LEAST_POINTS:
        return None
    turned = (first.rays[chosen][is_used] / inverse[:, None]) @ turn.T.astype(np.float32)
    grey = first.grey[chosen][is_used]
    moved, way = guess.astype(np.float64), None
    for _ in range(steps):
        way = _step(second, turned - moved.astype(np.float32), grey)
        if way is None:
            return None
        moved = moved + way.moved
        if float(np.abs(way.moved).max()) < _STILL_M:
            break
    if way is None or float(np.abs(way.moved).max()) > _SETTLED_M:
        return None
    return Way(moved, way.cov, way.fitting, way.points)


def _step(second: View, points: Floats, grey: Floats) -> Way | None:
    """One Gauss-Newton step from where points are taken to be.

    Args:
        second: the view into which they are put.
        points: [m] (n, 3), right, down, ahead of its lens.
        grey: (n,) of them in the first view.
    """
    focal, centre = np.float32(second.focal), np.float32(second.centre)
    ahead = np.maximum(points[:, 2], np.float32(_NEAR_M))
    inverse = 1.0 / ahead
    right, down = points[:, 0] * inverse, points[:, 1] * inverse
    column, row = focal * right + centre, focal * down + centre
    looks = _sampled(second.looks, column, row)
    shape = _sampled(second.shape, column, row)
    most = second.grey.shape[1] - 1 - _MARGIN
    is_in = (points[:, 2] > _NEAR_M) & (shape[:, 3] > 0.99)
    is_in &= (column > _MARGIN) & (column < most) & (row > _MARGIN) & (row < most)
    if int(is_in.sum()) < _LEAST_POINTS:
        return None
    looks, shape, inverse, right, down = looks[is_in], shape[is_in], inverse[is_in], right[is_in], down[is_in]
    differs = looks[:, 0] - grey[is_in]
    differs -= np.median(differs)  # exposure
    gaps = shape[:, 0] - inverse
    scaled = focal * inverse
    by_grey = _slopes(looks, right, down, scaled)
    by_depth = _slopes(shape, right, down, scaled)
    by_depth[:, 2] -= inverse * inverse
    grey_std, gap_std = _usual(differs, _GREY_LEAST), _usual(gaps, _INVERSE_LEAST)
    grey_fits, depth_fits = _fit(differs / grey_std), _fit(gaps / gap_std)
    grey_weighted = by_grey * (grey_fits / grey_std**2)[:, None]
    depth_weighted = by_depth * (depth_fits / gap_std**2)[:, None]
    information = (grey_weighted.T @ by_grey + depth_weighted.T @ by_depth).astype(np.float64)
    slope = (grey_weighted.T @ differs + depth_weighted.T @ gaps).astype(np.float64)
    step = -np.linalg.solve(information + _NOBODY_KNOWS * np.eye(3), slope)
    noise = _noise_information(right, down, scaled, _GREY_NOISE * grey_fits + _INVERSE_NOISE * depth_fits)
    fitting = float(((grey_fits > 0.25) & (depth_fits > 0.25)).mean())  # within FITS times what is usual
    return Way(np.asarray(step, np.float64), _cov(information - noise), fitting, len(inverse))


def _noise_information(right: Floats, down: Floats, scaled: Floats, fraction: Floats) -> NDArray[np.float64]:
    """(3, 3) [1/m²] what slopes would seem to tell if they were noise alone, a fraction of what differs.

    Ground without any texture would be measured with great confidence otherwise.
    """
    none = np.zeros_like(scaled)
    across = np.stack([-scaled, none, scaled * right], -1)
    upright = np.stack([none, -scaled, scaled * down], -1)
    weighted = fraction[:, None]
    return np.asarray((weighted * across).T @ across + (weighted * upright).T @ upright, np.float64)


def _cov(information: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, 3) [m²] of an information that may be nothing or less in some direction, which nobody knows then."""
    values, vectors = np.linalg.eigh(information)
    return np.asarray((vectors / np.maximum(values, _NOBODY_KNOWS)) @ vectors.T, np.float64)


def _sampled(planes: Floats, column: Floats, row: Floats) -> Floats:
    """(n, planes) between pixels."""
    out: Floats = np.asarray(cv2.remap(planes, column[:, None], row[:, None], cv2.INTER_LINEAR), np.float32)[:, 0]
    return out


def _slopes(planes: Floats, right: Floats, down: Floats, scaled: Floats) -> Floats:
    """(n, 3) how a sampled plane changes as the lens moves right, down and ahead [1/m]."""
    to_right, to_down = planes[:, 1] * scaled, planes[:, 2] * scaled
    return np.stack([-to_right, -to_down, to_right * right + to_down * down], -1)


def _usual(errors: Floats, least: float) -> float:
    """The standard deviation of what fits, by the median."""
    return max(1.4826 * float(np.median(np.abs(errors))), least)


def _fit(errors: Floats) -> Floats:
    """Weights: 1 for what fits, little for what does not (Geman and McClure)."""
    out: Floats = 1.0 / np.square(1.0 + np.square(errors / _FITS))
    return out
