"""How many decisions does our SAC need for RollerBall, and our hindsight replay for small cubes, next to SB3's?

Both train the same task with the same numbers: 16 environments, 2 x 64 units, batch 256, an update per 8 decisions,
discount 0.95, first temperature 0.02. Stable-Baselines3 sees observations as they are, ours are normalised.
"""

import time
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import torch

from bench.row import Row, require
from policies.learn.algorithms.sac import Sac
from policies.learn.config.behavior import Behavior
from policies.learn.networks.policy import Policy
from policies.learn.signals.extrinsic import ExtrinsicSignal
from policies.tasks.catalogue import build_task
from policies.tasks.episode import Outcome
from policies.tasks.gym import TaskEnv

STEPS = 30_000
ENV_COUNT = 16
EVALUATION_ENVS = 256
SMALL_M = 0.5  # reach, of the hindsight comparison
COMMAND = "python -m bench sac"
Act = Callable[[np.ndarray], np.ndarray]
_PARAMS = {"batch_size": 256, "buffer_size": 100_000, "learning_rate": 1e-3, "tau": 0.02}


def measure() -> list[Row]:
    """Success rates after the same decisions, deterministic, and the ratio of the training times."""
    torch.set_num_threads(1)
    rows = []
    for title, reach_m, goals in (("", 1.42, 0), (f", reach {SMALL_M} m, hindsight", SMALL_M, 4)):
        ours, our_s = _timed(lambda reach_m=reach_m, goals=goals: _ours(reach_m, goals))
        theirs, their_s = _timed(lambda reach_m=reach_m, goals=goals: _theirs(reach_m, goals))
        our_rate, their_rate = _success_rate(ours, reach_m), _success_rate(theirs, reach_m)
        require(our_rate > 0.5, f"RollerBall{title}: {our_rate:.0%} after {STEPS} decisions")
        name = f"RollerBall{title}: SAC, {STEPS // 1000}k decisions"
        rows += [
            Row(f"{name}, success", our_rate, "1", "higher", 0.9, COMMAND),
            Row(f"{name}, success of SB3", their_rate, "1", "higher", None, COMMAND),
            Row(f"{name}, time over SB3's", our_s / their_s, "1", "lower", 1.0, COMMAND),
        ]
    return rows


def _timed(train: Callable[[], Act]) -> tuple[Act, float]:
    start = time.perf_counter()
    act = train()
    return act, time.perf_counter() - start


def _ours(reach_m: float, goals: int) -> Act:
    task = build_task("RollerBall", ENV_COUNT)
    task.set_params({"reach_m": reach_m})
    params = {"buffer_init_steps": 1000, "steps_per_update": 8, "init_entcoef": 0.02, "hindsight": goals}
    behavior = Behavior.model_validate(
        {
            "trainer_type": "sac",
            "hyperparameters": {**_PARAMS, **params},
            "network_settings": {"hidden_units": 64, "normalize": True},
        }
    )
    policy = Policy(task.layout, behavior.network_settings, torch.Generator().manual_seed(1), is_squashed=True)
    sac = Sac(task, policy, behavior, [ExtrinsicSignal(gamma=0.95)], seed=1)
    while sac.steps < STEPS:
        sac.iterate()

    def act(observations: np.ndarray) -> np.ndarray:
        with torch.no_grad():
            actions, _ = policy.act(torch.from_numpy(observations), policy.start_memory(len(observations)))
            return policy.bounded(actions).numpy()

    return act


def _theirs(reach_m: float, goals: int) -> Act:
    from stable_baselines3 import SAC, HerReplayBuffer
    from stable_baselines3.common.vec_env import DummyVecEnv

    kind = _GoalEnv if goals else _PlainEnv
    envs = DummyVecEnv([lambda: kind(reach_m) for _ in range(ENV_COUNT)])
    hindsight: dict[str, Any] = {
        "replay_buffer_class": HerReplayBuffer,
        "replay_buffer_kwargs": {"n_sampled_goal": goals, "goal_selection_strategy": "future"},
    }
    model = SAC(
        "MultiInputPolicy" if goals else "MlpPolicy",
        envs,
        learning_starts=1000 if not goals else 1000 + 500 * ENV_COUNT // 10,  # whole episodes must lie in the buffer
        train_freq=1,
        gradient_steps=ENV_COUNT // 8,
        gamma=0.95,
        ent_coef="auto_0.02",
        policy_kwargs={"net_arch": [64, 64]},
        seed=1,
        **_PARAMS,
        **(hindsight if goals else {}),
    )
    model.learn(STEPS)

    def act(observations: np.ndarray) -> np.ndarray:
        observation = _split(observations) if goals else observations
        return np.asarray(model.predict(observation, deterministic=True)[0])

    return act


def _success_rate(act: Act, reach_m: float) -> float:
    """Of the episodes that end in 400 decisions of many environments."""
    task = build_task("RollerBall", EVALUATION_ENVS)
    task.set_params({"reach_m": reach_m, "step_limit": 100.0})
    task.reset(7)
    for _ in range(400):
        task.buffers.continuous.numpy()[:] = act(task.buffers.observations.numpy().copy())
        task.step()
    scores = task.take_scores()
    return scores.count(Outcome.SUCCESS) / scores.episode_count


class _PlainEnv(gymnasium.Wrapper[Any, Any, Any, Any]):
    """The task as it is."""

    def __init__(self, reach_m: float) -> None:
        env = TaskEnv("RollerBall")
        env.task.set_params({"reach_m": reach_m})
        super().__init__(env)


class _GoalEnv(gymnasium.ObservationWrapper[Any, Any, Any]):
    """The task as SB3 wants goals: a dictionary of what is seen, achieved and desired."""

    def __init__(self, reach_m: float) -> None:
        super().__init__(_PlainEnv(reach_m))
        self._reach_m = reach_m
        sizes = {"observation": 5, "achieved_goal": 3, "desired_goal": 3}
        self.observation_space = gymnasium.spaces.Dict(
            {name: gymnasium.spaces.Box(-np.inf, np.inf, (size,), np.float32) for name, size in sizes.items()}
        )

    def observation(self, observation: np.ndarray) -> dict[str, np.ndarray]:
        return _split(observation)

    def compute_reward(self, achieved: np.ndarray, desired: np.ndarray, _info: Any) -> np.ndarray:
        return (np.linalg.norm(achieved - desired, axis=-1) < self._reach_m).astype(np.float32)


def _split(observations: np.ndarray) -> dict[str, np.ndarray]:
    return {
        "observation": observations[..., 3:],
        "achieved_goal": observations[..., 3:6],
        "desired_goal": observations[..., :3],
    }
