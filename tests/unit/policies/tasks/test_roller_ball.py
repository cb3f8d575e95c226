import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import policies  # noqa: F401  (registers the tasks)
from policies.tasks.catalogue import build_task
from policies.tasks.episode import Outcome


def towards(observations):
    """Push to the cube, damped."""
    return np.clip(0.5 * (observations[:, [0, 2]] - observations[:, [3, 5]]) - 0.5 * observations[:, 6:8], -1.0, 1.0)


@pytest.mark.filterwarnings("ignore:.*A Box observation space m.*infinity.*:UserWarning")
def test_it_is_a_valid_gymnasium_environment():
    check_env(gymnasium.make("honeyguide/RollerBall-v0", render_mode="rgb_array").unwrapped)


def test_a_hand_made_controller_reaches_every_cube():
    task = build_task("RollerBall", 256)
    task.reset(1)
    for _ in range(200):
        task.buffers.continuous.numpy()[:] = towards(task.buffers.observations.numpy())
        task.step()
    scores = task.take_scores()
    assert scores.count(Outcome.SUCCESS) > 1000
    assert scores.count(Outcome.SUCCESS) > 0.99 * scores.episode_count
    assert scores.return_sum == scores.count(Outcome.SUCCESS)


def test_a_constant_push_falls_off_the_floor():
    task = build_task("RollerBall", 16)
    task.reset(1)
    task.buffers.continuous.numpy()[:] = 1.0
    for _ in range(30):
        task.step()
    assert task.take_scores().count(Outcome.FELL) >= 16
