"""Policies that drive into spots or fly to goals, judged in batch under the conditions of `honeyguide benchmark`.

What is drawn there is drawn here, and what is not is as the vehicle's maker says. What is left apart: the guard, which
a batch has not, how messages age, and another draw of worlds, winds and goals; and that a companion stops by its
estimate, after which the truth may be farther off, where here the truth has to be as near: a little too strict.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from math import degrees
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.drive import LONGEST as DRIVE_LONGEST
from bench.goal_episodes import first_episodes
from bench.navigate import LONGEST as NAVIGATE_LONGEST
from bench.offline_story.story import Judged, Split, figure
from mission.benchmark.navigating import CONDITIONS as FORESTS
from mission.benchmark.parking import CONDITIONS as LOTS
from mission.benchmark.parking import WIND_MAX_M_S
from mission.park.parking import DRIVE_S
from policies.companion.skills.driving import ALIGNED_RAD, ARRIVED_M, STANDING_M_S
from policies.learn.export.policy_file import load_policy
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.drive.drive import Drive
from policies.tasks.drive.drive_kernels import MEASURES as DRIVE_MEASURES
from policies.tasks.episode import Outcome
from policies.tasks.navigate.navigate import Navigate
from policies.tasks.navigate.navigate_kernels import MEASURES as NAVIGATE_MEASURES
from policies.tasks.task_params import Sampler
from sim.world.driving_worlds import CAR_PARK

SEED = 1_000_003  # no training run is given it
EPISODES: Mapping[Split, int] = {"train": 48, "test": 96}  # of each condition; in spots nearly, half face either way
_CARTS = LOTS["park"].cart_count
_PARKED: dict[str, float | Sampler] = {
    "mass_scale": 1.0,
    "motor_scale": 1.0,
    "friction_scale": 1.0,
    "rolling_scale": 1.0,
    "wind_m_s": Sampler(intervals=((0.0, WIND_MAX_M_S),)),
    "mover_count": float(_CARTS),
    "hill_height_m": CAR_PARK.hill_height_m,
    "reach_m": ARRIVED_M,  # within these three a companion stops; who passes within the task's own bounds drives on
    "align_deg": degrees(ALIGNED_RAD),
    "stop_m_s": STANDING_M_S,
    "extra_time_s": DRIVE_S - 5.0,  # and some seconds more for the way, at a speed that nothing here has
    "slowest_m_s": 5.0,
}

Floats = NDArray[np.float64]


def judged_parking(policies: Mapping[str, Path], split: Split) -> Judged:
    """As `honeyguide benchmark park` does among carts; of all spots half are entered either way."""
    settings = {"preset": "park", "has_estimator": True, "split": split}
    task = build_task("Drive", 2 * EPISODES[split], task_settings("Drive", settings))
    if not isinstance(task, Drive):
        raise TypeError(task)
    found: Judged = {}
    for name, path in policies.items():
        task.set_params(_PARKED)
        task.reset(SEED)
        is_reverse = task.driving.outs.numpy() > 0.0
        outcomes, measures = first_episodes(load_policy(path)[0], task, DRIVE_LONGEST)
        is_there, times_s = outcomes == Outcome.SUCCESS, measures[:, DRIVE_MEASURES.index("time_s")]
        figures = {"parked": is_there, "seconds": np.where(is_there, times_s, np.nan), "collision": _hits(outcomes)}
        found[name] = {
            condition: _in_words({key: values[is_reverse == lot.is_reverse] for key, values in figures.items()})
            for condition, lot in LOTS.items()
            if lot.cart_count == _CARTS and lot.lag_s == 0.0
        }
    return found


def judged_navigating(policies: Mapping[str, Path], split: Split, conditions: Sequence[str]) -> Judged:
    """As `honeyguide benchmark navigate` does."""
    settings = {"has_estimator": True, "split": split}
    task = build_task("Navigate", EPISODES[split], task_settings("Navigate", settings))
    if not isinstance(task, Navigate):
        raise TypeError(task)
    found: Judged = {}
    for name, path in policies.items():
        for condition in conditions:
            forest = FORESTS[condition]
            task.set_params({"trees_per_ha": forest.trees_per_ha, "scan_lag_s": forest.lag_s})
            task.reset(SEED)
            outcomes, measures = first_episodes(load_policy(path)[0], task, NAVIGATE_LONGEST)
            is_there = outcomes == Outcome.SUCCESS
            way_m, time_s = (measures[:, NAVIGATE_MEASURES.index(key)] for key in ("path_m", "time_s"))
            made_good = np.where(is_there, way_m / np.maximum(time_s, 0.1), 0.0)
            figures = {"made_good": made_good, "reached": is_there, "collision": _hits(outcomes)}
            found.setdefault(name, {})[condition] = _in_words(figures)
    return found


def _hits(outcomes: NDArray[np.int32]) -> Floats:
    return np.isin(outcomes, (Outcome.HIT_OBSTACLE, Outcome.HIT_OTHER)).astype(np.float64)


def _in_words(figures: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
    """Of one condition."""
    intervals = {key: list(asdict(figure(values)).values()) for key, values in figures.items()}
    return {**intervals, "episodes": len(figures["collision"])}
