"""Teachers: what they say, and which are refused."""

import pytest
import torch

from policies.learn.algorithms.teacher import Teacher
from policies.tasks.layout import Element, LayoutError
from tests.unit.policies.learn.glimpses import PRIVILEGED, Glimpses, teacher_policy


def test_teacher_says_what_its_policy_would_do_within_bounds():
    teacher = Teacher(teacher_policy(gain=2.0), Glimpses(1).layout, "t.pt")
    actions = teacher.actions(torch.tensor([[0.25, 1.0], [0.8, 0.0]]))
    assert actions.continuous[:, 0].tolist() == pytest.approx([0.5, 1.0])


@pytest.mark.parametrize(
    ("frame", "words"),
    [
        ((PRIVILEGED[1], PRIVILEGED[0]), r"observation 0 is is_shown \(scale 1\) there and place \(scale 1\) here"),
        ((PRIVILEGED[0], Element("is_shown", "1", 2.0)), r"observation 1 is is_shown \(scale 2\) there"),
    ],
)
def test_teacher_of_other_elements_is_refused(frame, words):
    with pytest.raises(LayoutError, match=rf"t\.pt: cannot teach Glimpses as it is set: {words}"):
        Teacher(teacher_policy(frame), Glimpses(1).layout, "t.pt")


def test_task_that_shows_a_teacher_nothing_is_refused():
    task = Glimpses(1)
    bare = type(task.layout)("Glimpses", 1, task.layout.frame, continuous=task.layout.continuous)
    with pytest.raises(LayoutError, match="it shows a teacher nothing"):
        Teacher(teacher_policy(), bare, "t.pt")
