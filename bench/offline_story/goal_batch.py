"""Policies that drive into spots or fly to goals, judged in batch under the conditions of `honeyguide benchmark`.

What is drawn there is drawn here, and what is not is as the vehicle's maker says. What is left apart: the guard, which
a batch has not, how messages age, and another draw of worlds, winds and goals.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.drive import LONGEST as DRIVE_LONGEST
from bench.goal_episodes import first_episodes
from bench.navigate import LONGEST as NAVIGATE_LONGEST
from bench.offline_story.story import Judged, Split, figure
from mission.benchmark.navigating import CONDITIONS as FORESTS
from mission.benchmark.parking import CONDITIONS as LOTS
from policies.learn.export.policy_file import load_policy
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.drive.drive import Drive
from policies.tasks.drive.drive_kernels import MEASURES as DRIVE_MEASURES
from policies.tasks.episode import Outcome
from policies.tasks.navigate.navigate import Navigate
from policies.tasks.navigate.navigate_kernels import MEASURES as NAVIGATE_MEASURES
from policies.tasks.task_params import Sampler

SEED = 1_000_003  # no training run is given it
EPISODES: Mapping[Split, int] = {"train": 64, "test": 192}  # of each condition, nearly: of spots half face either way
_SAME_VEHICLE = {"mass_scale": 1.0, "motor_scale": 1.0}
_PARKED: dict[str, float | Sampler] = {
    **_SAME_VEHICLE,
    "friction_scale": 1.0,
    "rolling_scale": 1.0,
    "wind_m_s": Sampler(intervals=((0.0, 6.0),)),
    "extra_time_s": 115.0,  # the benchmark's two minutes
    "slowest_m_s": 5.0,
}

Floats = NDArray[np.float64]


def judged_parking(
    policies: Mapping[str, Path], split: Split, conditions: Sequence[str] = ("park", "reverse")
) -> Judged:
    """As `honeyguide benchmark park` does, for each way that the nose can show."""
    settings = {"preset": "park", "has_estimator": True, "split": split}
    task = build_task("Drive", 2 * EPISODES[split], task_settings("Drive", settings))
    if not isinstance(task, Drive):
        raise TypeError(task)

    def played(condition: str, path: Path) -> dict[str, Floats]:
        lot = LOTS[condition]
        task.set_params({**_PARKED, "mover_count": float(lot.cart_count)})
        task.reset(SEED)
        is_asked = (task.driving.outs.numpy() > 0.0) == lot.is_reverse
        outcomes, measures = first_episodes(load_policy(path)[0], task, DRIVE_LONGEST)
        is_there = outcomes[is_asked] == Outcome.SUCCESS
        times_s = measures[is_asked, DRIVE_MEASURES.index("time_s")]
        return {"parked": is_there, "seconds": np.where(is_there, times_s, np.nan), **_hits(outcomes[is_asked])}

    return _judged(policies, conditions, played)


def judged_navigating(
    policies: Mapping[str, Path], split: Split, conditions: Sequence[str] = ("400-late-100", "600-late-100")
) -> Judged:
    """As `honeyguide benchmark navigate` does."""
    settings = {"has_estimator": True, "split": split}
    task = build_task("Navigate", EPISODES[split], task_settings("Navigate", settings))
    if not isinstance(task, Navigate):
        raise TypeError(task)

    def played(condition: str, path: Path) -> dict[str, Floats]:
        forest = FORESTS[condition]
        task.set_params({"trees_per_ha": forest.trees_per_ha, "scan_lag_s": forest.lag_s})
        task.reset(SEED)
        outcomes, measures = first_episodes(load_policy(path)[0], task, NAVIGATE_LONGEST)
        is_there = outcomes == Outcome.SUCCESS
        way_m, time_s = (measures[:, NAVIGATE_MEASURES.index(name)] for name in ("path_m", "time_s"))
        speed = way_m / np.maximum(time_s, 0.1)
        return {"made_good": np.where(is_there, speed, 0.0), "reached": is_there, **_hits(outcomes)}

    return _judged(policies, conditions, played)


def _hits(outcomes: NDArray[np.int32]) -> dict[str, Floats]:
    return {"collision": np.isin(outcomes, (Outcome.HIT_OBSTACLE, Outcome.HIT_OTHER)).astype(np.float64)}


def _judged(
    policies: Mapping[str, Path], conditions: Sequence[str], played: Callable[[str, Path], dict[str, Floats]]
) -> Judged:
    found: Judged = {}
    for name, path in policies.items():
        for condition in conditions:
            figures = played(condition, path)
            words = {key: list(asdict(figure(values)).values()) for key, values in figures.items()}
            found.setdefault(name, {})[condition] = {**words, "episodes": len(figures["collision"])}
    return found
