"""How much of the training loop, the simulator aside, is the arithmetic of its networks?

PPO on one core, in processor time. Three times of the same iteration: the loop as it is, less the time in the task;
torch alone, which is the same passes through the same networks forward and back and the same optimiser steps, on rows
that lie ready; and the floor, the same products at the peak that this core reaches on large matrices. Between loop and
torch alone lie draws, losses, advantages and copies; between torch alone and floor activations and small matrices.
"""

import time
from collections.abc import Callable
from typing import Any

import torch
from torch import nn

from bench.row import Row, best_of, require
from policies.learn.algorithms.ppo import Ppo
from policies.learn.config.behavior import Behavior
from policies.learn.networks.policy import Policy
from policies.learn.signals.extrinsic import ExtrinsicSignal
from policies.tasks.catalogue import build_task, task_settings

TASK = "Parking1"
SETTINGS: dict[str, Any] = {"preset": "as-documented"}
ENVS, ROLLOUT, EPOCHS, BATCH = 1024, 32, 2, 8192
SIZES = (64, 256)
TRIES, PEAK_SIZE = 5, 1536
COMMAND = "python -m bench roofline"


def measure() -> list[Row]:
    """The loop's distance to torch alone, and to the floor."""
    torch.set_num_threads(1)
    peak = peak_flop_s()
    rows = [Row("one core, products of large matrices", peak / 1e9, "GFLOP/s", "higher", None, COMMAND)]
    for size in SIZES:
        learner, task = _learner(size)
        loop_s, alone_s = _loop_s(learner, task), best_of(TRIES, lambda ppo=learner: _alone_s(ppo))  # type: ignore[misc]
        floor_s = iteration_flop(learner) / peak
        require(floor_s < alone_s < 2.0 * loop_s, f"floor {floor_s:.3g} s, alone {alone_s:.3g} s, loop {loop_s:.3g} s")
        name = f"training loop without the simulator, {TASK}, 2 x {size}, one core"
        rows += [
            Row(f"{name}: torch alone over the loop", alone_s / loop_s, "1", "higher", 0.6, COMMAND),
            Row(
                f"{name}: networks' products at the core's peak over the loop",
                floor_s / loop_s,
                "1",
                "higher",
                None,
                COMMAND,
            ),
        ]
    return rows


def peak_flop_s() -> float:
    """What the core reaches on products of large matrices [FLOP/s]."""
    a, b = torch.randn(PEAK_SIZE, PEAK_SIZE), torch.randn(PEAK_SIZE, PEAK_SIZE)
    spent_s = best_of(8, lambda: _processor_s(lambda: torch.mm(a, b)))
    return 2.0 * PEAK_SIZE**3 / spent_s


def iteration_flop(learner: Ppo) -> float:
    """Of the products of one iteration: acting, valuing, and learning forward and back.

    Back, a layer costs its forward pass for its weights, and once more for its inputs unless it is the first.
    """
    policy, critic = _layers(learner.policy), _layers(learner.critic)
    decisions = ENVS * ROLLOUT
    forward = [2.0 * sum(layer.weight.numel() for layer in layers) for layers in (policy, critic)]
    first = [2.0 * layers[0].weight.numel() for layers in (policy, critic)]
    learning = sum(3.0 * whole - inputs for whole, inputs in zip(forward, first, strict=True))
    return decisions * (forward[0] + forward[1] + EPOCHS * learning) + ENVS * forward[1]


def _layers(network: nn.Module) -> list[nn.Linear]:
    return [module for module in network.modules() if isinstance(module, nn.Linear)]


def _learner(size: int) -> tuple[Ppo, Any]:
    task = build_task(TASK, ENVS, task_settings(TASK, SETTINGS))
    behavior = Behavior.model_validate(
        {
            "hyperparameters": {
                "batch_size": BATCH,
                "buffer_size": ENVS * ROLLOUT,
                "num_epoch": EPOCHS,
                "learning_rate_schedule": "constant",
            },
            "network_settings": {"hidden_units": size, "num_layers": 2, "normalize": False},
        }
    )
    policy = Policy(task.layout, behavior.network_settings, torch.Generator().manual_seed(0))
    return Ppo(task, policy, behavior, [ExtrinsicSignal()], seed=0), task


def _loop_s(learner: Ppo, task: Any) -> float:
    """Of an iteration, the task's steps taken off."""
    simulated_s, step = 0.0, task.step

    def timed() -> None:
        nonlocal simulated_s
        simulated_s += _processor_s(step)

    task.step = timed

    def tried() -> float:
        nonlocal simulated_s
        simulated_s = 0.0
        whole_s = _processor_s(learner.iterate)
        return whole_s - simulated_s

    tried()
    return best_of(TRIES, tried)


def _alone_s(learner: Ppo) -> float:
    """Of an iteration's passes and optimiser steps, on rows that lie ready."""
    policy, critic = learner.policy, learner.critic
    rows = torch.randn(ENVS * ROLLOUT, policy.layout.observation_size)
    optimizer = torch.optim.Adam([*policy.parameters(), *critic.parameters()], lr=1e-8, fused=True)

    def iterate() -> None:
        with torch.inference_mode():
            for part in rows.split(ENVS):
                policy(part)
            critic(rows)
        for _ in range(EPOCHS):
            for part in rows.split(BATCH):
                optimizer.zero_grad(set_to_none=True)
                (policy(part).entropy().mean() + critic(part).mean()).backward()
                optimizer.step()

    return _processor_s(iterate)


def _processor_s(task: Callable[[], Any]) -> float:
    begun_s = time.process_time()
    task()
    return time.process_time() - begun_s
