"""How a policy followed, as checks ask it."""

from collections.abc import Iterator, Mapping
from math import nan

import numpy as np

from mission.scenario.parts.checks import Following, Range
from mission.scenario.result import CheckResult
from policies.tasks.follow_me.scorecard import scorecard
from policies.tasks.follow_me.track import Ranges, Track


def following_figures(track: Track, asked: Following) -> Iterator[CheckResult]:
    """A result for each figure that is asked for."""
    ranges = Ranges()
    distance = track.distance_m
    is_in_band = (distance >= ranges.near_m) & (distance <= ranges.far_m)
    for name, wanted, fraction in (
        ("in band", asked.in_band_min, float(is_in_band.sum() / track.planned_count)),
        ("in view", asked.in_view_min, float(track.is_in_view.sum() / track.planned_count)),
    ):
        if wanted is not None:
            margin = fraction - wanted
            yield CheckResult(name, margin >= 0.0, f"{name} {wanted:.0%} of the time", f"{fraction:.1%}", margin)
    nearest, farthest = int(np.argmin(distance)), int(np.argmax(distance))
    for name, wanted, at, sign in (
        ("nearest", asked.distance_min_m, nearest, 1.0),
        ("farthest", asked.distance_max_m, farthest, -1.0),
    ):
        if wanted is not None:
            margin, bound = sign * (float(distance[at]) - wanted), "at least" if sign > 0.0 else "at most"
            happened = f"{distance[at]:.2f} m, {track.time_s[at]:.1f} s after it began"
            yield CheckResult(name, margin >= 0.0, f"{bound} {wanted:g} m from the owner", happened, margin, "m")
    if asked.has_collision is not None:
        found = bool(track.is_collided.any())
        worst = float(track.time_s[int(np.argmax(track.is_collided))]) if found else nan
        happened = f"a collision {worst:.1f} s after it began" if found else "no collision"
        wanted_text = "a collision" if asked.has_collision else "no collision"
        yield CheckResult("collision", found == asked.has_collision, wanted_text, happened)


def scorecard_figures(track: Track, asked: Mapping[str, Range]) -> Iterator[CheckResult]:
    """A result for each bound of each figure; one that there is nothing for fails."""
    card = scorecard([track])
    for name, bounds in asked.items():
        value = getattr(card, name).value
        title = name.replace("_", " ")
        for word, bound, sign in (("at least", bounds.min, 1.0), ("at most", bounds.max, -1.0)):
            if bound is not None:
                margin = sign * (value - bound)
                yield CheckResult(title, margin >= 0.0, f"{title} {word} {bound:g}", f"{value:.3g}", margin)
