"""How a policy followed, as checks ask it: figures of what was sampled, each with its worst moment where there is one.

In: a track, and the simulated time of each of its samples. Out: a result for each bound.
"""

from collections.abc import Iterator, Mapping
from math import nan
from typing import Any

import numpy as np
import numpy.typing as npt

from mission.scenario.parts.checks import FigureName, Following, Range
from mission.scenario.result import CheckResult
from policies.tasks.follow_me.scorecard import scorecard
from policies.tasks.follow_me.track import Ranges, Track, spans

Rows = npt.NDArray[Any]


def following_figures(track: Track, time_s: Rows, asked: Following) -> Iterator[CheckResult]:
    """A result for each figure that is asked for."""
    moments = Moments(track, time_s)
    distance = track.distance_m
    for name, wanted, is_so, worst_s in (
        ("in band", asked.in_band_min, moments.is_in_band, moments.off_band_s),
        ("in view", asked.in_view_min, track.is_in_view, moments.hidden_s),
    ):
        if wanted is not None:
            fraction = float(is_so.sum() / track.planned_count)
            margin = fraction - wanted
            text = f"{name} {wanted:.0%} of the time"
            yield CheckResult(name, margin >= 0.0, text, f"{fraction:.1%}", margin, worst_s=worst_s)
    nearest, farthest = int(np.argmin(distance)), int(np.argmax(distance))
    for name, wanted, at, sign in (
        ("nearest", asked.distance_min_m, nearest, 1.0),
        ("farthest", asked.distance_max_m, farthest, -1.0),
    ):
        if wanted is not None:
            margin, bound = sign * (float(distance[at]) - wanted), "at least" if sign > 0.0 else "at most"
            text, worst_s = f"{bound} {wanted:g} m from the owner", float(time_s[at])
            happened = f"{distance[at]:.2f} m at {worst_s:.1f} s"
            yield CheckResult(name, margin >= 0.0, text, happened, margin, "m", worst_s)
    if asked.has_collision is not None:
        found, worst_s = bool(track.is_collided.any()), moments.first_s(track.is_collided)
        happened = f"a collision at {worst_s:.1f} s" if found else "no collision"
        wanted_text = "a collision" if asked.has_collision else "no collision"
        yield CheckResult("collision", found == asked.has_collision, wanted_text, happened, worst_s=worst_s)


def scorecard_figures(track: Track, time_s: Rows, asked: Mapping[FigureName, Range]) -> Iterator[CheckResult]:
    """A result for each bound of each figure; one that there is nothing for fails."""
    card, moments = scorecard([track]), Moments(track, time_s)
    for name, bounds in asked.items():
        value = getattr(card, name).value
        title = name.replace("_", " ")
        for word, bound, sign in (("at least", bounds.min, 1.0), ("at most", bounds.max, -1.0)):
            if bound is not None:
                margin, worst_s = sign * (value - bound), moments.worst_s(name, is_least=sign > 0.0)
                text = f"{title} {word} {bound:g}"
                yield CheckResult(title, margin >= 0.0, text, f"{value:.3g}", margin, worst_s=worst_s)


class Moments:
    """When following was at its worst; NaN where it never was bad.

    Args:
        track: what was followed.
        time_s: simulated time of each of its samples.
    """

    def __init__(self, track: Track, time_s: Rows) -> None:
        self._track, self._time_s, self._ranges = track, time_s, Ranges()
        near_m, far_m = self._ranges.near_m, self._ranges.far_m
        distance = track.distance_m
        self._off_m = np.maximum(near_m - distance, distance - far_m)
        self._off_middle_m = np.abs(distance - 0.5 * (near_m + far_m))
        self._is_hit = track.is_collided | (distance < self._ranges.collision_m)

    @property
    def is_in_band(self) -> Rows:
        found: Rows = self._off_m <= 0.0
        return found

    @property
    def off_band_s(self) -> float:
        """When it was farthest off the band."""
        return self._cut_short_s if self.is_in_band.all() else float(self._time_s[int(np.argmax(self._off_m))])

    @property
    def hidden_s(self) -> float:
        """When it lost sight of the owner for longest."""
        return self._longest_s(~self._track.is_in_view)

    def first_s(self, is_so: Rows) -> float:
        """When something first was so."""
        return float(self._time_s[int(np.argmax(is_so))]) if is_so.any() else nan

    def worst_s(self, name: FigureName, *, is_least: bool) -> float:
        """Of a figure of the scorecard that is asked to be at least, or at most, something."""
        track, ranges = self._track, self._ranges
        sampled = {
            "distance_rmse_m": self._off_middle_m,
            "distance_median_m": track.distance_m,
            "bearing_error_deg": np.abs(track.bearing_rad),
        }
        if name in sampled:
            return float(self._time_s[int((np.argmin if is_least else np.argmax)(sampled[name]))])
        if name == "collision":
            return self.first_s(self._is_hit)
        is_better_high = name not in ("losses_per_minute", "loss_s")
        if is_better_high != is_least:  # asked to be no better than it is: no moment is to blame
            return nan
        if name == "success":
            is_there = self.is_in_band[-1] and track.is_in_view[-1] and track.is_whole
            return self.first_s(self._is_hit) if self._is_hit.any() or is_there else float(self._time_s[-1])
        if name == "in_band":
            return self.off_band_s
        if name == "in_view":
            return self.hidden_s
        off_m = ranges.far_m if name == "tracking" else ranges.lost_m
        return self._longest_s(~track.is_in_view | (track.distance_m > off_m))

    def _longest_s(self, is_so: Rows) -> float:
        """When the longest time began in which something was so."""
        found = spans(is_so)
        if not found:
            return self._cut_short_s
        return float(self._time_s[max(found, key=lambda span: span[1] - span[0])[0]])

    @property
    def _cut_short_s(self) -> float:
        """When it ended, if that was too early: what was planned after it does not count as followed."""
        return nan if self._track.is_whole else float(self._time_s[-1])
