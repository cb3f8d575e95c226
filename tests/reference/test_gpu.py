"""The same kernels on a GPU: vehicles and tasks do there what they do on the CPU. Skipped where there is none."""

import numpy as np
import pytest
import warp as wp

from bench.flying.fleet import hovering
from bench.flying.gpu import GPU, TRACKED
from bench.learning.environments import random_actions
from common.warp_start import start_warp
from policies.tasks.catalogue import build_task, task_settings

TASKS = {
    "RollerBall": {},
    "ReachTarget": {},
    "Parking1": {"preset": "improved"},
    "Parking2": {"preset": "improved"},
    "Hover": {},
    "Drive": {},
    "NavigateRover": {},
    "Navigate": {},
    "FollowMe": TRACKED,
}

start_warp()
pytestmark = [pytest.mark.slow, pytest.mark.skipif(not wp.is_cuda_available(), reason="there is no GPU here")]


def test_the_cpu_is_the_default_beside_a_gpu_too() -> None:
    assert wp.zeros(1, dtype=float).device.is_cpu


def test_vehicles_on_a_gpu_fly_as_on_the_cpu() -> None:
    """Float sums are rounded otherwise there, and noise is the same: a few seconds on, paths are centimetres apart."""
    truths = {}
    for device in ("cpu", GPU):
        rig = hovering(64, device=device)
        rig.advance(250)
        truths[device] = rig.rows["truth"]["pos_ned"].copy()
    assert np.ptp(truths["cpu"], axis=0).max() > 0.05  # each in air of its own
    np.testing.assert_allclose(truths[GPU], truths["cpu"], atol=0.1)


@pytest.mark.parametrize("name", TASKS)
def test_a_task_on_a_gpu_does_as_on_the_cpu(name: str) -> None:
    seen = {}
    for device in ("cpu", GPU):
        task = build_task(name, 64, task_settings(name, TASKS[name]), device)
        task.reset(3)
        rng = np.random.default_rng(0)
        for _ in range(20):
            continuous, branches = random_actions(task, rng)
            task.buffers.continuous.assign(continuous)
            task.buffers.branches.assign(branches)
            task.step()
        seen[device] = (task.buffers.observations.numpy().copy(), task.buffers.rewards.numpy().copy())
    for on_gpu, on_cpu in zip(seen[GPU], seen["cpu"], strict=True):
        assert np.isfinite(on_gpu).all()
        # a few may have met a trunk, or lost somebody, one decision apart
        assert np.isclose(on_gpu, on_cpu, atol=0.05, rtol=0.01).mean() > 0.9
