"""How many steps per second does the whole training loop make, beside Stable-Baselines3 on the same batch of tasks?

Both train PPO with the same networks (the parking document's: two layers of 64), the same number of environments,
steps, epochs and minibatches, on the same cores. Once the peer gets our batch, once it steps single environments made
by Gymnasium one after the other, as its users do. "Document's settings" are those of the parking document: batches of
256, 5 epochs.
"""

import time
from typing import Any

import torch

from bench.row import Row, require
from policies.learn.algorithms.learner import Learner
from policies.learn.algorithms.ppo import Ppo
from policies.learn.config.behavior import Behavior
from policies.learn.networks.policy import Policy
from policies.learn.signals.extrinsic import ExtrinsicSignal
from policies.tasks.catalogue import build_task, task_settings

TASK = "Parking1"
SETTINGS: dict[str, Any] = {"preset": "as-documented"}
ENVS, ROLLOUT, EPOCHS, BATCH = 1024, 32, 2, 8192
DOCUMENT_ENVS, DOCUMENT_ROLLOUT, DOCUMENT_EPOCHS, DOCUMENT_BATCH = 16, 1280, 5, 256
THREADS = 2
COMMAND = "python -m bench training"


def measure() -> list[Row]:
    torch.set_num_threads(THREADS)
    ours = _our_rate(ENVS, ROLLOUT, EPOCHS, BATCH, 12)
    peer = _peer_rate(ENVS, ROLLOUT, EPOCHS, BATCH, 4)
    faithful = _our_rate(DOCUMENT_ENVS, DOCUMENT_ROLLOUT, DOCUMENT_EPOCHS, DOCUMENT_BATCH, 3)
    faithful_peer = _peer_rate(DOCUMENT_ENVS, DOCUMENT_ROLLOUT, DOCUMENT_EPOCHS, DOCUMENT_BATCH, 2)
    usual_peer = _peer_rate(DOCUMENT_ENVS, DOCUMENT_ROLLOUT, DOCUMENT_EPOCHS, DOCUMENT_BATCH, 1, is_batched=False)
    name = f"training loop, {TASK}, 2 x 64, 2 cores"
    return [
        Row(f"{name}: our settings", ours, "steps/s", "higher", 1e5, COMMAND),
        Row(f"{name}: our settings, Stable-Baselines3", peer, "steps/s", "higher", None, COMMAND),
        Row(f"{name}: our settings, ours over Stable-Baselines3", ours / peer, "x", "higher", 3.0, COMMAND),
        Row(f"{name}: document's settings", faithful, "steps/s", "higher", None, COMMAND),
        Row(f"{name}: document's settings, Stable-Baselines3", faithful_peer, "steps/s", "higher", None, COMMAND),
        Row(
            f"{name}: document's settings, ours over Stable-Baselines3",
            faithful / faithful_peer,
            "x",
            "higher",
            3.0,
            COMMAND,
        ),
        Row(
            f"{name}: Stable-Baselines3 with 16 Gymnasium environments", usual_peer, "steps/s", "higher", None, COMMAND
        ),
        Row(f"{name}: our settings over that", ours / usual_peer, "x", "higher", 3.0, COMMAND),
        Row(f"{name}: document's settings over that", faithful / usual_peer, "x", "higher", 3.0, COMMAND),
    ]


def _behavior(envs: int, rollout: int, epochs: int, batch: int) -> Behavior:
    return Behavior.model_validate(
        {
            "hyperparameters": {
                "batch_size": batch,
                "buffer_size": envs * rollout,
                "num_epoch": epochs,
                "learning_rate_schedule": "constant",
            },
            "network_settings": {"hidden_units": 64, "num_layers": 2, "normalize": False},
        }
    )


def _our_rate(envs: int, rollout: int, epochs: int, batch: int, iterations: int) -> float:
    task = build_task(TASK, envs, task_settings(TASK, SETTINGS))
    behavior = _behavior(envs, rollout, epochs, batch)
    policy = Policy(task.layout, behavior.network_settings, torch.Generator().manual_seed(0))
    learner: Learner = Ppo(task, policy, behavior, [ExtrinsicSignal()], seed=0)
    learner.iterate()  # warm
    start_steps, start = learner.steps, time.perf_counter()
    for _ in range(iterations):
        statistics = learner.iterate().statistics
    spent = time.perf_counter() - start
    require(statistics["Losses/Value Loss"] < 1e3, "training diverged")
    return (learner.steps - start_steps) / spent


def _peer_rate(envs: int, rollout: int, epochs: int, batch: int, iterations: int, *, is_batched: bool = True) -> float:
    from stable_baselines3 import PPO
    from stable_baselines3.common.env_util import make_vec_env

    from bench.learning.sb3 import BatchVecEnv

    networks = {"net_arch": [64, 64], "activation_fn": torch.nn.SiLU}
    environments = (
        BatchVecEnv(TASK, envs, **SETTINGS)
        if is_batched
        else make_vec_env(f"policies:honeyguide/{TASK}-v0", envs, env_kwargs=SETTINGS)
    )
    model = PPO(
        "MlpPolicy", environments, n_steps=rollout, batch_size=batch, n_epochs=epochs, policy_kwargs=networks, seed=0
    )
    model.learn(envs * rollout)  # warm
    start = time.perf_counter()
    model.learn(envs * rollout * iterations, reset_num_timesteps=True)
    return envs * rollout * iterations / (time.perf_counter() - start)
