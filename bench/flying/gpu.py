"""What does a GPU make of the batch, beside one core of the same machine? Without a GPU there are no rows.

Simulated vehicle seconds per second: hovering X500s with sensors and estimator and without, then decisions of the task
that the default policy is trained on. One core is timed first, then the GPU, each at the size that suits it.
"""

import time
from collections.abc import Callable

import numpy as np
import warp as wp

from bench.flying.fleet import check, hovering
from bench.learning.environments import random_actions
from bench.row import Row, best_of, require
from common.kernels import TICK_S
from common.warp_start import start_warp
from policies.tasks.catalogue import build_task, task_settings

GPU = "cuda:0"
ON_A_CORE, ON_A_GPU = 512, 16384
LAUNCH_TICKS = 25
TRACKED = {"observation": "tracked", "has_estimator": False, "owner": "any", "terrain": "kept", "stack": 3}
COMMAND = "python -m bench gpu"


def measure() -> list[Row]:
    start_warp()
    if not wp.is_cuda_available():
        return []
    name = wp.get_device(GPU).name
    rows = []
    for label, has_estimator in (("estimator and sensors on", True), ("estimator and sensors off", False)):
        core = _flown_per_s("cpu", ON_A_CORE, has_estimator=has_estimator)
        gpu = _flown_per_s(GPU, ON_A_GPU, has_estimator=has_estimator)
        rows += [
            Row(f"{ON_A_GPU:,} vehicles, {name}, {label}", gpu, "simulated s/s", "higher", None, COMMAND),
            Row(f"vehicles, {label}: {name} over one core", gpu / core, "x", "higher", None, COMMAND),
        ]
    core, gpu = _decided_per_s("cpu", 512), _decided_per_s(GPU, 4096)
    return [
        *rows,
        Row(f"FollowMe tracked, 4,096 environments, {name}", gpu, "steps/s", "higher", None, COMMAND),
        Row(f"FollowMe tracked: {name} over one core", gpu / core, "x", "higher", None, COMMAND),
    ]


def _flown_per_s(device: str, vehicles: int, *, has_estimator: bool, launches: int = 10) -> float:
    rig = hovering(vehicles, has_estimator=has_estimator, device=device)

    def advance() -> None:
        for _ in range(launches):
            rig.advance(LAUNCH_TICKS)

    rate = vehicles * launches * LAUNCH_TICKS * TICK_S / best_of(3, lambda: _wall_s(device, advance))
    check(rig, has_estimator=has_estimator)
    return rate


def _decided_per_s(device: str, envs: int, steps: int = 50) -> float:
    task = build_task("FollowMe", envs, task_settings("FollowMe", TRACKED), device)
    task.reset(0)
    continuous, _ = random_actions(task, np.random.default_rng(0))
    task.buffers.continuous.assign(continuous)

    def decide() -> None:
        for _ in range(steps):
            task.step()

    decide()
    rate = envs * steps / best_of(3, lambda: _wall_s(device, decide))
    require(np.isfinite(task.buffers.observations.numpy()).all(), "an observation is not finite")
    return rate


def _wall_s(device: str, work: Callable[[], None]) -> float:
    wp.synchronize_device(device)
    start = time.perf_counter()
    work()
    wp.synchronize_device(device)
    return time.perf_counter() - start
