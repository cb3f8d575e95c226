"""NavigateRover: the same task on wheels, between trees and walls."""

import numpy as np
import pytest

from common.range_sectors import SECTORS
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.episode import Outcome
from policies.tasks.navigate.navigate_kernels import MEASURES

QUICK = {"has_estimator": "false"}
GOAL_AT, GOAL_BELOW, HEIGHT_VALID = 12, 16, 7  # elements of a frame


def task_of(count, params=None, name="NavigateRover"):
    task = build_task(name, count, task_settings(name, QUICK))
    task.set_params(params or {})
    task.reset(5)
    return task


def newest(task):
    return task.buffers.observations.numpy()[:, -task.layout.frame_size :]


def drive(task, fraction, decisions):
    """Drives at the goal with a fraction of the greatest action; the outcome of each row, and its measures."""
    outcomes = np.zeros(task.env_count, dtype=int)
    measures = np.zeros((task.env_count, len(MEASURES)))
    for _ in range(decisions):
        action = np.zeros((task.env_count, 4), dtype=np.float32)
        action[:, :2] = fraction * newest(task)[:, GOAL_AT : GOAL_AT + 2]
        task.buffers.continuous.assign(action)
        task.step()
        ended = (outcomes == Outcome.RUNNING) & (task.buffers.outcomes.numpy() != Outcome.RUNNING)
        outcomes[ended] = task.buffers.outcomes.numpy()[ended]
        measures[ended] = task.measures.numpy()[ended]
    return outcomes, measures


def test_what_it_sees_and_does_has_the_drones_layout():
    rover, drone = task_of(1).layout, task_of(1, name="Navigate").layout
    assert (rover.frame, rover.continuous, rover.stack) == (drone.frame, drone.continuous, drone.stack)
    assert rover.task != drone.task  # so that neither is given the other's policy


def test_on_open_ground_whoever_drives_at_the_goal_arrives():
    task = task_of(16, {"trees_per_ha": 0.0})
    task.worlds.params.numpy()["wall_count"][:] = 0  # live
    task.reset(6)
    outcomes, measures = drive(task, 0.5, 250)
    assert (outcomes == Outcome.SUCCESS).all()
    speeds = measures[:, MEASURES.index("path_m")] / measures[:, MEASURES.index("time_s")]
    assert (speeds > 2.5).all()


@pytest.mark.parametrize(("trees_per_ha", "least"), [(400.0, 0.4), (0.0, 0.1)])
def test_trees_and_walls_are_seen_and_end_a_drive_that_does_not_mind_them(trees_per_ha, least):
    task = task_of(64, {"trees_per_ha": trees_per_ha})
    assert (newest(task)[:, -SECTORS - 4 : -4] > 0.0).any(axis=1).mean() > 0.5
    outcomes, _ = drive(task, 0.5, 150)
    assert least < (outcomes == Outcome.HIT_OBSTACLE).mean() < 0.95


def test_goals_are_no_farther_than_where_something_stands():
    with pytest.raises(ValueError, match="goal_max_m"):
        task_of(1, {"goal_max_m": 85.0})


def test_neither_its_height_nor_the_goals_is_shown():
    task = task_of(16)
    drive(task, 0.3, 5)
    assert (newest(task)[:, HEIGHT_VALID] == 0.0).all()
    assert newest(task)[:, GOAL_BELOW] == pytest.approx(0.0, abs=1e-6)


def test_a_goal_that_walks_is_followed_and_not_driven_into():
    """Whoever drives at it is held back behind it, and has done well if it is there when time is up."""
    task = task_of(16, {"trees_per_ha": 0.0, "kept_m": 3.0, "walk_m_s": 1.8})
    task.worlds.params.numpy()["wall_count"][:] = 0  # live
    task.reset(6)
    speeds, outcomes = [], np.zeros(16, dtype=int)
    while (outcomes == Outcome.RUNNING).any():
        action = np.zeros((16, 4), dtype=np.float32)
        action[:, :2] = newest(task)[:, GOAL_AT : GOAL_AT + 2]
        task.buffers.continuous.assign(action)
        task.step()
        ended = (outcomes == Outcome.RUNNING) & (task.buffers.outcomes.numpy() != Outcome.RUNNING)
        outcomes[ended] = task.buffers.outcomes.numpy()[ended]
        distance_m, speed_m_s = task.measures.numpy()[outcomes == Outcome.RUNNING, :2].T
        speeds += [*speed_m_s[distance_m < 1.5]]  # a goal that turns back comes so near
    assert (outcomes == Outcome.SUCCESS).all()
    assert np.mean(speeds) < 0.3


@pytest.mark.parametrize("kept_m", [0.0, -1.0])
def test_a_goal_that_is_not_followed_stands(kept_m):
    task = task_of(8, {"trees_per_ha": 0.0, "kept_m": kept_m, "walk_m_s": 5.0})
    goals = task.navigation.goals_ned.numpy().copy()
    drive(task, 0.1, 20)
    assert (task.navigation.goals_ned.numpy() == goals).all()
