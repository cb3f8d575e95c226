"""`python -m bench.follow.conditions POLICY…`: policies without images in harder conditions, judged in batch.

In: policy files of FollowMe with `observation=tracked`. Out: how long they stay in the band, and how smoothly, in
worlds of the test split, without a guard; sights are drawn from the model that training has. What a policy comes to
in flight only `honeyguide benchmark follow` tells: this takes a minute a policy, that an hour.
"""

from pathlib import Path
from typing import Annotated

import numpy as np
import torch
import typer
from rich.console import Console
from rich.table import Table

from mission.follow.benchmark.conditions import BY_NAME, Condition
from policies.learn.export.policy_file import load_policy
from policies.learn.networks.policy import Policy
from policies.learn.rollout.task_tensors import TaskTensors
from policies.tasks.follow_me.follow_me import FollowMe
from policies.tasks.follow_me.follow_me_params import FOLLOW_PARAMS, SEEN_BY_TRACKER
from policies.tasks.follow_me.settings import FollowSettings
from sim.world.people import RUN_SPEED_M_S, WALK_SPEED_M_S

EPISODES = 96
DECISIONS = 600
SEED = 1_000_003  # no training run is given it
_COSTS = ("_cost", "_reward", "_width_m", "_width_deg")
_USUAL = {n.name: n.default for n in FOLLOW_PARAMS if n.name in SEEN_BY_TRACKER and not n.name.endswith(_COSTS)}
_AIR = {"wind_m_s": 4.0, "wind_gust_m_s": 1.5, "trees_per_ha": 100.0}


def main(
    policies: list[Path],
    condition: Annotated[list[str] | None, typer.Option(help="Default: all without hiding.")] = None,
) -> None:
    names = condition or [name for name in BY_NAME if not name.startswith("gone")]
    table = Table("policy", "condition", "in band", "collided", "accel m/s²", "yaw rate deg/s")
    for path in policies:
        policy, _ = load_policy(path)
        stack = policy.layout.stack
        task = FollowMe(FollowSettings(observation="tracked", owner="any", split="test", stack=stack), EPISODES)
        for name in names:
            band, collided, accel, yaw_rate = judged(policy, task, BY_NAME[name])
            table.add_row(str(path), name, f"{band:.1%}", f"{collided:.1%}", f"{accel:.2f}", f"{yaw_rate:.0f}")
    Console().print(table)


def judged(policy: Policy, task: FollowMe, condition: Condition) -> tuple[float, float, float, float]:
    """In band [1], episodes with a collision [1], acceleration [m/s²] and yaw rate [deg/s], RMS; of first episodes."""
    speed_m_s = WALK_SPEED_M_S if condition.pace == "walk" else RUN_SPEED_M_S
    task.set_params({**_USUAL, **_AIR, "owner_speed_max": speed_m_s, **condition.numbers})
    task.reset(SEED)
    tensors, memory = TaskTensors(task), policy.start_memory(task.env_count)
    is_on = np.ones(task.env_count, dtype=bool)
    on, measures, velocities, yaw_rates = [], [], [], []
    with torch.inference_mode():
        for _ in range(DECISIONS):
            actions, memory = policy.act(tensors.observation, memory)
            tensors.step(policy.bounded(actions), actions.branches)
            truth = task.rig.arrays.truth.numpy()
            measures.append(task.measures.numpy().copy())
            velocities.append(truth["vel_ned"][:, :2].copy())
            yaw_rates.append(truth["omega_frd"][:, 2].copy())
            on.append(is_on.copy())
            is_on &= ~(tensors.is_terminated | tensors.is_truncated).numpy()
    flown = np.array(on)
    collided, in_band = (np.array(measures)[:, :, k] * flown > 0.5 for k in (3, 4))
    accel = np.linalg.norm(np.diff(np.array(velocities), axis=0), axis=2) / task.decision_s
    both = flown[1:] & flown[:-1]
    return (
        float(in_band.mean()),
        float(collided.any(axis=0).mean()),
        float(np.sqrt(np.mean(accel[both] ** 2))),
        float(np.degrees(np.sqrt(np.mean(np.array(yaw_rates)[flown] ** 2)))),
    )


if __name__ == "__main__":
    typer.run(main)
