import numpy as np
import pytest
import torch

from policies.learn.rollout.hindsight import Hindsight, with_goals
from policies.learn.rollout.replay_buffer import Replay, ReplayBatch
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.episode import Outcome
from policies.tasks.goals import PositionGoal

GOAL = PositionGoal(goal=(0,), achieved=(1,), radius="reach_m", reward=1.0)


def transitions(goal, before, after, rewards, is_terminated):
    """On a line: an observation is the goal and the place."""
    goal, before, after = (torch.tensor(values) for values in (goal, before, after))
    return ReplayBatch(
        observations=torch.stack([goal, before], dim=1),
        next_observations=torch.stack([goal, after], dim=1),
        continuous=torch.zeros(len(goal), 1),
        branches=torch.zeros(len(goal), 0, dtype=torch.int64),
        rewards=torch.tensor(rewards),
        is_terminated=torch.tensor(is_terminated),
        is_ended=torch.tensor(is_terminated) > 0.0,
    )


def walked(rounds, capacity=1000, length=7, env_count=3):
    """Walkers step by 1 with a time limit of `length` decisions, each on a line of its own, 1000 apart."""
    replay = Replay(capacity, env_count, 2, (1, 0))
    hindsight = Hindsight(GOAL, replay, 4)
    starts = 1000.0 * torch.arange(env_count)
    for number in range(rounds):
        indices = (starts + number).tolist()
        after = (starts + number + 1).tolist()
        is_over = torch.full((env_count,), number % length == length - 1)
        hindsight.add(torch.full((env_count,), 0.5), is_over, torch.zeros(env_count, dtype=torch.bool))
        replay.add(transitions([-9.0] * env_count, indices, after, [0.0] * env_count, [0.0] * env_count))
    return replay, hindsight


def relabelled(replay, hindsight, count=4000, seed=1):
    generator = torch.Generator().manual_seed(seed)
    indices = replay.draw(count, generator)
    return hindsight.relabel(replay.take(indices), indices, generator)


def test_reaching_the_new_goal_pays_and_ends():
    walk = transitions([9.0, 9.0], [1.0, 2.0], [2.0, 3.0], [0.0, -0.25], [0.0, 0.0])
    goals = torch.tensor([[2.25], [2.25]])
    new = with_goals(walk, goals, GOAL, torch.tensor([0.5, 0.5]), torch.tensor([False, False]))
    assert new.observations.tolist() == [[2.25, 1.0], [2.25, 2.0]]
    assert new.next_observations.tolist() == [[2.25, 2.0], [2.25, 3.0]]
    assert new.rewards.tolist() == [1.0, -0.25]
    assert new.is_terminated.tolist() == [1.0, 0.0]


def test_with_another_goal_what_reached_the_old_one_neither_pays_nor_ends_but_a_crash_ends():
    walk = transitions([3.0, 9.0], [2.0, 2.0], [3.0, 3.0], [1.0, -0.5], [1.0, 1.0])
    new = with_goals(walk, torch.tensor([[8.0], [8.0]]), GOAL, torch.full((2,), 0.5), torch.tensor([True, False]))
    assert new.rewards.tolist() == [0.0, -0.5]
    assert new.is_terminated.tolist() == [0.0, 1.0]


def test_with_their_own_goals_transitions_stay_as_they_were():
    walk = transitions([3.0, 9.0, 3.0], [2.0, 2.0, 1.0], [2.75, 3.0, 2.0], [1.0, -0.5, 0.0], [1.0, 1.0, 0.0])
    is_success = torch.tensor([True, False, False])
    new = with_goals(walk, walk.observations[:, :1], GOAL, torch.full((3,), 0.5), is_success)
    for name in ("observations", "next_observations", "rewards", "is_terminated", "is_ended"):
        assert torch.equal(getattr(new, name), getattr(walk, name))


@pytest.mark.parametrize(("rounds", "capacity"), [(45, 1000), (100, 90)], ids=["filling", "overwritten"])
def test_goals_are_places_that_the_same_episode_came_to_later(rounds, capacity):
    new = relabelled(*walked(rounds, capacity))
    changed = new.observations[:, 0] != -9.0
    goal, before = (new.observations[changed, k] for k in (0, 1))
    assert torch.equal(goal // 1000, before // 1000)
    ahead = goal - before
    assert ahead.min() >= 1.0
    number = before % 1000  # the round it was written in: episodes begin with the multiples of 7
    left = torch.minimum(7 - number % 7, rounds - number)
    assert (ahead <= left).all()
    assert (ahead[left == 7]).unique().numel() == 7
    assert torch.equal(new.is_terminated[changed], (ahead == 1.0).float())
    assert torch.equal(new.rewards, new.is_terminated)


def test_k_of_k_plus_one_transitions_get_another_goal():
    new = relabelled(*walked(50), count=20_000)
    assert (new.observations[:, 0] != -9.0).float().mean().item() == pytest.approx(0.8, abs=0.015)


def test_restored_hindsight_goes_on_alike():
    replay, hindsight = walked(60, capacity=90)
    twin_replay, twin = walked(0, capacity=90)
    twin_replay.load_state(replay.state())
    twin.load_state(hindsight.state())
    one, two = relabelled(replay, hindsight), relabelled(twin_replay, twin)
    assert torch.equal(one.observations, two.observations)
    assert torch.equal(one.rewards, two.rewards)


@pytest.mark.parametrize(
    ("name", "settings", "radius_m"), [("RollerBall", {}, 2.0), ("ReachTarget", {"variant": 0}, 20.0)], ids=str
)
def test_a_tasks_own_successes_are_those_its_place_goal_tells(name, settings, radius_m):
    task = build_task(name, 256, task_settings(name, settings))
    task.set_params({"reach_m": radius_m})
    task.reset(3)
    actions = np.random.default_rng(3)
    goal = task.goal
    counts = 0
    for _ in range(60):
        task.buffers.continuous.numpy()[:] = actions.uniform(-1.0, 1.0, task.buffers.continuous.shape)
        task.step()
        outcomes = task.buffers.outcomes.numpy()
        is_over = outcomes != Outcome.RUNNING
        observation = np.where(
            is_over[:, None], task.buffers.final_observations.numpy(), task.buffers.observations.numpy()
        )
        distance = np.linalg.norm(observation[:, goal.goal] - observation[:, goal.achieved], axis=1)
        is_success = outcomes == Outcome.SUCCESS
        clear = np.abs(distance - radius_m) > 1e-4
        assert np.array_equal(distance[clear] < radius_m, is_success[clear])
        assert (task.buffers.rewards.numpy()[is_success] == goal.reward).all()
        assert not task.buffers.rewards.numpy()[~is_success].any()
        counts += is_success.sum()
    assert counts > 50


def test_only_tasks_whose_observations_hold_goal_and_place_have_a_place_goal():
    assert build_task("ReachTarget", 1, task_settings("ReachTarget", {"variant": 0})).goal is not None
    for variant in (1, 2, 3, 4):
        assert build_task("ReachTarget", 1, task_settings("ReachTarget", {"variant": variant})).goal is None
