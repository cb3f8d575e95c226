"""ReachTarget's expert where a pose is asked for."""

import numpy as np
import pytest

from policies.experts.catalogue import build_expert
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.episode import Outcome


def test_pose_is_reached_from_anywhere():
    task = build_task("ReachTarget", 32, task_settings("ReachTarget", {"preset": "improved"}))
    expert = build_expert("ReachTarget")
    task.reset(4)
    firsts = np.zeros(32, dtype=int)
    for _ in range(180):
        expert.act(task)
        task.step()
        firsts = np.where(firsts == Outcome.RUNNING, task.buffers.outcomes.numpy(), firsts)
    assert (firsts == Outcome.SUCCESS).all()


def test_without_a_pose_the_target_is_pursued():
    task = build_task("ReachTarget", 8)
    expert = build_expert("ReachTarget")
    task.reset(4)
    for _ in range(200):
        expert.act(task)
        task.step()
    assert task.take_scores().count(Outcome.SUCCESS) >= 8


def test_expert_of_another_task_is_refused():
    with pytest.raises(TypeError, match="RollerBall is not ReachTarget"):
        build_expert("ReachTarget").act(build_task("RollerBall", 1))
