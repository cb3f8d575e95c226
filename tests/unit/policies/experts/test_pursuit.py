import pytest

from policies.experts.catalogue import build_expert
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.episode import Outcome
from policies.tasks.task_params import Sampler


@pytest.mark.parametrize("observation", ["world", "ego"])
def test_pursuit_reaches_nearly_every_target_whatever_the_policy_would_see(observation):
    task = build_task("ReachTarget", 256, task_settings("ReachTarget", {"observation": observation}))
    task.reset(3)
    expert = build_expert("ReachTarget")
    for _ in range(400):
        expert.act(task)
        task.step()
    scores = task.take_scores()
    assert scores.count(Outcome.SUCCESS) > 2000
    assert scores.count(Outcome.SUCCESS) > 0.98 * scores.episode_count


def test_pursuit_drives_on_from_target_to_target_where_reaching_ends_nothing():
    task = build_task("ReachTarget", 64, task_settings("ReachTarget", {"preset": "as-documented"}))
    task.reset(3)
    expert = build_expert("ReachTarget")
    for _ in range(200):
        expert.act(task)
        task.step()
    scores = task.take_scores()
    assert scores.count(Outcome.FELL) <= 1
    assert scores.return_sum / scores.episode_count > 3.0  # targets


def test_pursuit_copes_with_other_cars():
    task = build_task("ReachTarget", 256)
    task.set_params(
        {
            "mass_kg": Sampler(intervals=((1000.0, 1600.0),)),
            "side_stiffness": Sampler(intervals=((0.8, 1.2),)),
            "steer_max_deg": Sampler(intervals=((20.0, 30.0),)),
            "motor_torque_nm": Sampler(intervals=((1000.0, 2000.0),)),
        }
    )
    task.reset(3)
    expert = build_expert("ReachTarget")
    for _ in range(400):
        expert.act(task)
        task.step()
    scores = task.take_scores()
    assert scores.count(Outcome.SUCCESS) > 0.95 * scores.episode_count
