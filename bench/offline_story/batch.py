"""`python -m bench.offline_story.batch SPLIT POLICY…`: policies on owners who walk and who run, in batch.

SPLIT is `train`, where a policy may be chosen, or `test`: worlds that nothing was chosen in.

What flies over MAVLink has a guard and another simulation of camera and phone; in batch a policy is alone. This shows
how far the two are apart, and how the policies of a story stand beside each other, whatever was forecast.
"""

import sys
from pathlib import Path
from typing import Any

import torch

from bench.follow.judge import first_episodes
from bench.follow.stages import Cell
from policies.learn.export.policy_file import load_policy
from policies.tasks.follow_me.follow_me import FollowMe
from policies.tasks.follow_me.scorecard import scorecard
from policies.tasks.follow_me.settings import FollowSettings

CELLS = {"walk": Cell(100.0, 2.0), "run": Cell(100.0, 5.0)}
"""By the name of the condition that flights are judged in."""
EPISODES = 32  # of each condition


def judged(policies: dict[str, Path], split: str) -> dict[str, dict[str, Any]]:
    """Of each policy and condition: time in the band with its interval, collisions, mean reward of an episode."""
    torch.set_num_threads(1)
    settings = FollowSettings.model_validate(
        {"observation": "tracked", "owner": "any", "split": split, "terrain": "fresh", "stack": 3}
    )
    task = FollowMe(settings, EPISODES)
    found: dict[str, dict[str, Any]] = {}
    for name, path in policies.items():
        policy, _ = load_policy(path)
        for condition, cell in CELLS.items():
            numbers = {"trees_per_ha": cell.trees_per_ha, "owner_speed_max": cell.owner_speed_max}
            tracks, mean_return = first_episodes(policy, task, numbers)
            card = scorecard(tracks)
            band = card.in_band
            found.setdefault(name, {})[condition] = {
                "in_band": [band.value, band.low, band.high],
                "collision": card.collision.value,
                "mean_return": mean_return,
            }
    return found


def main(split: str, *paths: str) -> None:
    """Prints a line of each policy and condition."""
    for name, conditions in judged({path: Path(path) for path in paths}, split).items():
        for condition, found in conditions.items():
            value, low, high = (100.0 * share for share in found["in_band"])
            ends = f"collisions {100.0 * found['collision']:.0f} %, return {found['mean_return']:.1f}"
            print(f"{name}, {condition}: in the band {value:.1f} % ({low:.1f} to {high:.1f}), {ends}")


if __name__ == "__main__":
    main(*sys.argv[1:])
