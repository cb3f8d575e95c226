"""Hover: what is seen, paid and ended; its expert."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import policies  # noqa: F401  (registers the tasks)
from common.airframe import load_airframe
from policies.experts.hover import HoverExpert, cascade
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.episode import Outcome
from policies.tasks.hover.hover_kernels import POINT_NED

STEP_LIMIT = 500
BALL_M = 3.0
UP, DOWN = (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0, -0.5)


def fly(env, action, seed=0):
    """Steps until the episode ends, with a constant action."""
    env.reset(seed=seed)
    count, is_over = 0, False
    while not is_over:
        _, reward, is_terminated, is_truncated, info = env.step(np.array(action, np.float32))
        count, is_over = count + 1, is_terminated or is_truncated
    return count, reward, info["outcome"]


@pytest.fixture(scope="module")
def env():
    return gymnasium.make("honeyguide/Hover-v0").unwrapped


@pytest.mark.filterwarnings("ignore:.*A Box observation space m.*infinity.*:UserWarning")
def test_hover_is_a_valid_gymnasium_environment():
    check_env(gymnasium.make("honeyguide/Hover-v0", render_mode="rgb_array").unwrapped)


def test_the_expert_hovers_to_the_end_of_every_episode():
    env = gymnasium.make_vec("honeyguide/Hover-v0", num_envs=16)
    observation, _ = env.reset(seed=3)
    rewards = []
    for count in range(1, STEP_LIMIT + 1):
        observation, reward, is_terminated, is_truncated, info = env.step(cascade(observation))
        rewards.append(reward)
        assert not is_terminated.any()
        assert is_truncated.all() == (count == STEP_LIMIT)
    assert np.mean(rewards) > 0.7  # GNSS alone is half a metre off: 0.17 of the reward
    assert (info["outcome"] == Outcome.SUCCESS).all()
    assert not np.array_equal(info["final_obs"], observation)


def test_the_expert_hovers_with_stacked_frames():
    task = build_task("Hover", 8, task_settings("Hover", {"stack": "3", "has_estimator": "false"}))
    task.reset(0)
    expert = HoverExpert()
    for _ in range(STEP_LIMIT):
        expert.act(task)
        task.step()
    assert task.take_scores().count(Outcome.SUCCESS) == 8


def test_an_episode_ends_outside_the_ball_and_on_the_ground(env):
    up_count, _, above = fly(env, UP)
    down_count, _, below = fly(env, DOWN)
    assert (above, below) == ("lost", "hit_obstacle")
    assert up_count < 100
    assert down_count < 100


def test_the_ball_ends_where_the_reward_of_position_is_used_up(env):
    _, reward, _ = fly(env, UP)
    assert -0.2 < reward <= 0.0  # the rest is what turning costs, and the overshoot of one step


def flown_once(**settings):
    task = build_task("Hover", 1, task_settings("Hover", settings))
    task.reset(0)
    task.step()
    return task, task.buffers.observations.numpy()[0]


def test_the_policy_sees_the_estimate_and_not_the_truth():
    task, observation = flown_once()
    distance_m = np.linalg.norm(observation[:3])
    estimate = task.rig.arrays.autopilot.ekf.rows.numpy()["estimate"]["pos_ned"][0]
    true_m = np.linalg.norm(np.array(POINT_NED) - task.rig.rows["truth"]["pos_ned"][0])
    assert distance_m == pytest.approx(np.linalg.norm(np.array(POINT_NED) - estimate), rel=1e-5)
    assert abs(distance_m - true_m) > 1e-3
    assert task.buffers.rewards.numpy()[0] == pytest.approx(1.0 - true_m / BALL_M, abs=0.1)


def test_quick_training_sees_the_truth():
    task, observation = flown_once(has_estimator="false")
    true_m = np.linalg.norm(np.array(POINT_NED) - task.rig.rows["truth"]["pos_ned"][0])
    assert np.linalg.norm(observation[:3]) == pytest.approx(true_m, rel=1e-5)


def test_episodes_start_aligned_and_near_the_point():
    task = build_task("Hover", 64)
    task.reset(0)
    observations = task.buffers.observations.numpy()
    assert np.linalg.norm(observations[:, :3], axis=1).max() < 1.2  # 0.87 to the corner of the start cube
    assert np.linalg.norm(observations[:, 3:6], axis=1).max() < 0.5
    assert observations[:, 8].min() > 0.99
    assert len(np.unique(observations[:, 0])) > 16


def test_the_seed_of_reset_decides_the_episode(env):
    def episode(seed):
        observations = [env.reset(seed=seed)[0]]
        observations += [env.step(np.array([0.0, 0.0, 0.1, -0.06], np.float32))[0] for _ in range(20)]
        return np.array(observations)

    assert np.array_equal(episode(5), episode(5))
    assert not np.array_equal(episode(5), episode(6))


def test_one_vehicle_equals_the_first_of_a_batch(env):
    fleet = gymnasium.make_vec("honeyguide/Hover-v0", num_envs=3)
    single, _ = env.reset(seed=7)
    batch, _ = fleet.reset(seed=7)
    for _ in range(20):
        assert np.array_equal(single, batch[0])
        single, reward, *_ = env.step(cascade(single))
        batch, rewards, *_ = fleet.step(cascade(batch))
        assert reward == rewards[0]


def test_an_ended_episode_restarts_alone():
    fleet = gymnasium.make_vec("honeyguide/Hover-v0", num_envs=2)
    observation, _ = fleet.reset(seed=1)
    for _ in range(200):
        action = cascade(observation)
        action[1] = UP
        observation, _, is_terminated, _, info = fleet.step(action)
        if is_terminated.any():
            break
    assert is_terminated.tolist() == [False, True]
    assert info["_final_obs"].tolist() == [False, True]
    assert np.linalg.norm(info["final_obs"][1, :3]) > 1.5
    assert np.linalg.norm(observation[1, :3]) < 1.2


def test_mass_and_wind_are_drawn_for_each_episode():
    task = build_task("Hover", 4, task_settings("Hover", {"has_estimator": "false"}))
    task.set_params({"mass_scale": 1.2, "wind_m_s": 5.0})
    task.reset(0)
    model = task.rig.arrays.model.numpy()["mass_kg"]
    assert model == pytest.approx(1.2 * load_airframe("x500").body.mass_kg)
    assert np.linalg.norm(task.rig.arrays.wind_model.numpy()["mean_ned"], axis=1) == pytest.approx(5.0)
