"""How well a drone follows its owner: success, tracking and collision rates as EVT-Bench defines them, and more.

In: tracks of episodes flown in batch or over MAVLink. Out: figures with 95 % intervals over episodes, as a table for a
page and as lines for a terminal. An episode that ended early is not followed for the rest of its time.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from common.intervals import Interval, bootstrap, rate
from policies.tasks.follow_me.track import Loss, Ranges, Track, losses


@dataclass(frozen=True, slots=True)
class Scorecard:
    """Figures of some episodes. Rates over episodes have Wilson's intervals, the others the bootstrap's."""

    success: Interval  # fraction of episodes that end on time, in the band, the owner in view, without a collision (SR)
    tracking: Interval  # fraction of planned time within `far_m` with the owner in view (TR)
    collision: Interval  # fraction of episodes with a collision (CR)
    in_band: Interval  # fraction of planned time in [near_m, far_m]: the requirement's "within 3 m"
    distance_rmse_m: Interval  # of the distance to the middle of the band
    distance_median_m: Interval
    bearing_error_deg: Interval  # mean absolute bearing of the owner from the vehicle's heading
    in_view: Interval  # fraction of images with the owner in them
    losses_per_minute: Interval
    loss_s: Interval  # mean length of a loss
    reacquired: Interval  # fraction of losses that end within `reacquired_s`
    episodes: int
    minutes: float  # flown


def scorecard(tracks: Sequence[Track], ranges: Ranges | None = None) -> Scorecard:
    """The figures of some episodes.

    Args:
        tracks: at least one.
        ranges: of distance and time; none: EVT-Bench's.

    Raises:
        ValueError: no tracks.
    """
    if not tracks:
        raise ValueError("a scorecard needs an episode")
    ranges = ranges or Ranges()
    sums = np.array([_sums(track, ranges) for track in tracks])
    planned, count, in_band, tracked, squares, bearing, in_view, minutes, loss_count, loss_s, due, back = sums.T

    def fraction(part: NDArray[np.float64], whole: NDArray[np.float64], scale: float = 1.0) -> Interval:
        return bootstrap(len(tracks), lambda rows: scale * _ratio(part[rows].sum(), whole[rows].sum()))

    has_collision = np.array([track.has_collision(ranges) for track in tracks])
    return Scorecard(
        success=rate(np.array([_is_success(track, ranges) for track in tracks])),
        tracking=fraction(tracked, planned),
        collision=rate(has_collision),
        in_band=fraction(in_band, planned),
        distance_rmse_m=bootstrap(len(tracks), lambda rows: math.sqrt(squares[rows].sum() / count[rows].sum())),
        distance_median_m=bootstrap(len(tracks), _median_of(tracks)),
        bearing_error_deg=fraction(bearing, count),
        in_view=fraction(in_view, count),
        losses_per_minute=fraction(loss_count, minutes),
        loss_s=fraction(loss_s, loss_count),
        reacquired=fraction(back, due),
        episodes=len(tracks),
        minutes=float(minutes.sum()),
    )


def _is_success(track: Track, ranges: Ranges) -> bool:
    """EVT-Bench's success at the step limit: following at the end; ours also never touched anything on the way."""
    is_following = ranges.near_m <= track.distance_m[-1] <= ranges.far_m and bool(track.is_in_view[-1])
    return track.is_whole and bool(is_following) and not track.has_collision(ranges)


def _sums(track: Track, ranges: Ranges) -> list[float]:
    """Of one episode, in the order that `scorecard` takes them apart."""
    distance = track.distance_m
    is_in_band = (distance >= ranges.near_m) & (distance <= ranges.far_m)
    found = losses(track, ranges)
    off = distance - 0.5 * (ranges.near_m + ranges.far_m)
    due = [loss for loss in found if _is_decided(loss, ranges, track)]
    back = [loss for loss in due if loss.is_reacquired and loss.length_s <= ranges.reacquired_s]
    return [
        track.planned_count,
        len(distance),
        is_in_band.sum(),
        ((distance <= ranges.far_m) & track.is_in_view).sum(),
        np.square(off).sum(),
        np.degrees(np.abs(track.bearing_rad)).sum(),
        track.is_in_view.sum(),
        len(distance) * track.interval_s / 60.0,
        len(found),
        sum(loss.length_s for loss in found),
        len(due),
        len(back),
    ]


def _is_decided(loss: Loss, ranges: Ranges, track: Track) -> bool:
    """Whether it is known if the owner was found again in time: not of a loss that time was up on."""
    return loss.is_reacquired or loss.length_s > ranges.reacquired_s or not track.is_whole


def _median_of(tracks: Sequence[Track]) -> Callable[[NDArray[np.int64]], float]:
    """The median distance of all samples, from a histogram of each episode: resampling episodes must not sort again."""
    step_m = 0.01
    limit = 1 + int(max(track.distance_m.max() for track in tracks) / step_m)
    bins = [np.minimum(np.rint(track.distance_m / step_m).astype(np.int64), limit) for track in tracks]
    counts = np.array([np.bincount(column, minlength=limit + 1) for column in bins])

    def median(rows: NDArray[np.int64]) -> float:
        total = counts[rows].sum(0).cumsum()
        return float(np.searchsorted(total, 0.5 * total[-1])) * step_m

    return median


def _ratio(part: float, whole: float) -> float:
    return float(part / whole) if whole else math.nan


NAMES: dict[str, tuple[str, str]] = {
    "success": ("success (SR)", "%"),
    "tracking": ("tracking (TR)", "%"),
    "collision": ("collision (CR)", "%"),
    "in_band": ("within 1-3 m", "%"),
    "distance_rmse_m": ("distance RMSE to 2 m", "m"),
    "distance_median_m": ("median distance", "m"),
    "bearing_error_deg": ("bearing error", "deg"),
    "in_view": ("owner in view", "%"),
    "losses_per_minute": ("losses per minute", ""),
    "loss_s": ("length of a loss", "s"),
    "reacquired": ("reacquired within 5 s", "%"),
}
"""Of each figure: its name and unit; shares in per cent."""


def written(figure: Interval, unit: str) -> str:
    """A figure with its interval, as people read it: `97.1 % (95.0 to 98.4)`."""
    if math.isnan(figure.value):
        return "-"
    scale, digits = (100.0, 1) if unit == "%" else (1.0, 2)
    text = f"{scale * figure.value:.{digits}f}{' ' + unit if unit else ''}"
    if math.isnan(figure.low):
        return text
    return f"{text} ({scale * figure.low:.{digits}f} to {scale * figure.high:.{digits}f})"


def lines(card: Scorecard) -> list[tuple[str, str]]:
    """Label and text of each figure, in order."""
    return [(label, text) for _, label, text in named_lines(card)]


def named_lines(card: Scorecard) -> list[tuple[str, str, str]]:
    """Name, label and text of each figure; of a single flight without intervals, which one flight cannot have."""
    shown = []
    for name, (label, unit) in NAMES.items():
        figure = getattr(card, name)
        if card.episodes == 1:
            figure = Interval(figure.value, math.nan, math.nan)
        shown.append((name, label, written(figure, unit)))
    return shown
