"""DAgger: who drives, what is learnt, and that a restored run goes on with the same bits."""

import pytest
import torch

from policies.learn.algorithms.dagger import Dagger
from policies.learn.algorithms.teacher import Teacher
from policies.learn.config.behavior import Behavior
from policies.learn.export.policy_file import policy_of, policy_record
from policies.learn.networks.policy import Policy
from tests.unit.policies.learn.algorithms.test_sac import flat
from tests.unit.policies.learn.glimpses import Glimpses, teacher_policy

SIZES = {"batch_size": 64, "buffer_size": 4096, "steps_per_round": 512, "learning_rate": 2e-3}
NETWORK = {
    "hidden_units": 32,
    "num_layers": 1,
    "memory": {"memory_size": 32, "sequence_length": 8},
    "perceives": ["place", "is_shown"],
}


def learner(task, *, teacher=None, network=(), seed=1, **hyperparameters):
    behavior = Behavior.model_validate(
        {
            "trainer_type": "dagger",
            "hyperparameters": {"teacher": "-", **SIZES, **hyperparameters},
            "network_settings": NETWORK | dict(network),
        }
    )
    policy = Policy(task.layout, behavior.network_settings, torch.Generator().manual_seed(seed))
    taught_by = Teacher(teacher or teacher_policy(), task.layout, "teacher.pt")
    return Dagger(task, policy, behavior, taught_by, seed=seed)


def mean_reward(task, policy, episodes=256):
    """Of the most probable actions, per decision."""
    student = learner(task)
    memory = policy.start_memory(task.env_count)
    rewards = []
    with torch.inference_mode():
        for _ in range(4 * episodes // task.env_count):
            actions, memory = policy.act(student.task.observation, memory)
            student.task.step(policy.bounded(actions), actions.branches)
            memory = memory.masked_fill(student.task.is_truncated[:, None], 0.0)
            rewards.append(student.task.rewards.mean().item())
    return sum(rewards) / len(rewards)


MEMORIES = {
    "lstm": NETWORK["memory"],
    "transformer": {"memory_type": "transformer", "sequence_length": 6, "layers": 1, "heads": 2},  # episodes are of 4
}


@pytest.fixture(scope="module", params=MEMORIES)
def trained(request):
    """A student that has learnt."""
    student = learner(Glimpses(32), network={"memory": MEMORIES[request.param]}, perception_strength=0.5)
    while student.steps < 14_000:
        student.iterate()
    return student


def test_student_learns_to_see_and_to_remember(trained):
    assert mean_reward(Glimpses(32), trained.policy) > -0.1  # -0.4 for who points ahead


def test_beliefs_are_learnt_and_as_sure_as_they_are_right(trained):
    policy, task = trained.policy, trained.task
    task.task.reset(7)
    memory = policy.start_memory(32)
    with torch.inference_mode():
        for t in range(4):
            place = task.privileged[:, 0].clone()
            actions, memory, beliefs = policy.act_and_believe(task.observation, memory)
            assert (beliefs.means[:, 0] - place).abs().mean() < 0.15
            assert ((beliefs.means[:, 1] > 0.5) == (t == 0)).all()
            assert 0.02 < beliefs.sigmas[:, 0].mean() < 0.4
            task.step(policy.bounded(actions), actions.branches)


def test_teacher_drives_all_environments_first_and_ever_fewer_later():
    student = learner(Glimpses(32), mixing=0.5)
    fractions = [student.iterate().statistics["Policy/Teacher Share"] for _ in range(3)]
    assert fractions == [1.0, 0.5, 0.25]


def test_what_the_teacher_drives_costs_nothing():
    student = learner(Glimpses(32), mixing=1.0)
    scores = student.iterate().scores
    assert scores.return_sum / scores.episode_count == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize("memory", [*MEMORIES.values(), None], ids=[*MEMORIES, "feed-forward"])
def test_a_restored_learner_goes_on_bit_for_bit(memory):
    network = {"memory": memory}
    one = learner(Glimpses(16), network=network, save_replay_buffer=True)
    one.iterate()
    state = one.state()
    ends = [flat(one.iterate().statistics), flat(one.state())]
    other = learner(Glimpses(16), network=network, save_replay_buffer=True, seed=9)
    other.load_state(state)
    assert [flat(other.iterate().statistics), flat(other.state())] == ends


def test_a_restored_learner_without_its_ring_fills_it_anew():
    one = learner(Glimpses(16))
    one.iterate()
    other = learner(Glimpses(16), seed=9)
    other.load_state(one.state())
    assert len(other.ring) == 0
    assert other.iterate().steps == 512


def test_the_teacher_is_not_changed():
    policy = teacher_policy()
    before = flat(policy.state_dict())
    learner(Glimpses(16), teacher=policy).iterate()
    assert flat(policy.state_dict()) == before


def test_deviation_is_fitted_to_the_students_error():
    student = learner(Glimpses(16))
    for _ in range(6):
        student.iterate()
    sigma = student.policy.heads.log_sigma.exp().item()
    assert 0.09 < sigma < 0.8


def test_beliefs_are_saved_with_the_policy():
    policy = learner(Glimpses(16)).policy
    again = policy_of(policy_record(policy), "there")
    assert again.perception.names == ("place", "is_shown")
    assert flat(again.state_dict()) == flat(policy.state_dict())
