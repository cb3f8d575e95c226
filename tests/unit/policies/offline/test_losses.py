"""Each loss against values worked out by hand."""

import math

import pytest
import torch

from policies.offline import losses
from policies.offline.scores import normalized_score


def t(*values):
    return torch.tensor(values, dtype=torch.float64)


def test_expectile_loss_weighs_what_is_above_by_the_expectile():
    # 0.7 x 2^2 = 2.8, 0.3 x 1^2 = 0.3, nothing at 0
    assert losses.expectile_loss(t(2.0, -1.0, 0.0), 0.7).item() == pytest.approx((2.8 + 0.3) / 3)
    assert losses.expectile_loss(t(2.0, -1.0), 0.5).item() == pytest.approx(0.5 * 2.5)


def test_td_targets_stop_at_true_ends_only():
    got = losses.td_targets(t(1.0, 2.0), t(0.0, 1.0), t(10.0, 10.0), 0.9)
    assert got.tolist() == pytest.approx([10.0, 2.0])


def test_td_loss_sums_the_critics_mean_squares():
    values, targets = torch.stack((t(1.0, 3.0), t(0.0, 0.0))), t(1.0, 1.0)
    assert losses.td_loss(values, targets).item() == pytest.approx((0 + 4) / 2 + (1 + 1) / 2)


def test_advantages_count_exponentially_up_to_a_limit():
    got = losses.advantage_weights(t(0.0, 1.0, -1.0, 5.0), 2.0, 100.0)
    assert got.tolist() == pytest.approx([1.0, math.exp(2.0), math.exp(-2.0), 100.0])


def test_clipped_actions_are_as_likely_as_all_that_was_clipped():
    """Half of a Gaussian around a bound lies beyond it; density inside and both tails come to one."""
    assert losses.clipped_log_probs(t(1.0), t(-1.0), t(1.0)).exp().item() == pytest.approx(0.5)
    assert losses.clipped_log_probs(t(-1.0), t(-1.0), t(-1.0)).exp().item() == pytest.approx(0.5)
    mean, log_deviation, inside = t(0.4), t(-0.5), torch.linspace(-1.0, 1.0, 2003, dtype=torch.float64)[1:-1]
    density = losses.clipped_log_probs(mean.expand(2001, 1), log_deviation, inside[:, None]).exp()
    tails = sum(losses.clipped_log_probs(mean, log_deviation, t(bound)).exp().item() for bound in (-1.0, 1.0))
    assert density.sum().item() * 2.0 / 2002 + tails == pytest.approx(1.0, abs=1e-3)


def test_gaussian_log_probs_are_summed_over_the_actions():
    # Deviations 1 and 2; off by 1 and by 2, one deviation each: -0.5 - ln s - 0.5 ln 2 pi
    got = losses.gaussian_log_probs(t(0.0, 0.0), t(0.0, math.log(2.0)), t(1.0, 2.0))
    assert got.item() == pytest.approx(2 * (-0.5 - 0.5 * math.log(2 * math.pi)) - math.log(2.0))


def test_choices_add_their_log_probabilities():
    logs = torch.log(torch.tensor([[[0.5, 0.5], [0.25, 0.75]]]))
    assert losses.choice_log_probs(logs, torch.tensor([[0, 1]])).item() == pytest.approx(math.log(0.5 * 0.75))


def test_weighted_cloning_counts_each_action_by_its_weight():
    assert losses.weighted_cloning_loss(t(-1.0, -3.0), t(2.0, 0.5)).item() == pytest.approx((2.0 + 1.5) / 2)


def test_td3_bc_brings_the_critics_to_size_alpha():
    values = t(2.0, -6.0).requires_grad_()
    actions, recorded = t(0.5, 0.0)[:, None], t(0.0, 1.0)[:, None]
    loss = losses.td3_bc_policy_loss(values, actions, recorded, 2.0)
    # mean square 0.625; mean size of the values 4, so the scale is 0.5; mean value -2
    assert loss.item() == pytest.approx(0.625 + 0.5 * 2.0)
    (slope,) = torch.autograd.grad(loss, values)
    assert slope.tolist() == pytest.approx([-0.25, -0.25])  # the size itself has none


def test_a_mixture_adds_the_probabilities_of_its_components():
    logs = torch.log(t(0.25, 0.75))
    got = losses.mixture_log_probs(logs, t(0.0, 1.0)[:, None], torch.zeros(2, 1, dtype=torch.float64), t(0.0))
    peak = 1 / math.sqrt(2 * math.pi)
    assert got.item() == pytest.approx(math.log(0.25 * peak + 0.75 * peak * math.exp(-0.5)))
    alone = losses.mixture_log_probs(torch.zeros(1).double(), t(0.3)[:, None], torch.zeros(1, 1).double(), t(0.5))
    assert alone.item() == pytest.approx(losses.gaussian_log_probs(t(0.3), t(0.0), t(0.5)).item())


def test_scores_run_from_random_actions_to_the_expert():
    assert normalized_score(10.0, (10.0, 30.0)) == 0.0
    assert normalized_score(30.0, (10.0, 30.0)) == 100.0
    assert normalized_score(-10.0, (-20.0, 0.0)) == 50.0
