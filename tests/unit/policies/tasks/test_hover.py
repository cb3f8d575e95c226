import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import policies  # noqa: F401  (registers the tasks)
from policies.tasks.hover import BALL_M, EPISODE_STEPS, HOVER_NED, RATE_MAX, HoverBatch, HoverEnv, HoverVectorEnv

HOVER_THRUST = 0.47  # fraction of the x500's greatest thrust that carries it
GRAVITY = 9.80665


def hover_action(observation):
    """A cascade by hand: to the point with 1.5 /s², damped, thrust vector tilted with 6 /s."""
    to_go, vel, down, _, _ = np.split(observation, [3, 6, 9, 12], axis=-1)
    lift_frd = np.clip(1.5 * to_go - 2.0 * vel, -3.0, 3.0) - GRAVITY * down
    wanted_down = -lift_frd / np.linalg.norm(lift_frd, axis=-1, keepdims=True)
    omega_frd = 6.0 * np.cross([0.0, 0.0, 1.0], wanted_down)
    thrust = -lift_frd[..., 2:] * HOVER_THRUST / GRAVITY
    return np.concatenate([omega_frd / np.array(RATE_MAX), 2.0 * thrust - 1.0], axis=-1).astype(np.float32)


def fly(env, action, seed=0):
    """Steps until the episode ends, with a constant action."""
    env.reset(seed=seed)
    count = 0
    is_terminated = is_truncated = False
    while not (is_terminated or is_truncated):
        _, reward, is_terminated, is_truncated, _ = env.step(action)
        count += 1
    return count, reward, is_terminated


@pytest.fixture(scope="module")
def env():
    return HoverEnv()


@pytest.mark.filterwarnings("ignore:.*A Box observation space m.*infinity.*:UserWarning")
def test_hover_is_a_valid_gymnasium_environment():
    check_env(gymnasium.make("honeyguide/Hover-v0").unwrapped, skip_render_check=True)


def test_a_hand_made_cascade_hovers_to_the_end_of_every_episode():
    env = gymnasium.make_vec("honeyguide/Hover-v0", num_envs=16)
    observation, _ = env.reset(seed=3)
    rewards = []
    for count in range(1, EPISODE_STEPS + 1):
        observation, reward, is_terminated, is_truncated, info = env.step(hover_action(observation))
        rewards.append(reward)
        assert not is_terminated.any()
        assert is_truncated.all() == (count == EPISODE_STEPS)
    assert np.mean(rewards) > 0.7  # GNSS alone is half a metre off: 0.17 of the reward
    assert info["_final_obs"].all()
    assert not np.array_equal(info["final_obs"], observation)


def test_an_episode_ends_outside_the_ball_and_on_the_ground(env):
    up_count, _, is_lost_above = fly(env, np.array([0.0, 0.0, 0.0, 1.0], np.float32))
    down_count, _, is_lost_below = fly(env, np.array([0.0, 0.0, 0.0, -0.5], np.float32))
    assert is_lost_above
    assert is_lost_below
    assert up_count < 100
    assert down_count < 100


def test_the_ball_ends_where_the_reward_of_position_is_used_up(env):
    _, reward, is_lost = fly(env, np.array([0.0, 0.0, 0.0, 1.0], np.float32))
    assert is_lost
    assert -0.2 < reward <= 0.0  # the rest is what turning costs, and the overshoot of one step


def test_the_policy_sees_the_estimate_and_not_the_truth():
    batch = HoverBatch(1)
    batch.reset(np.zeros(1, dtype=np.int64), np.random.default_rng(0))
    batch.step(np.zeros(4, np.float32))
    distance = np.linalg.norm(batch.observations[0, :3])
    estimate = batch.rig.arrays.autopilot.ekf.rows.numpy()["estimate"]["pos_ned"][0]
    truth = batch.rig.rows["truth"]["pos_ned"][0]
    assert distance == pytest.approx(np.linalg.norm(np.array(HOVER_NED) - estimate), rel=1e-5)
    assert abs(distance - np.linalg.norm(np.array(HOVER_NED) - truth)) > 1e-3
    assert batch.rewards[0] == pytest.approx(1.0 - np.linalg.norm(np.array(HOVER_NED) - truth) / BALL_M, abs=0.1)


def test_episodes_start_aligned_and_near_the_point():
    batch = HoverBatch(64)
    batch.reset(np.arange(64), np.random.default_rng(0))
    down = batch.observations[:, 6:9]
    speed = np.linalg.norm(batch.observations[:, 3:6], axis=1)
    assert np.linalg.norm(batch.observations[:, :3], axis=1).max() < 1.2  # 0.87 to the corner of the start cube
    assert speed.max() < 0.5
    assert down[:, 2].min() > 0.99
    assert len(np.unique(batch.observations[:, 0])) > 16


def test_the_seed_of_reset_decides_the_episode(env):
    def episode(seed):
        observations = [env.reset(seed=seed)[0]]
        observations += [env.step(np.array([0.0, 0.0, 0.1, -0.06], np.float32))[0] for _ in range(20)]
        return np.array(observations)

    assert np.array_equal(episode(5), episode(5))
    assert not np.array_equal(episode(5), episode(6))


def test_one_vehicle_equals_the_first_of_a_batch(env):
    fleet = HoverVectorEnv(3)
    single, _ = env.reset(seed=7)
    batch, _ = fleet.reset(seed=7)
    for _ in range(20):
        assert np.array_equal(single, batch[0])
        single, reward, *_ = env.step(hover_action(single))
        batch, rewards, *_ = fleet.step(hover_action(batch))
        assert reward == rewards[0]


def test_an_ended_episode_restarts_alone():
    fleet = HoverVectorEnv(2)
    observation, _ = fleet.reset(seed=1)
    for _ in range(200):
        action = hover_action(observation)
        action[1] = (0.0, 0.0, 0.0, 1.0)
        observation, _, is_terminated, _, info = fleet.step(action)
        if is_terminated.any():
            break
    assert is_terminated.tolist() == [False, True]
    assert info["_final_obs"].tolist() == [False, True]
    assert np.linalg.norm(info["final_obs"][1, :3]) > 1.5
    assert np.linalg.norm(observation[1, :3]) < 1.2
    assert np.array_equal(info["final_obs"][0], observation[0])
