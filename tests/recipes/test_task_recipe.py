"""The recipe "A learning task" of CONTRIBUTING.md: a task and one line in the catalogue."""

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from policies.learn.export.policy_file import load_policy
from policies.tasks.catalogue import CATALOGUE, Entry, build_task
from policies.tasks.episode import Outcome
from policies.tasks.gym import TaskEnv, TaskVectorEnv
from tests.recipes.slider import Slider
from tests.unit.mission.train.training_run import RUN, train, write_config


@pytest.fixture(autouse=True)
def named(monkeypatch, tmp_path):
    """The one line of the catalogue."""
    monkeypatch.setitem(CATALOGUE, "Slider", Entry(Slider))
    monkeypatch.chdir(tmp_path)


def towards(observations):
    """Push to the mark, damped."""
    return np.clip(1.5 * observations[:, :1] - 1.5 * observations[:, 1:], -1.0, 1.0)


def test_a_hand_made_controller_reaches_every_mark():
    task = build_task("Slider", 64)
    task.reset(1)
    for _ in range(200):
        task.buffers.continuous.numpy()[:] = towards(task.buffers.observations.numpy())
        task.step()
    scores = task.take_scores()
    assert scores.count(Outcome.SUCCESS) == scores.episode_count > 64


@pytest.mark.filterwarnings("ignore:.*A Box observation space m.*infinity.*:UserWarning")
def test_it_is_a_gymnasium_environment_alone_and_in_a_batch():
    check_env(TaskEnv("Slider"), skip_render_check=True)
    observations, _ = TaskVectorEnv("Slider", num_envs=8).reset(seed=1)
    assert observations.shape == (8, 2)


def test_it_is_trained_by_the_command():
    write_config(env="Slider", max_steps=4_000, checkpoint_interval=4_000)
    result = train()
    assert result.exit_code == 0, result.output
    assert load_policy(RUN / "Ball.pt")[0].layout == build_task("Slider", 1).layout
