"""`python -m bench.offline_story.batch training|flown POLICY…`: policies on owners who walk and who run, in batch.

Both are as near to the flights over MAVLink as a batch comes: the same densities of trees, no late images, nobody else,
and only a collision ends an episode. `training` is in worlds of training, where the policy that flies is chosen;
`flown` in worlds that nothing was chosen in. What is left apart: another simulation of camera and phone; of the guard
only its rules of the owner, not those of obstacles; and another draw of worlds and winds.
"""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import torch

from bench.follow.judge import first_episodes
from bench.follow.stages import TREES_PER_HA
from policies.learn.export.policy_file import load_policy
from policies.tasks.follow_me.follow_me import FollowMe
from policies.tasks.follow_me.follow_me_params import IMPROVED, PARAMS, SEEN_BY_TRACKER
from policies.tasks.follow_me.scorecard import scorecard
from policies.tasks.follow_me.settings import FollowSettings

OWNER_SPEEDS = {"walk": 2.0, "run": 5.0}
"""[m/s] By the name of the condition that flights are judged in."""
_NEVER = 1e6
_DRAWN = {name for name, value in (IMPROVED | SEEN_BY_TRACKER).items() if not isinstance(value, float)}
_AS_FLOWN = {param.name: param.default for param in PARAMS if param.name in _DRAWN - {"wind_m_s", "wind_gust_m_s"}}


@dataclass(frozen=True, slots=True)
class Conditions:
    """Where policies are judged."""

    split: Literal["train", "test"]
    trees_per_ha: tuple[float, ...]
    episodes: int  # of each pace and density
    numbers: Mapping[str, float]


_NUMBERS = {**_AS_FLOWN, "lost_m": _NEVER, "unseen_limit_s": _NEVER}
RUNNING = {**_NUMBERS, "trees_per_ha": TREES_PER_HA[1], "owner_speed_max": OWNER_SPEEDS["run"]}
"""Of the evaluations of a training."""
TRAINING = Conditions("train", TREES_PER_HA, 24, _NUMBERS)
FLOWN = Conditions("test", TREES_PER_HA, 72, _NUMBERS)


def judged(
    policies: Mapping[str, Path], conditions: Conditions, numbers: Mapping[str, float] | None = None
) -> dict[str, dict[str, Any]]:
    """Of each policy and pace: time in the band with its interval, collisions, mean reward of an episode.

    Args:
        policies: files, by name.
        conditions: where.
        numbers: of the task, what its rewards weigh; none: its own.
    """
    torch.set_num_threads(1)
    settings = FollowSettings.model_validate(
        {"observation": "tracked", "owner": "any", "split": conditions.split, "terrain": "fresh", "stack": 3}
    )
    task = FollowMe(settings, conditions.episodes)
    found: dict[str, dict[str, Any]] = {}
    for name, path in policies.items():
        policy, _ = load_policy(path)
        for pace, speed in OWNER_SPEEDS.items():
            tracks, returns = [], []
            for trees in conditions.trees_per_ha:
                world = {"trees_per_ha": trees, "owner_speed_max": speed}
                flown, mean_return = first_episodes(policy, task, {**(numbers or {}), **conditions.numbers, **world})
                tracks += flown
                returns.append(mean_return)
            card = scorecard(tracks)
            found.setdefault(name, {})[pace] = {
                "in_band": [card.in_band.value, card.in_band.low, card.in_band.high],
                "collision": card.collision.value,
                "mean_return": sum(returns) / len(returns),
                "episodes": len(tracks),
            }
    return found


def main(where: str, *paths: str) -> None:
    """Prints a line of each policy and pace."""
    conditions = {"training": TRAINING, "flown": FLOWN}[where]
    for name, paces in judged({path: Path(path) for path in paths}, conditions).items():
        for pace, found in paces.items():
            value, low, high = (100.0 * fraction for fraction in found["in_band"])
            ends = f"collisions {100.0 * found['collision']:.0f} %, return {found['mean_return']:.1f}"
            print(f"{name}, {pace}: in the band {value:.1f} % ({low:.1f} to {high:.1f}), {ends}")


if __name__ == "__main__":
    main(*sys.argv[1:])
