"""The way of a batch's pictures to their policies: each late by its own delay, lost, or stuck for a while.

In: the picture of each decision, packed. Out: the newest that has come, in `buffers.images`, and how old it is. Flights
do the same with whole pictures (mission/follow/late_camera.py).
"""

from collections.abc import Callable
from typing import Any

import warp as wp

from common.rng import draw_key
from policies.tasks.follow_me.follow_me_params import FollowParams

wp.set_module_options({"enable_backward": False})

_KEPT = wp.constant(10)  # pictures on their way: more than the longest delay
_DECISION_S = wp.constant(0.1)
_DELAY_STREAM = wp.constant(12)
_LOSS_STREAM = wp.constant(13)
_FREEZE_STREAM = wp.constant(14)
_FREEZE_S = wp.constant(wp.vec2(0.4, 1.2))  # guess


@wp.struct
class Way:
    """Of all rows."""

    count: wp.array(dtype=int)  # pictures taken since the episode began
    due: wp.array2d(dtype=int)  # the count at which each kept one comes; -1: never
    shown: wp.array(dtype=int)  # which of them was shown last, by its number
    age_s: wp.array(dtype=float)  # of the picture that is shown
    kept: wp.array4d(dtype=wp.uint8)  # (envs, kept x height, width, channels)


@wp.func
def delay_s(n: FollowParams, seed: int, i: int, k: int) -> float:
    """Of picture k of a row, counted from the episode's start; below 0: it never comes."""
    if wp.randf(draw_key(seed, i, k, _LOSS_STREAM)) < n.image_loss:
        return -1.0
    if n.image_freezes_per_min > 0.0:
        span_s = 60.0 / n.image_freezes_per_min
        since_s = _DECISION_S * float(k)
        span = int(since_s / span_s)
        state = draw_key(seed, i, span, _FREEZE_STREAM)
        length_s = _FREEZE_S[0] + (_FREEZE_S[1] - _FREEZE_S[0]) * wp.randf(state)
        begin_s = span_s * float(span) + wp.max(span_s - length_s, 0.0) * wp.randf(state)
        if since_s >= begin_s and since_s < begin_s + length_s:
            return -1.0
    return n.image_lag_s + n.image_jitter_s * wp.randf(draw_key(seed, i, k, _DELAY_STREAM))


@wp.kernel(enable_backward=False)
def delay_rows(params: wp.array(dtype=FollowParams), seed: int, k: int, out: wp.array(dtype=float)) -> None:
    """The delay of picture k of every row: for flights, which have one."""
    i = wp.tid()
    out[i] = delay_s(params[i], seed, i, k)


@wp.kernel(enable_backward=False)
def note(
    params: wp.array(dtype=FollowParams),
    seeds: wp.array(dtype=int),
    is_first: int,
    rows: wp.array(dtype=wp.bool),
    way: Way,
) -> None:
    """Says when each new picture comes, and which one is the newest that has; `is_first`: an episode begins."""
    i = wp.tid()
    if not rows[i]:
        return
    if is_first == 1:
        way.count[i] = 0
        way.shown[i] = 0
        for slot in range(_KEPT):
            way.due[i, slot] = -1
    k = way.count[i]
    late_s = delay_s(params[i], seeds[i], i, k)
    due = int(-1)
    if late_s >= 0.0:
        due = k + wp.min(int(wp.round(late_s / _DECISION_S)), _KEPT - 2)
    if k == 0:
        due = 0  # who takes over has seen something
    way.due[i, k % _KEPT] = due
    shown = way.shown[i]
    for back in range(_KEPT):
        earlier = k - back
        if earlier > shown and way.due[i, earlier % _KEPT] >= 0 and way.due[i, earlier % _KEPT] <= k:
            shown = earlier
    way.shown[i] = shown
    way.age_s[i] = _DECISION_S * float(k - shown)
    way.count[i] = k + 1


@wp.kernel(enable_backward=False)
def carry(
    rows: wp.array(dtype=wp.bool),
    way: Way,
    fresh: wp.array4d(dtype=wp.uint8),
    images: wp.array4d(dtype=wp.uint8),
) -> None:
    """Keeps the new pictures, and shows those that have come. One thread per row of pixels."""
    i, y = wp.tid()
    if not rows[i]:
        return
    newest = way.count[i] - 1
    shown = way.shown[i]
    height = fresh.shape[1]
    for x in range(fresh.shape[2]):
        for c in range(fresh.shape[3]):
            level = fresh[i, y, x, c]
            if newest == 0:
                for slot in range(_KEPT):  # nothing is left of the episode before
                    way.kept[i, slot * height + y, x, c] = level
            way.kept[i, (newest % _KEPT) * height + y, x, c] = level
            if shown == newest:
                images[i, y, x, c] = level
            elif newest - shown < _KEPT:
                images[i, y, x, c] = way.kept[i, (shown % _KEPT) * height + y, x, c]


def make_way(zeros: Callable[[str, Any, Any], Any], image_shape: tuple[int, ...], count: int) -> Any:
    """The arrays, of so many rows.

    Args:
        zeros: makes an array of the task's state by its name, shape and type.
        image_shape: (height, width, channels).
        count: of rows.
    """
    kept = int(_KEPT)
    way = Way()
    way.count = zeros("image_counts", count, int)
    way.due = zeros("images_due", (count, kept), int)
    way.shown = zeros("images_shown", count, int)
    way.age_s = zeros("image_ages", count, float)
    way.kept = zeros("images_kept", (count, kept * image_shape[0], *image_shape[1:]), wp.uint8)
    return way
