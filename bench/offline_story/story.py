"""What each story tells: the task, who is logged and where, what is learnt by, and what is measured of flights."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import nan
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from common.intervals import Interval, bootstrap, rate

Split = Literal["train", "test"]
Judged = dict[str, dict[str, dict[str, Any]]]
"""By policy and condition: [value, low, high] of each measure."""


def figure(values: Sequence[float] | NDArray[Any]) -> Interval:
    """The mean of those that are numbers; where it is of yes and no, with a fraction's interval."""
    found = np.asarray(values, dtype=np.float64)
    found = found[np.isfinite(found)]
    if np.isin(found, (0.0, 1.0)).all():
        return rate(found == 1.0)
    return bootstrap(len(found), lambda rows: float(found[rows].mean()))


@dataclass(frozen=True, slots=True)
class Measure:
    """A figure of the flights of a condition: the mean over those that have it."""

    key: str
    title: str
    unit: Literal["%", "m/s", "s"]
    of: Callable[[Mapping[str, Any]], float]
    """Of a flight's outcome, as `honeyguide benchmark` writes it; NaN: it has none."""


@dataclass(frozen=True, slots=True)
class Story:
    """Of one task; the pilots are `clumsy` and `shipped` everywhere."""

    task: str
    benchmark: str
    """What `honeyguide benchmark` judges."""
    pilots: Mapping[str, str]
    """Who is logged, as the benchmark takes them: a mediocre pilot, and the policy that ships."""
    sizes: Mapping[str, int]
    """Flights of each pilot, and judged flights of each condition."""
    steps: int
    """Gradient steps of each training."""
    forecast_steps: int
    """Of fitted Q evaluation."""
    env_args: tuple[str, ...]
    gamma: float
    seeds: Mapping[str, int]
    """First of each pilot's logged flights, even, where the benchmark records them; and `flown`, odd."""
    recorded: tuple[str, ...]
    """Conditions that the benchmark records; none: `bench.offline_story.logging` flies in a world of its own."""
    conditions: tuple[str, ...]
    """In which is judged, in batch and over MAVLink."""
    measures: tuple[Measure, ...]
    """The first is what the policy that flies is chosen by: more is better."""
    is_hit: Callable[[Mapping[str, Any]], bool]
    """Whether a flight touched anything."""
    judge: Callable[[Mapping[str, Path], Split], Judged]
    """Policies in batch, as near to the flights as a batch comes, in worlds of training or in held-out ones."""
    page: str
    """The page's name in docs/results, its images' too."""
    iql: Mapping[str, float] = field(default_factory=lambda: {"expectile": 0.8, "inverse_temperature": 3.0})
    """Its weights are exponents of advantages, so that the inverse temperature is as small as rewards are great."""
    evaluations: int = 10
    """Of a training; the policy that returned most in one of them is used."""
    titles: tuple[str, str] = ("flights", "policy that ships")
    numbers: Mapping[str, float] | None = None
    """What rewards weigh; None: as the task does."""
    evaluated: Callable[[], Mapping[str, float]] = dict
    """Numbers of a training's evaluations besides; where there are none, in the conditions that policies train in."""

    @property
    def pilot_titles(self) -> dict[str, str]:
        """Of those that fly, in the order of tables."""
        return {
            "clumsy": "mediocre pilot",
            "medium": "learnt from the mediocre pilot alone",
            "offline": "learnt from both",
            "shipped": self.titles[1],
        }


def _judge_following(policies: Mapping[str, Path], split: Split) -> Judged:
    from bench.offline_story.batch import FLOWN, TRAINING, judged

    return judged(policies, TRAINING if split == "train" else FLOWN, FOLLOW_NUMBERS)


def _behind_runners() -> Mapping[str, float]:
    from bench.offline_story.batch import RUNNING

    return RUNNING


def _judge_parking(policies: Mapping[str, Path], split: Split) -> Judged:
    from bench.offline_story.goal_batch import judged_parking

    return judged_parking(policies, split)


def _judge_navigating(policies: Mapping[str, Path], split: Split) -> Judged:
    from bench.offline_story.goal_batch import judged_navigating

    return judged_navigating(policies, split, STORIES["navigate"].conditions)


FOLLOW_NUMBERS = {"collision_cost": 80.0, "lost_cost": 40.0, "jerk_cost": 0.2}
"""Costs by which nothing is dearer than to lose the owner: with the task's own, whoever trembles pays less the sooner
they are lost. The first two are those of policies/recipes/follow-me-tracked.yaml; by its jerk cost the mediocre pilot
would pay for hardly anything but jerks."""

STORIES = {
    "follow": Story(
        task="FollowMe",
        benchmark="follow",
        pilots={"clumsy": "bench.offline_story.pilots:Clumsy", "shipped": "follow-me-tracked"},
        sizes={"clumsy": 48, "shipped": 24, "flown": 12},
        steps=20_000,
        forecast_steps=5000,
        env_args=("observation=tracked", "has_estimator=false", "owner=any", "terrain=kept", "stack=3"),
        numbers=FOLLOW_NUMBERS,
        evaluated=_behind_runners,
        gamma=0.97,
        iql={"expectile": 0.99, "inverse_temperature": 20.0},  # hundredths are paid for being nearer
        seeds={"flown": 3_936_001},
        recorded=(),
        conditions=("walk", "run"),
        measures=(Measure("in_band", "within 1 to 3 m", "%", lambda flight: float(flight["in_band"])),),
        is_hit=lambda flight: bool(flight["is_collided"]),
        judge=_judge_following,
        page="offline",
        titles=("flights", "follower that ships"),
    ),
    "park": Story(
        task="Drive",
        benchmark="park",
        pilots={"clumsy": "bench.offline_story.pilots:ClumsyDriver", "shipped": "drive-park"},
        sizes={"clumsy": 120, "shipped": 120, "flown": 60},
        steps=10_000,
        forecast_steps=2000,
        env_args=("preset=park", "has_estimator=false"),
        gamma=0.99,
        seeds={"clumsy": 3_911_000, "shipped": 3_911_240, "flown": 3_937_001},
        recorded=("park", "reverse", "calm"),
        conditions=("park", "reverse"),
        measures=(
            Measure("parked", "parked", "%", lambda drive: float(drive["outcome"] == "there")),
            Measure("seconds", "time to the spot", "s", lambda drive: _if_there(drive, drive["seconds"])),
        ),
        is_hit=lambda drive: bool(drive["outcome"] == "touched"),
        judge=_judge_parking,
        iql={"expectile": 0.8, "inverse_temperature": 0.3},  # twenty are paid for arriving
        page="offline-parking",
        titles=("drives", "policy that ships"),
    ),
    "navigate": Story(
        task="Navigate",
        benchmark="navigate",
        pilots={"clumsy": "bench.offline_story.pilots:ClumsyNavigator", "shipped": "navigate"},
        sizes={"clumsy": 240, "shipped": 120, "flown": 24},
        steps=10_000,
        forecast_steps=2000,
        env_args=("has_estimator=false",),
        gamma=0.97,
        seeds={"clumsy": 3_920_000, "shipped": 3_920_480, "flown": 3_921_001},
        recorded=("200-late-100", "400-late-100", "600-late-100"),
        conditions=("400-late-100", "600-late-100"),
        measures=(
            Measure(
                "made_good",
                "speed, 0 where not reached",
                "m/s",
                lambda flight: float(flight["speed_m_s"]) if flight["outcome"] == "arrived" else 0.0,
            ),
            Measure("reached", "reached", "%", lambda flight: float(flight["outcome"] == "arrived")),
        ),
        is_hit=lambda flight: bool(flight["outcome"] == "collision"),
        judge=_judge_navigating,
        evaluations=20,
        page="offline-navigate",
    ),
}
"""By the name of the benchmark's task."""


def _if_there(drive: Mapping[str, Any], seconds: float) -> float:
    return float(seconds) if drive["outcome"] == "there" else nan
