"""Gymnasium's MountainCar-v0 for many cars at once: a task that pays for what chance does not find.

In: actions. Out: what `gymnasium.make("MountainCar-v0")` answers to them, in arrays. One car after the other, as
Gymnasium steps them, takes most of a training's time.
"""

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from policies.tasks.episode import Outcome
from policies.tasks.gym_task import GymTask
from policies.tasks.reshaping import Decision

# As in gymnasium/envs/classic_control/mountain_car.py, after Moore (1990).
_POSITIONS = (-1.2, 0.6)
_STARTS = (-0.6, -0.4)
_SPEED = 0.07
_TOP = 0.5
_PUSH = 0.001
_GRAVITY = 0.0025
_STEPS = 200  # of an episode at most


class MountainCars(VectorEnv[Any, Any, Any]):
    """The cars; position and velocity are float64, as there."""

    metadata: dict[str, Any] = {"autoreset_mode": AutoresetMode.DISABLED}  # noqa: RUF012  (Gymnasium's own)

    def __init__(self, num_envs: int = 1) -> None:
        self.num_envs = num_envs
        low, high = np.float32([_POSITIONS[0], -_SPEED]), np.float32([_POSITIONS[1], _SPEED])
        self.single_observation_space = spaces.Box(low, high)
        self.single_action_space = spaces.Discrete(3)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.state = np.zeros((num_envs, 2))
        self._steps = np.zeros(num_envs, dtype=np.int64)
        self._random = np.random.default_rng()

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[NDArray[Any], dict[str, Any]]:
        """Puts cars into the valley, at rest: all, or those of the mask."""
        given = [each for each in np.atleast_1d(seed) if each is not None]
        if given:
            self._random = np.random.default_rng(given)
        chosen = (options or {}).get("reset_mask", np.ones(self.num_envs, dtype=np.bool_))
        starts = self._random.uniform(*_STARTS, self.num_envs)
        self.state[chosen] = np.stack([starts, np.zeros(self.num_envs)], axis=1)[chosen]
        self._steps[chosen] = 0
        return self.state.astype(np.float32), {}

    def step(
        self, actions: NDArray[Any]
    ) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        position, velocity = self.state.T
        velocity = velocity + ((actions - 1) * _PUSH - np.cos(3.0 * position) * _GRAVITY)
        velocity = velocity.clip(-_SPEED, _SPEED)
        position = (position + velocity).clip(*_POSITIONS)
        velocity = np.where((position == _POSITIONS[0]) & (velocity < 0.0), 0.0, velocity)
        self.state = np.stack([position, velocity], axis=1)
        self._steps += 1
        is_up = (position >= _TOP) & (velocity >= 0.0)
        return self.state.astype(np.float32), np.full(self.num_envs, -1.0), is_up, self._steps >= _STEPS, {}


gymnasium.register("honeyguide-bench/MountainCars-v0", vector_entry_point=MountainCars)


class MountainCar(GymTask):
    """The car; its episodes end at the top or at the limit of steps."""

    env_id = "honeyguide-bench/MountainCars-v0"
    says_success = True

    def outcome(self, decision: Decision) -> NDArray[Any]:
        return np.where(decision.outcomes == Outcome.ENDED, Outcome.SUCCESS, decision.outcomes)


class MountainCarAtTop(MountainCar):
    """The same, paid 1 at the top and nothing else. A price of each step drives a learner to what it has not tried."""

    def reward(self, decision: Decision) -> NDArray[Any]:
        return (decision.outcomes == Outcome.SUCCESS).astype(np.float32)
