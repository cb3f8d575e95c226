import numpy as np
import pytest
import torch

from policies.experts.catalogue import build_expert
from policies.experts.episode_recording import record_episodes
from policies.learn.algorithms.behavioural_cloning import Cloning, clone
from policies.learn.config.behavior import BehavioralCloning
from policies.learn.config.network import NetworkSettings
from policies.learn.networks.policy import Policy
from policies.learn.signals.signal import Transitions
from policies.tasks.catalogue import build_task
from policies.tasks.episode import Outcome
from tests.unit.policies.learn.signals.transitions import PUSHED, STEERED, drawn


def policy(layout, seed=0, **settings):
    network = NetworkSettings(**{"hidden_units": 64, "num_layers": 2} | settings)
    return Policy(layout, network, torch.Generator().manual_seed(seed))


def cloning(learner, demonstrations, rates=(1e-3, 64, 3), seed=0, **settings):
    return Cloning(learner, BehavioralCloning(demo_path="unused", **settings), demonstrations, rates, seed)


def linear_expert(seed=0, count=4096):
    rows = drawn(PUSHED, (count,), seed)
    rows.continuous.copy_((rows.observations @ torch.tensor([[-0.3, 0.1], [0.2, -0.4]])).clamp(-1.0, 1.0))
    return rows


def test_a_linear_expert_is_cloned():
    learner = policy(PUSHED)
    losses = clone(learner, linear_expert(), torch.Generator().manual_seed(0), epoch_count=30, batch_size=256)
    assert losses[-1] < 0.02 * losses[0]
    unseen = linear_expert(seed=1, count=256)
    done = learner.bounded(learner(unseen.observations).mode())
    assert (done - unseen.continuous).abs().mean() < 0.03


def test_choices_are_cloned():
    learner = policy(STEERED)
    rows = drawn(STEERED, (4096,))
    rows.branches[:, 0] = 1 + (rows.observations[:, 0] > 0).long()
    rows.branches[:, 1] = (rows.observations[:, 1] > 0).long()
    clone(learner, rows, torch.Generator().manual_seed(0), epoch_count=20, batch_size=256)
    chosen = learner(rows.observations).mode().branches
    assert (chosen == rows.branches).float().mean() > 0.97


def test_what_came_before_is_cloned_by_a_recurrent_policy():
    learner = policy(STEERED, memory={"sequence_length": 16, "memory_size": 32})
    rows = drawn(STEERED, (8192,))
    rows.is_ended[:] = torch.arange(8192) % 8 == 7
    is_right = rows.observations[:, 0] > 0
    before = torch.cat([is_right[:1], is_right[:-1]])
    before[0::8] = False  # an episode does not remember the last one
    rows.branches[:] = before[:, None].long()
    losses = clone(learner, rows, torch.Generator().manual_seed(0), epoch_count=40, batch_size=512, learning_rate=3e-3)
    assert losses[-1] < 0.1 * losses[0]


def test_an_expert_of_roller_ball_is_cloned_to_its_success():
    task = build_task("RollerBall", 64)
    episodes = record_episodes(task, build_expert("RollerBall"), 64, seed=1)
    columns = [
        np.concatenate([e.observations[:-1] for e in episodes]),
        np.concatenate([e.observations[1:] for e in episodes]),
        np.concatenate([e.continuous for e in episodes]),
        np.concatenate([e.branches for e in episodes]),
        np.concatenate([e.rewards for e in episodes]),
    ]
    rows = Transitions(*map(torch.from_numpy, columns), torch.zeros(len(columns[0]), dtype=torch.bool))
    learner = policy(task.layout, normalize=True)
    clone(learner, rows, torch.Generator().manual_seed(0), epoch_count=60, batch_size=128, learning_rate=3e-3)
    task.reset(2)
    for _ in range(100):
        with torch.inference_mode():
            actions = learner(torch.from_numpy(task.buffers.observations.numpy())).mode()
        task.buffers.continuous.numpy()[:] = learner.bounded(actions).numpy()
        task.step()
    scores = task.take_scores()
    assert scores.count(Outcome.SUCCESS) > 0.95 * scores.episode_count > 60


def test_the_learning_rate_falls_to_nothing_over_its_steps():
    learner = policy(PUSHED)
    pretraining = cloning(learner, linear_expert(), steps=1000, strength=0.5)
    assert pretraining.update(250)["Losses/Pretraining Loss"] > 0
    assert pretraining.state()["optimizer"]["param_groups"][0]["lr"] == pytest.approx(0.75 * 0.5e-3)
    before = [parameter.clone() for parameter in learner.parameters()]
    assert pretraining.update(1000) == {"Losses/Pretraining Loss": 0.0}
    assert all(torch.equal(a, b) for a, b in zip(before, learner.parameters(), strict=True))


def test_without_steps_the_learning_rate_stays():
    pretraining = cloning(policy(PUSHED), linear_expert())
    first = pretraining.update(0)["Losses/Pretraining Loss"]
    assert pretraining.update(10**9)["Losses/Pretraining Loss"] < first


def test_samples_per_update_bounds_the_batches_of_an_epoch():
    pretraining = cloning(policy(PUSHED), linear_expert(), samples_per_update=128, num_epoch=2, batch_size=32)
    pretraining.update(0)
    assert pretraining.state()["optimizer"]["state"][0]["step"] == 2 * 4


def test_restored_cloning_continues_bit_for_bit():
    learners = [policy(PUSHED), policy(PUSHED, seed=5)]
    first, second = (cloning(learner, linear_expert(), steps=1000, seed=k) for k, learner in enumerate(learners))
    first.update(0)
    learners[1].load_state_dict(learners[0].state_dict())
    second.load_state(first.state())
    assert first.update(100) == second.update(100)
    assert all(torch.equal(a, b) for a, b in zip(*(learner.parameters() for learner in learners), strict=True))
