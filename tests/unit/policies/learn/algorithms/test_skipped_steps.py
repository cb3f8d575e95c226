"""Steps that are no decisions, of vector environments that begin episodes by themselves: no learner may count them."""

import gymnasium
import numpy as np
import pytest
import torch
from gymnasium.envs.classic_control.cartpole import CartPoleVectorEnv
from gymnasium.vector import SyncVectorEnv

from policies.learn.algorithms.ppo import Ppo
from policies.learn.algorithms.sac import Sac
from policies.learn.config.behavior import Behavior, PpoHyperparameters, SacHyperparameters
from policies.learn.config.network import Memory, NetworkSettings
from policies.learn.evaluate import evaluate
from policies.learn.networks.policy import Policy
from policies.learn.signals.extrinsic import ExtrinsicSignal
from policies.tasks.catalogue import build_task, settings_of

NAME = "gym:CartPole-v1"
BY_ITSELF = settings_of(NAME, ["vectorization=vector_entry_point"])
WIDTH = NetworkSettings(hidden_units=32, num_layers=2, normalize=True)
RECURRENT = WIDTH.model_copy(update={"memory": Memory(memory_size=8, sequence_length=16)})


class Poisoned(CartPoleVectorEnv):
    """Shows nonsense at the ends of episodes, which is all that a step in between is decided on."""

    nonsense = 0.0

    def step(self, actions):
        seen, *others = super().step(actions)
        seen[self.prev_done] += self.nonsense
        return seen, *others


@pytest.fixture
def poisoned():
    gymnasium.register("Poisoned-v0", vector_entry_point=Poisoned)
    yield "gym:Poisoned-v0"
    gymnasium.registry.pop("Poisoned-v0")
    Poisoned.nonsense = 0.0


def ppo(name, settings, network=WIDTH, envs=8, seed=1, **params):
    params = {"batch_size": 64, "buffer_size": 512, "learning_rate": 1e-3, **params}
    behavior = Behavior(hyperparameters=PpoHyperparameters(**params), network_settings=network, max_steps=60_000)
    task = build_task(name, envs, settings)
    policy = Policy(task.layout, network, torch.Generator().manual_seed(seed))
    return Ppo(task, policy, behavior, [ExtrinsicSignal(gamma=0.98)], seed=seed)


def sac(name, settings, envs=4, seed=1):
    params = {"batch_size": 64, "buffer_size": 4000, "buffer_init_steps": 500, "steps_per_update": 4}
    behavior = Behavior(
        trainer_type="sac", hyperparameters=SacHyperparameters(**params), network_settings=WIDTH, max_steps=60_000
    )
    task = build_task(name, envs, settings)
    policy = Policy(task.layout, WIDTH, torch.Generator().manual_seed(seed), is_squashed=True)
    return Sac(task, policy, behavior, [ExtrinsicSignal(gamma=0.98)], seed=seed)


@pytest.mark.parametrize("network", [WIDTH, RECURRENT], ids=["feed-forward", "recurrent"])
def test_ppo_learns_nothing_from_what_such_a_step_is_decided_on(poisoned, network):
    """Ends are terminations, whose last observation has no value either: no weight may depend on the nonsense."""
    weights = []
    for nonsense in (0.0, 100.0):
        Poisoned.nonsense = nonsense
        learner = ppo(poisoned, None, network, normalize_returns=True)
        for _ in range(3):
            learner.iterate()
        weights.append(torch.cat([p.flatten() for p in [*learner.policy.parameters(), *learner.critic.parameters()]]))
        assert learner.task.task.buffers.episodes.numpy().min() > 3
    assert torch.equal(*weights)


def test_sac_learns_nothing_from_what_such_a_step_is_decided_on(poisoned):
    Poisoned.nonsense = 1000.0
    learner = sac(poisoned, None)
    learner.iterate()
    batch = learner.replay.take(learner.replay.draw(5000, torch.Generator().manual_seed(1)))
    assert (batch.observations.abs() < 100.0).all()
    is_end = batch.is_terminated > 0.0
    assert 0 < is_end.sum() < 1000
    assert ((batch.next_observations.abs() > 100.0).all(1) == is_end).all()
    assert (batch.rewards == 1.0).all()


@pytest.mark.parametrize("make", [ppo, sac])
def test_decisions_are_counted_and_no_others(make):
    """CartPole pays 1 for each decision: the sum of all returns is the count."""
    learner = make(NAME, BY_ITSELF)
    scores, steps = [], 0
    for _ in range(2):
        iteration = learner.iterate()
        steps += iteration.steps
        scores.append(iteration.scores)
    buffers = learner.task.task.buffers
    paid = sum(each.return_sum for each in scores) + buffers.returns.numpy().sum()
    assert learner.steps == steps == paid
    assert sum(each.length_sum for each in scores) + buffers.steps.numpy().sum() == steps


@pytest.mark.parametrize("network", [WIDTH, RECURRENT], ids=["feed-forward", "recurrent"])
def test_an_evaluation_is_that_of_environments_that_are_reset(network):
    several = "SeveralCartPole-v1"
    gymnasium.register(
        several, vector_entry_point=lambda num_envs: SyncVectorEnv([lambda: gymnasium.make("CartPole-v1")] * num_envs)
    )
    try:
        layout = build_task(NAME, 1).layout
        judged = []
        for name in (NAME, f"gym:{several}"):
            task = build_task(name, 1)
            assert task.layout.frame == layout.frame
            policy = Policy(task.layout, network, torch.Generator().manual_seed(3))
            judged.append(evaluate(policy, name, settings_of(name, []), episodes=600, seed=5))
    finally:
        gymnasium.registry.pop(several)
    assert judged[0] == judged[1]
    assert judged[0].episodes == 600
    assert judged[0].mean_return == judged[0].mean_length > 5.0


def test_ppo_goes_on_where_all_have_just_ended():
    """Episodes of one decision, and a round of one: every other round decides nothing."""
    settings = settings_of(NAME, ["vectorization=vector_entry_point", "max_episode_steps=1"])
    learner = ppo(NAME, settings, envs=4, buffer_size=4, batch_size=4)
    counts = [learner.iterate() for _ in range(5)]
    assert [iteration.steps for iteration in counts] == [4] * 5
    assert sum(iteration.scores.episode_count for iteration in counts) == 20
    assert all(np.isfinite(p.detach().numpy()).all() for p in learner.policy.parameters())


def test_a_run_that_is_resumed_draws_the_same_transitions():
    one, two = sac(NAME, BY_ITSELF), sac(NAME, BY_ITSELF, seed=2)
    one.iterate()
    two.replay.load_state(one.replay.state())
    drawn = [each.replay.draw(500, torch.Generator().manual_seed(1)) for each in (one, two)]
    assert torch.equal(*drawn)


def test_ppo_learns_to_balance_gymnasiums_own_vector_environment():
    """30,000 decisions of each of two seeds."""
    for seed in (1, 2):
        learner = ppo(NAME, BY_ITSELF, envs=16, seed=seed, buffer_size=2048, batch_size=256, num_epoch=8)
        before = evaluate(learner.policy, NAME, BY_ITSELF, episodes=100, seed=9, is_greedy=False).mean_return
        while learner.steps < 30_000:
            learner.iterate()
        after = evaluate(learner.policy, NAME, BY_ITSELF, episodes=100, seed=9, is_greedy=False).mean_return
        assert before < 40.0
        assert after > 100.0
