import pytest
import torch
from torch.distributions import Categorical, Independent, Normal, TransformedDistribution
from torch.distributions.transforms import TanhTransform

from policies.learn.networks.action_distributions import ActionHeads, Actions, bounded

ROWS = 7


def heads(continuous=2, branches=(3, 2), **options):
    built = ActionHeads(5, continuous, branches, torch.Generator().manual_seed(0), **options)
    with torch.no_grad():
        for parameter in built.parameters():
            parameter.normal_(generator=torch.Generator().manual_seed(parameter.numel()))
    return built


def features(rows=ROWS):
    return torch.randn(rows, 5, generator=torch.Generator().manual_seed(1))


def parts(built, observation):
    """The same distributions, of torch."""
    gaussian = Normal(built.mean(observation), built.log_sigma.exp())
    return gaussian, [Categorical(logits=part) for part in built.logits(observation).split(built.branch_sizes, -1)]


def test_log_probabilities_and_entropy_are_those_of_torch_distributions():
    built, observation = heads(), features()
    distribution = built(observation)
    actions = distribution.draw(torch.Generator().manual_seed(2))
    gaussian, branches = parts(built, observation)
    expected = [gaussian.log_prob(actions.continuous)]
    expected += [branch.log_prob(actions.branches[:, k])[:, None] for k, branch in enumerate(branches)]
    assert torch.allclose(distribution.log_probs(actions), torch.cat(expected, -1), atol=1e-5)
    entropy = gaussian.entropy().mean(-1) + sum(branch.entropy() for branch in branches)
    assert torch.allclose(distribution.entropy(), entropy, atol=1e-5)


def test_draws_have_the_frequencies_of_their_probabilities():
    built = heads(continuous=1)
    observation = features(1).expand(40_000, -1)
    actions = built(observation).draw(torch.Generator().manual_seed(3))
    gaussian, branches = parts(built, observation[:1])
    for k, branch in enumerate(branches):
        fraction = torch.bincount(actions.branches[:, k], minlength=len(branch.probs[0])) / len(observation)
        assert torch.allclose(fraction, branch.probs[0], atol=0.01)  # 4 deviations of a fraction of 40,000
    assert actions.continuous.mean().item() == pytest.approx(gaussian.mean.item(), abs=0.03 * gaussian.stddev.item())
    assert actions.continuous.std().item() == pytest.approx(gaussian.stddev.item(), rel=0.02)


def test_a_branch_never_draws_a_choice_it_does_not_have():
    actions = heads(0, (2, 5))(features(20_000)).draw(torch.Generator().manual_seed(4))
    assert actions.branches[:, 0].max() == 1
    assert actions.branches[:, 1].max() == 4


def test_the_mode_is_the_most_probable_action():
    built, observation = heads(), features()
    mode = built(observation).mode()
    gaussian, branches = parts(built, observation)
    assert torch.equal(mode.continuous, gaussian.mean)
    assert torch.equal(mode.branches, torch.stack([branch.probs.argmax(-1) for branch in branches], -1))


def test_squashed_log_probabilities_are_those_of_the_transformed_distribution():
    built, observation = heads(2, (), is_sigma_learned_by_state=True), features()
    distribution = built(observation)
    drawn = distribution.draw(torch.Generator().manual_seed(5))
    base = Independent(Normal(built.mean(observation), built.log_sigma(observation).clamp(-20.0, 2.0).exp()), 1)
    squashed = TransformedDistribution(base, [TanhTransform(cache_size=1)])
    taken = squashed.transforms[0](drawn.continuous)
    assert torch.allclose(distribution.squashed_log_probs(drawn).sum(-1), squashed.log_prob(taken), atol=1e-4)


def test_ppo_clips_draws_to_three_and_divides_by_three():
    assert bounded(torch.tensor([-9.0, -1.5, 0.0, 3.0, 4.0])).tolist() == [-1.0, -0.5, 0.0, 1.0, 1.0]


@pytest.mark.parametrize(("continuous", "branches"), [(2, ()), (0, (3,)), (0, (3, 3)), (1, (2, 4, 3))])
def test_a_head_is_a_continuous_dimension_or_a_branch(continuous, branches):
    distribution = heads(continuous, branches)(features())
    actions = distribution.draw(torch.Generator().manual_seed(6))
    assert actions.continuous.shape == (ROWS, continuous)
    assert actions.branches.shape == (ROWS, len(branches))
    assert distribution.log_probs(actions).shape == (ROWS, continuous + len(branches))
    assert isinstance(distribution.mode(), Actions)
    assert distribution.entropy().shape == (ROWS,)


def test_heads_start_as_ml_agents_does():
    built = ActionHeads(4096, 64, (64,), torch.Generator().manual_seed(0))
    assert built.mean.weight.std().item() == pytest.approx(0.2 / 64.0, rel=0.02)  # gain / sqrt(inputs)
    assert built.logits.weight.std().item() == pytest.approx(0.1 / 64.0, rel=0.02)
    assert built.log_sigma.abs().max() == 0.0
    assert built.mean.bias.abs().max() == 0.0


def test_sharpened_choices_are_drawn_as_the_most_probable_ones_which_stay():
    built, observation = heads(), features(200)
    before = built(observation)
    built.sharpen(4.0)
    after = built(observation)
    assert torch.equal(after.mode().branches, before.mode().branches)
    assert torch.equal(after.mean, before.mean)
    expected = (4.0 * before.choice_logs).log_softmax(-1)[..., :2]
    assert torch.allclose(after.choice_logs[..., :2].log_softmax(-1), expected.log_softmax(-1), atol=1e-4)
    assert (after.choice_logs.amax(-1) >= before.choice_logs.amax(-1) - 1e-6).all()
