"""Which datasets both libraries learn from: tasks of continuous actions, each in three qualities.

They are what `honeyguide dataset collect` writes: an expert with little noise, the same with much, and several noises
one after the other, as a learner's replay has them. Parking1's actions are choices, which neither TD3+BC nor d3rlpy's
IQL has; Drive's parking is the nearest task that both can learn.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console

from mission.dataset.collect import collect_dataset
from mission.dataset.write_episodes import CollectOptions
from policies.datasets.editing import merge

QUALITIES: dict[str, tuple[float, ...]] = {"expert": (0.1,), "medium": (0.6,), "replay": (1.2, 0.9, 0.6, 0.3, 0.1)}
"""Deviation of the noise on actions, in parts of equal numbers of episodes."""


@dataclass(frozen=True, slots=True)
class Case:
    """A task, and who shows how it is done."""

    task: str
    pilot: str
    env_args: tuple[str, ...]
    episodes: int
    numbers: Mapping[str, float] = field(default_factory=dict)
    """Of the task, in place of its own."""


CASES = {
    "hover": Case("Hover", "expert", ("has_estimator=false",), 100),
    "follow-me": Case(
        "FollowMe",
        "follow-me-tracked",
        ("observation=tracked", "has_estimator=false", "owner=any", "terrain=kept", "stack=3"),
        60,
        {"collision_cost": 80.0, "lost_cost": 40.0, "jerk_cost": 0.2},  # else who trembles gains by losing the owner
    ),
    "navigate": Case("Navigate", "navigate", ("has_estimator=false",), 100),
    "drive-park": Case("Drive", "drive-park", ("preset=park",), 100),
}


def collected(case: Case, quality: str, folder: Path, console: Console) -> Path:
    """A dataset, made unless it is there; the quality may also be `random` or `best`, for the scale of scores."""
    out = folder / quality
    if out.exists():
        return out
    noises = QUALITIES.get(quality, (0.0,))
    pilot = "random" if quality == "random" else case.pilot
    parts = []
    for k, noise in enumerate(noises):
        part = out if len(noises) == 1 else folder / f"{quality}-{k}"
        if not part.exists():
            count = case.episodes // len(noises)
            options = CollectOptions(case.task, pilot, count, part, noise, k, case.env_args, numbers=case.numbers)
            collect_dataset(options, console)
        parts.append(part)
    if len(parts) > 1:
        merge(parts, out)
    return out
