"""How many decisions do the learning tasks step per second of one core, alone and through Gymnasium?

Random actions, drawn before the clock starts; episodes end and begin as they come. "Through Gymnasium" is the same
task, one environment, stepped in a Python loop, as a trainer without batches would.
"""

import time
from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np

import policies  # noqa: F401  (registers the tasks)
from bench.row import Row, best_of, require
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.task import Task

ENVS = 4096
STEPS = 200
ACTION_SETS = 16
GYMNASIUM_STEPS = 2000
COMMAND = "python -m bench environments"

TASKS: dict[str, tuple[str, dict[str, Any], float | None]] = {
    "RollerBall": ("RollerBall", {}, None),
    "ReachTarget": ("ReachTarget", {"variant": 3}, None),
    "Parking1, as coded": ("Parking1", {"preset": "as-coded"}, 1e6),
    "Parking2, 29 rays": ("Parking2", {"preset": "as-documented"}, 3e5),
}


def measure() -> list[Row]:
    rows = []
    for label, (name, settings, target) in TASKS.items():
        rate = _batch_rate(name, settings)
        one = _gymnasium_rate(name, settings)
        rows += [
            Row(f"{label}: {ENVS:,} environments, one core", rate, "steps/s", "higher", target, COMMAND),
            Row(f"{label}: one environment through Gymnasium", one, "steps/s", "higher", None, COMMAND),
            Row(f"{label}: batch over Gymnasium", rate / one, "x", "higher", None, COMMAND),
        ]
    return rows


def random_actions(task: Task, rng: np.random.Generator) -> tuple[Any, Any]:
    """Continuous and discrete actions for all environments."""
    continuous = rng.uniform(-1.0, 1.0, task.buffers.continuous.shape).astype(np.float32)
    sizes = task.layout.branch_sizes
    branches = rng.integers(sizes, size=(task.env_count, len(sizes))) if sizes else np.zeros((task.env_count, 0))
    return continuous, branches.astype(np.int32)


def _batch_rate(name: str, settings: Mapping[str, Any]) -> float:
    task = build_task(name, ENVS, task_settings(name, settings))
    task.reset(0)
    rng = np.random.default_rng(0)
    sets = [random_actions(task, rng) for _ in range(ACTION_SETS)]
    continuous, branches = task.buffers.continuous.numpy(), task.buffers.branches.numpy()

    def cpu_s() -> float:
        start = time.process_time()
        for k in range(STEPS):
            continuous[:], branches[:] = sets[k % ACTION_SETS]
            task.step()
        return time.process_time() - start

    rate = ENVS * STEPS / best_of(5, cpu_s)
    require(np.isfinite(task.buffers.observations.numpy()).all(), f"{name}: an observation is not finite")
    require(task.take_scores().episode_count > 0, f"{name}: no episode ended")
    return rate


def _gymnasium_rate(name: str, settings: Mapping[str, Any]) -> float:
    env = gymnasium.make(f"honeyguide/{name}-v0", **settings)
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(ACTION_SETS)]

    def cpu_s() -> float:
        env.reset(seed=0)
        start = time.process_time()
        for k in range(GYMNASIUM_STEPS):
            _, _, is_terminated, is_truncated, _ = env.step(actions[k % ACTION_SETS])
            if is_terminated or is_truncated:
                env.reset()
        return time.process_time() - start

    return GYMNASIUM_STEPS / best_of(3, cpu_s)
