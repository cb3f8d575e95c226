"""Rows 1 to 11 of the document's table 2, each on a situation built by hand, and our shaping."""

import numpy as np
import pytest

from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.episode import Outcome
from policies.tasks.parking.arena import pose

STILL = {"push_n": 0.0}  # a push of 0 N: the reward of standing
QUIET = {"wall_reward": 0.0, "obstacle_reward": 0.0}
GOAL = (0.0, 12.0, 0.0)
HEIGHT = 0.2  # of the car's origin over the pad's centre


def rewarded(*, pos, best=30.0, last=0.0, vel=(0.0, 0.0), params=None, goal=GOAL, blocks=None, **settings):
    """The reward of one decision from a situation, and the task after it."""
    task = build_task("Parking1", 1, task_settings("Parking1", settings))
    task.set_params({**STILL, **(params or {})})
    task.reset(0)
    world = task.world
    world.pos.numpy()[0], world.vel.numpy()[0] = pos, vel
    world.goal.numpy()[0] = pose(goal)
    world.best_m.numpy()[0], world.last_m.numpy()[0] = best, last
    if blocks is not None:
        task.blocks.numpy()[0] = [pose(position) for position in blocks]
    task.step()
    return float(task.buffers.rewards.numpy()[0]), task


@pytest.mark.parametrize("reward", ["as-documented", "as-coded"])
def test_row_1_a_wall_costs_a_half_and_ends(reward):
    value, task = rewarded(pos=(5.0, 13.9), vel=(0.0, 2.0), params=QUIET, reward=reward)
    assert task.buffers.outcomes.numpy()[0] == Outcome.HIT_WALL
    assert value == pytest.approx(-0.5, abs=2e-4)


def test_row_2_an_obstacle_costs_a_half_and_ends():
    value, task = rewarded(pos=(-3.28, 1.0), params=QUIET)
    assert task.buffers.outcomes.numpy()[0] == Outcome.HIT_OBSTACLE
    assert value == pytest.approx(-0.5, abs=2e-4)


def test_row_3_a_park_pays_five_and_ends():
    value, task = rewarded(pos=(0.0, 11.0), params=QUIET)
    assert task.buffers.outcomes.numpy()[0] == Outcome.SUCCESS
    assert value == pytest.approx(5.0, abs=2e-4)


def test_row_4_near_the_goal_pays_beside_the_row_of_approach():
    near, far = (0.0, 12.0 - 2.45), (0.0, 12.0 - 2.55)  # a car whose box is still off the pad
    params = {**QUIET, "car_length_m": 0.5, "box_ahead_m": 0.0}
    assert rewarded(pos=near, params=params)[0] == pytest.approx(3e-5 + 2e-5, rel=1e-3)
    assert rewarded(pos=far, params=params)[0] == pytest.approx(2e-5, rel=1e-3)
    assert rewarded(pos=near, params=params, reward="as-documented")[0] == pytest.approx(8e-5 + 2e-5, rel=1e-3)


def test_row_5_the_best_distance_pays_once():
    value, task = rewarded(pos=(0.0, 2.0), best=10.1, last=9.0, params=QUIET)
    assert value == pytest.approx(2e-5, rel=1e-3)
    assert task.world.best_m.numpy()[0] == pytest.approx(np.hypot(10.0, HEIGHT), rel=1e-5)
    task.step()
    assert task.buffers.rewards.numpy()[0] == pytest.approx(-2e-5, rel=1e-3)


@pytest.mark.parametrize(
    ("reward", "paid"), [("as-coded", 1e-5), ("as-documented-gail", 1e-5), ("as-documented", -4e-5)]
)
def test_row_6_nearer_but_not_best(reward, paid):
    value, _ = rewarded(pos=(0.0, 2.0), best=5.0, last=10.5, params=QUIET, reward=reward)
    assert value == pytest.approx(paid, rel=1e-3)


@pytest.mark.parametrize(
    ("reward", "paid"), [("as-coded", -2e-5), ("as-documented-gail", -2e-5), ("as-documented", -8e-5)]
)
def test_row_7_farther(reward, paid):
    value, _ = rewarded(pos=(0.0, 2.0), best=5.0, last=9.5, params=QUIET, reward=reward)
    assert value == pytest.approx(paid, rel=1e-3)


def test_row_4_as_coded_makes_a_nearer_step_within_its_radius_count_as_farther():
    params = {**QUIET, "car_length_m": 0.5, "box_ahead_m": 0.0}
    situation = {"pos": (0.0, 12.0 - 2.45), "best": 1.0, "last": 5.0, "params": params}
    assert rewarded(**situation)[0] == pytest.approx(3e-5 - 2e-5, rel=1e-3)
    assert rewarded(**situation, reward="as-documented-gail")[0] == pytest.approx(3e-5 + 1e-5, rel=1e-3)


def test_best_begins_at_30_in_each_episode_and_last_is_kept_as_coded():
    _, task = rewarded(pos=(5.0, 13.9), vel=(0.0, 2.0), best=1.0, params=QUIET)
    assert task.buffers.outcomes.numpy()[0] == Outcome.HIT_WALL
    assert task.world.best_m.numpy()[0] == 30.0
    assert task.world.last_m.numpy()[0] == pytest.approx(np.sqrt(5.0**2 + 1.9**2 + HEIGHT**2), rel=1e-5)


def test_row_8_as_coded_is_measured_to_the_centres_of_walls():
    in_reach = {"pos": (0.0, -13.5), "last": 1e3, "best": 1.0, "params": {"best_start_m": 0.0}}
    assert rewarded(**in_reach)[0] == pytest.approx(-0.005 + 1e-5, rel=1e-3)
    along_the_wall = {**in_reach, "pos": (6.0, -13.5)}
    assert rewarded(**along_the_wall)[0] == pytest.approx(1e-5, rel=1e-3)


def test_row_8_as_documented_is_measured_to_the_surfaces_of_walls():
    situation = {"last": 1e3, "best": 1.0, "reward": "as-documented-gail"}
    assert rewarded(pos=(6.0, -13.5), **situation)[0] == pytest.approx(-0.005 + 1e-5, rel=1e-3)
    assert rewarded(pos=(-13.0, -13.5), **situation)[0] == pytest.approx(-0.010 + 1e-5, rel=1e-3)
    assert rewarded(pos=(6.0, -12.9), **situation)[0] == pytest.approx(1e-5, rel=1e-3)


def test_row_9_costs_once_for_each_obstacle_and_not_in_the_documents_ppo_column():
    blocks = [(-1.6, 0.0, 90.0), (1.6, 0.0, 90.0), (9.0, 9.0, 0.0)]
    situation = {"pos": (0.0, 0.0), "last": 1e3, "best": 1.0, "blocks": blocks}
    assert rewarded(**situation)[0] == pytest.approx(-0.010 + 1e-5, rel=1e-3)
    assert rewarded(**situation, reward="as-documented-gail")[0] == pytest.approx(-0.010 + 1e-5, rel=1e-3)
    assert rewarded(**situation, reward="as-documented")[0] == pytest.approx(-4e-5, rel=1e-3)


def at_portal(**settings):
    task = build_task("Parking2", 1, task_settings("Parking2", settings))
    task.set_params({**QUIET, **STILL})
    task.reset(0)
    task.world.pos.numpy()[0], task.world.yaw.numpy()[0] = (-11.0, 11.45), np.radians(-45.0)
    task.step()
    return float(task.buffers.rewards.numpy()[0])


def test_row_10_through_the_portal_towards_the_target():
    assert at_portal(storey="2") == pytest.approx(0.1, abs=1e-4)
    assert at_portal(storey="2", reward="as-documented-gail") == pytest.approx(0.5, abs=1e-4)


def test_row_11_through_the_portal_away_from_the_target():
    assert at_portal(storey="1") == pytest.approx(-0.1, abs=1e-4)
    assert at_portal(storey="1", reward="as-documented-gail") == pytest.approx(-0.1, abs=1e-4)


def test_rows_are_paid_for_each_applied_action():
    once = rewarded(pos=(0.0, 2.0), best=5.0, last=9.5, params=QUIET)[0]
    held = rewarded(pos=(0.0, 2.0), best=5.0, last=9.5, params=QUIET, repeat="held")[0]
    assert held == pytest.approx(3 * once, rel=1e-3)


def test_progress_sums_to_the_way_that_was_made_and_its_end_gives_the_potential_back():
    free = {"discount": 1.0, "time_reward": 0.0, "progress_per_m": 0.1, "push_n": 800.0}
    task = build_task("Parking1", 1, task_settings("Parking1", {"reward": "progress"}))
    task.set_params(free)
    task.reset(0)
    way = float(task.world.way_m.numpy()[0])
    total = 0.0
    for _ in range(20):
        task.step()
        total += float(task.buffers.rewards.numpy()[0])
    assert total == pytest.approx(0.1 * (way - float(task.world.way_m.numpy()[0])), abs=1e-5)
    assert total > 0.1
    while not task.buffers.outcomes.numpy()[0]:
        task.step()
        total += float(task.buffers.rewards.numpy()[0])
    assert task.buffers.outcomes.numpy()[0] == Outcome.HIT_WALL
    assert total == pytest.approx(-1.0 + 0.1 * way, abs=1e-4)  # the potential after an end is 0
