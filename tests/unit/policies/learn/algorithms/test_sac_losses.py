import math

import pytest
import torch
from torch import tensor

from policies.learn.algorithms.sac_losses import (
    action_values,
    critic_losses,
    critic_targets,
    entropies,
    expected_values,
    policy_loss,
    target_entropies,
    temperature_loss,
)

NO_DIMENSIONS = torch.zeros(1, 0)
NO_CHOICES = torch.zeros(1, 0, 1)
TWO_BRANCHES = tensor([[[[0.5, 1.0, 2.0, 10.0, 20.0]]], [[[0.25, 4.0, 5.0, 40.0, 50.0]]]])  # two critics, one row


def test_the_entropy_aimed_at_is_minus_the_dimension_and_a_fifth_of_each_branchs_greatest():
    assert target_entropies(2, [3, 2]) == pytest.approx([-2.0, 0.2 * math.log(3), 0.2 * math.log(2)])
    assert target_entropies(0, [3]) == pytest.approx([0.2 * math.log(3)])


def test_an_action_is_worth_its_base_and_the_values_of_its_choices():
    assert action_values(TWO_BRANCHES, tensor([[1, 0]])).tolist() == [[[12.5]], [[45.25]]]
    assert action_values(tensor([[[[7.0]]], [[[8.0]]]]), torch.zeros(1, 0, dtype=torch.int64)).flatten().tolist() == [
        7,
        8,
    ]


def test_the_entropy_of_a_branch_is_exact_and_of_the_continuous_part_a_sample():
    even = tensor([[[0.5, 0.5]]]).log()
    assert entropies(tensor([[-1.5, 0.25]]), even)[0].tolist() == pytest.approx([1.25, math.log(2)])
    assert entropies(NO_DIMENSIONS, tensor([[[0.25, 0.75]]]).log())[0].tolist() == pytest.approx([0.562335])
    assert entropies(tensor([[2.0]]), NO_CHOICES).tolist() == [[-2.0]]


def test_choices_that_a_smaller_branch_does_not_have_count_for_nothing():
    padded = tensor([[[0.0, -1e8]]])
    assert entropies(NO_DIMENSIONS, padded).tolist() == [[0.0]]
    assert expected_values(tensor([[[[1.0, 2.0, 1000.0]]]]), padded).tolist() == [[3.0]]


def test_the_policy_expects_what_the_lesser_critic_says():
    assert expected_values(tensor([[[[3.0], [1.0]]], [[[2.0], [4.0]]]]), NO_CHOICES).tolist() == [[2.0, 1.0]]
    log_probs = tensor([[[0.25, 0.75], [0.5, 0.5]]]).log()
    first = 0.5 + 0.25 * 1.0 + 0.75 * 2.0 + 0.5 * 30.0
    assert expected_values(TWO_BRANCHES, log_probs).tolist() == [pytest.approx([first])]


def test_nothing_is_expected_after_a_true_end():
    rewards, goes_on = tensor([[1.0, 0.0], [1.0, 0.0]]), tensor([[1.0, 1.0], [0.0, 1.0]])
    targets = critic_targets(rewards, goes_on, torch.full((2, 2), 10.0), tensor([0.9, 0.5]))
    assert targets.tolist() == [[10.0, 5.0], [1.0, 5.0]]


def test_each_critic_pays_half_its_mean_squared_error():
    losses = critic_losses(tensor([[[1.0], [2.0]], [[3.0], [3.0]]]), tensor([[0.0], [0.0]]))
    assert losses.tolist() == pytest.approx([1.25, 4.5])


def test_the_policy_is_paid_for_values_and_for_entropy():
    loss = policy_loss(tensor([[1.0, 2.0], [3.0, 0.0]]), tensor([[1.0, 0.5], [3.0, 0.5]]), tensor([0.1, 1.0]))
    assert loss.item() == pytest.approx(-(3.0 + 0.2 + 0.5))


def test_the_temperature_falls_where_there_is_more_entropy_than_aimed_at():
    log_temperatures = tensor([0.5, -0.5], requires_grad=True)
    loss = temperature_loss(log_temperatures, tensor([[1.0, 0.2], [3.0, 0.4]]), tensor([-2.0, 0.5]))
    assert loss.item() == pytest.approx(0.5 * 4.0 - 0.5 * -0.2)
    loss.backward()
    assert log_temperatures.grad.tolist() == pytest.approx([4.0, -0.2])
