"""The table of the benchmark: a row per condition, with 95 % intervals."""

from collections.abc import Sequence
from math import isnan

import numpy as np

from common.intervals import Interval, bootstrap, rate
from mission.follow.benchmark.conditions import Condition
from mission.follow.benchmark.flights import Outcome
from policies.tasks.follow_me.scorecard import written

COLUMNS = (
    "condition", "flights", "in band", "no collision", "kept", "nearest", "stood", "resumed", "changed / min",
    "accel", "yaw rate",
)  # fmt: skip


def row(condition: Condition, outcomes: Sequence[Outcome]) -> tuple[str, ...]:
    """The figures of a condition, as people read them."""
    band = np.array([outcome.in_band for outcome in outcomes])
    hidden_m = [o.nearest_hidden_m for o in outcomes if not isnan(o.nearest_hidden_m)]
    nearest_m = min(hidden_m) if hidden_m else min(outcome.nearest_m for outcome in outcomes)
    return (
        condition.title,
        str(len(outcomes)),
        written(bootstrap(len(band), lambda rows: float(band[rows].mean())), "%"),
        written(rate(np.array([not outcome.is_collided for outcome in outcomes])), "%"),
        written(_fraction([outcome.is_kept for outcome in outcomes]), "%"),
        f"{nearest_m:.2f} m",
        written(_fraction([outcome.has_stood for outcome in outcomes]), "%"),
        written(_fraction([outcome.has_resumed for outcome in outcomes]), "%"),
        f"{np.mean([outcome.interventions_per_min for outcome in outcomes]):.0f}",
        f"{np.mean([outcome.accel_rms for outcome in outcomes]):.2f} m/s²",
        f"{np.mean([outcome.yaw_rate_rms for outcome in outcomes]):.0f} deg/s",
    )


def _fraction(truths: Sequence[bool | None]) -> Interval:
    return rate(np.array([truth for truth in truths if truth is not None], dtype=np.bool_))
