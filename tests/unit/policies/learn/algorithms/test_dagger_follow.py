"""DAgger on FollowMe itself: a small student comes to do what its teacher does, from images of a flight."""

from statistics import median

import pytest
import torch

from policies.learn.algorithms.dagger import Dagger
from policies.learn.algorithms.teacher import Teacher
from policies.learn.config.behavior import Behavior
from policies.learn.config.network import NetworkSettings
from policies.learn.networks.policy import Policy
from policies.tasks.catalogue import build_task, task_settings


@pytest.mark.slow
def test_student_of_follow_me_comes_to_do_what_its_teacher_does():
    task = build_task("FollowMe", 16, task_settings("FollowMe", {"image_size": 32}))
    observation = build_task("FollowMe", 1, task_settings("FollowMe", {"observation": "state"})).layout
    teacher = Policy(observation, NetworkSettings(hidden_units=16, num_layers=1), torch.Generator().manual_seed(2))
    network = {"hidden_units": 32, "normalize": True, "memory": {"memory_size": 32, "sequence_length": 16}}
    behavior = Behavior.model_validate(
        {
            "trainer_type": "dagger",
            "hyperparameters": {
                "teacher": "-",
                "batch_size": 128,
                "buffer_size": 8192,
                "steps_per_round": 1024,
                "learning_rate": 2e-3,
            },
            "network_settings": network | {"perceives": ["true_owner_pos_hfrd_x", "is_owner_in_view"]},
        }
    )
    student = Dagger(
        task,
        Policy(task.layout, behavior.network_settings, torch.Generator().manual_seed(1)),
        behavior,
        Teacher(teacher, task.layout, "teacher.pt"),
        seed=1,
    )
    losses = [student.iterate().statistics["Losses/Imitation Loss"] for _ in range(10)]
    assert median(losses[-5:]) < 0.4 * losses[0]  # of one round, whose episodes begin anew, it goes up and down
