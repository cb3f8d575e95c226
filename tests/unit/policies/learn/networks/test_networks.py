import math

import pytest
import torch

from policies.learn.config.network import Memory, NetworkSettings
from policies.learn.networks.hyper_network import HyperDense
from policies.learn.networks.lstm import Recurrence
from policies.learn.networks.networks import Body, Critic
from policies.learn.networks.policy import Policy
from policies.tasks.layout import Branch, Element, Layout

LAYOUT = Layout(
    "Made up",
    1,
    frame=(Element("place_x", "m"), Element("place_z", "m"), Element("goal_x", "m", is_goal=True)),
    continuous=(Element("push", "1"),),
    branches=(Branch("gear", ("back", "stay", "forward")),),
)


def generator(seed=0):
    return torch.Generator().manual_seed(seed)


def observations(*shape):
    return torch.randn(*shape, 3, generator=generator(7))


def policy(**settings):
    return Policy(LAYOUT, NetworkSettings(hidden_units=16, **settings), generator())


def test_a_row_does_not_depend_on_the_others():
    acting = policy(normalize=True)
    observation = observations(50)
    together, _ = acting.act(observation, acting.start_memory(50))
    for i in range(0, 50, 7):
        alone, _ = acting.act(observation[i : i + 1], acting.start_memory(1))
        assert torch.allclose(alone.continuous[0], together.continuous[i], atol=1e-6)
        assert torch.equal(alone.branches[0], together.branches[i])


def test_permuting_rows_permutes_actions():
    acting = policy(memory=Memory(sequence_length=8, memory_size=12))
    observation, order = observations(20), torch.randperm(20, generator=generator())
    memory = torch.randn(20, 12, generator=generator(1))
    actions, after = acting.act(observation, memory)
    permuted, permuted_after = acting.act(observation[order], memory[order])
    assert torch.allclose(actions.continuous[order], permuted.continuous, atol=1e-6)
    assert torch.allclose(after[order], permuted_after, atol=1e-6)


@pytest.mark.parametrize("share_of_starts", [0.0, 0.1, 0.5, 1.0])
def test_whole_sequences_give_what_steps_give(share_of_starts):
    recurrence = Recurrence(4, 10, generator())
    inputs = torch.randn(12, 6, 4, generator=generator(1))
    is_start = torch.rand(12, 6, generator=generator(2)) < share_of_starts
    memory = torch.randn(6, 10, generator=generator(3))
    whole = recurrence(inputs, memory, is_start)
    for t in range(12):
        memory = memory.masked_fill(is_start[t][:, None], 0.0)
        step, memory = recurrence.step(inputs[t], memory)
        assert torch.allclose(whole[t], step, atol=1e-6)


def test_gradients_stop_where_episodes_start():
    recurrence = Recurrence(4, 10, generator())
    inputs = torch.randn(6, 2, 4, generator=generator(1)).requires_grad_()
    is_start = torch.zeros(6, 2, dtype=torch.bool)
    is_start[3, 0] = True
    recurrence(inputs, torch.zeros(2, 10), is_start)[5].sum().backward()
    assert inputs.grad[:3, 0].abs().max() == 0.0
    assert inputs.grad[3:, 0].abs().min() > 0.0
    assert inputs.grad[:, 1].abs().min() > 0.0


def test_the_lstm_starts_as_ml_agents_does():
    lstm = Recurrence(30, 40, generator()).lstm
    for bias in (lstm.bias_ih_l0, lstm.bias_hh_l0):
        assert bias.view(4, 20).sum(1).tolist() == [0.0, 20.0, 0.0, 0.0]  # 1 in the forget gate
    bound = math.sqrt(6.0 / (30 + 20))
    assert 0.9 * bound < lstm.weight_ih_l0.abs().max() <= bound


def test_the_weights_of_a_hyper_layer_come_from_the_goal():
    layer = HyperDense(4, 5, 2, generator())
    activations = torch.randn(3, 4, generator=generator(1))
    goals = torch.tensor([[1.0, 0.0], [1.0, 0.0], [0.0, 3.0]])
    given = layer(activations, goals)
    # linear in the activations for a fixed goal
    assert torch.allclose(layer(2.0 * activations, goals), 2.0 * given, atol=1e-6)
    assert torch.allclose(layer(activations[:1], goals[1:2]), given[:1], atol=1e-6)
    assert not torch.allclose(layer(activations[:1], goals[2:]), given[:1], atol=1e-3)
    bound = math.sqrt(1.0 / (5 * 4))
    assert 0.8 * bound < layer.weights.weight.abs().max() <= bound


def test_goals_drive_a_hyper_network_only_where_they_are_declared_a_signal():
    assert policy().body.hyper is None
    assert policy(goal_signal=True, goal_conditioning_type="none").body.hyper is None
    conditioned = policy(goal_signal=True).body
    assert conditioned.goal_indices == [2]
    assert conditioned(observations(4)).shape == (4, 16)
    assert len(conditioned.layers) == 1  # the last of two is the hyper-network


def test_bodies_start_with_kaiming_normal_weights():
    body = Body(400, NetworkSettings(hidden_units=300, num_layers=3), generator())
    assert [layer.weight.shape for layer in body.layers] == [(300, 400), (300, 300), (300, 300)]
    assert body.layers[0].weight.std().item() == pytest.approx(1.0 / math.sqrt(400), rel=0.02)
    assert body.layers[0].bias.abs().max() == 0.0


def test_weights_depend_on_the_seed_and_on_nothing_else():
    def first(seed):
        return Policy(LAYOUT, NetworkSettings(), generator(seed)).body.layers[0].weight

    torch.rand(3)  # the global generator plays no part
    assert torch.equal(first(1), first(1))
    assert not torch.equal(first(1), first(2))


def test_a_critic_that_normalizes_estimates_in_the_unit_of_the_rewards():
    critic = Critic(Body(3, NetworkSettings(hidden_units=8), generator()), 2, generator(), normalizes=True)
    returns = torch.tensor([[100.0, 1.0], [300.0, 3.0], [200.0, 2.0]]).repeat(100, 1)
    critic.normalizer.update(returns)
    estimates = critic(observations(5))
    outputs = critic.heads(critic.body(observations(5)))
    assert torch.allclose(critic.own_unit(estimates), outputs, atol=1e-4)
    assert torch.allclose(critic.own_unit(torch.tensor([200.0, 2.0])), torch.zeros(2), atol=0.1)
