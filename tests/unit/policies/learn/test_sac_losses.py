import math

import pytest
import torch
from torch import tensor

from policies.learn.sac_losses import (
    critic_losses,
    critic_targets,
    entropies,
    soft_values,
    target_entropies,
    temperature_loss,
    values_of,
)


def test_the_entropy_aimed_at_is_minus_the_dimension_and_a_fifth_of_each_branchs_greatest():
    assert target_entropies(2, [3, 2]) == pytest.approx([-2.0, 0.2 * math.log(3), 0.2 * math.log(2)])
    assert target_entropies(0, [3]) == pytest.approx([0.2 * math.log(3)])


def test_an_action_is_worth_the_sum_over_its_branches():
    values = tensor([[[1.0, 2.0, 3.0, 10.0, 20.0]], [[4.0, 5.0, 6.0, 40.0, 50.0]]])
    assert values_of(values, tensor([[2, 0]]), (3, 2)).tolist() == [[13.0], [46.0]]
    assert values_of(tensor([[[7.0]], [[8.0]]]), torch.zeros(1, 0, dtype=torch.int64), ()).tolist() == [[7.0], [8.0]]


def test_the_entropy_of_a_branch_is_exact_and_of_the_continuous_part_a_sample():
    even = tensor([[0.5, 0.5]]).log()
    assert entropies(tensor([-1.5]), [even])[0].tolist() == pytest.approx([1.5, math.log(2)])
    assert entropies(None, [tensor([[0.25, 0.75]]).log()])[0].tolist() == pytest.approx([0.562335])


def test_a_state_is_worth_the_lesser_value_and_the_entropy_by_temperature():
    sampled = soft_values(tensor([[[3.0]], [[2.0]]]), [], tensor([[1.5]]), tensor([0.2]))
    assert sampled.tolist() == pytest.approx([2.0 + 0.3])
    values = tensor([[[1.0, 5.0]], [[4.0, 2.0]]])  # least: 1, 2
    chosen = soft_values(values, [tensor([[0.25, 0.75]]).log()], tensor([[0.5]]), tensor([0.1]))
    assert chosen.tolist() == pytest.approx([0.25 * 1.0 + 0.75 * 2.0 + 0.05])


def test_nothing_is_expected_after_a_true_end():
    targets = critic_targets(tensor([1.0, 1.0]), tensor([0.0, 1.0]), tensor([10.0, 10.0]), 0.9)
    assert targets.tolist() == pytest.approx([10.0, 1.0])


def test_each_critic_pays_half_its_mean_squared_error():
    losses = critic_losses(tensor([[1.0, 2.0], [3.0, 3.0]]), tensor([0.0, 0.0]))
    assert losses.tolist() == pytest.approx([1.25, 4.5])


def test_the_temperature_falls_where_there_is_more_entropy_than_aimed_at():
    log_temperatures = tensor([0.5, -0.5], requires_grad=True)
    loss = temperature_loss(log_temperatures, tensor([[1.0, 0.2], [3.0, 0.4]]), tensor([-2.0, 0.5]))
    assert loss.item() == pytest.approx(0.5 * 4.0 - 0.5 * -0.2)
    loss.backward()
    assert log_temperatures.grad.tolist() == pytest.approx([4.0, -0.2])
