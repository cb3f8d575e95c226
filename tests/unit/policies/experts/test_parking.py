"""The parking experts reach their spots in every preset, and leave no other trace in the task than their actions."""

import numpy as np
import pytest

from policies.experts.catalogue import build_expert
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.episode import Outcome


def first_outcomes(name, count, seed, longest, **settings):
    """How the first episode of every row ends."""
    task = build_task(name, count, task_settings(name, settings))
    expert = build_expert(name)
    task.reset(seed)
    firsts = np.zeros(count, dtype=int)
    for _ in range(longest):
        expert.act(task)
        task.step()
        firsts = np.where(firsts == Outcome.RUNNING, task.buffers.outcomes.numpy(), firsts)
        if firsts.all():
            break
    return firsts


@pytest.mark.parametrize(
    ("name", "count", "longest", "settings"),
    [
        ("Parking1", 8, 200, {"preset": "as-coded"}),
        ("Parking1", 32, 300, {"preset": "as-coded", "goals": "anywhere", "resets": "clean"}),
        ("Parking1", 8, 200, {"preset": "as-documented"}),
        ("Parking1", 16, 500, {"preset": "improved"}),
        ("Parking2", 16, 600, {"preset": "as-coded"}),
        ("Parking2", 16, 600, {"preset": "as-coded", "goals": "anywhere", "storey": "both", "resets": "clean"}),
        ("Parking2", 8, 600, {"preset": "as-documented"}),
        ("Parking2", 8, 800, {"preset": "improved"}),
    ],
)
def test_expert_parks(name, count, longest, settings):
    assert (first_outcomes(name, count, 1, longest, **settings) == Outcome.SUCCESS).all()


def test_second_episode_is_planned_anew():
    task = build_task("Parking1", 4, task_settings("Parking1", {"goals": "anywhere", "resets": "clean"}))
    expert = build_expert("Parking1")
    task.reset(2)
    for _ in range(500):
        expert.act(task)
        task.step()
    scores = task.take_scores()
    assert scores.count(Outcome.SUCCESS) == scores.episode_count > 8


def test_expert_only_acts():
    task = build_task("Parking2", 3, task_settings("Parking2", {}))
    task.reset(0)
    before = task.state()
    build_expert("Parking2").act(task)
    after = task.state()
    assert [name for name in before if (before[name] != after[name]).any()] in ([], ["branches"])


def test_expert_of_another_task_is_refused():
    with pytest.raises(TypeError, match="Parking2 is not Parking1"):
        build_expert("Parking1").act(build_task("Parking2", 1))
