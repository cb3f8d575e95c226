import pytest
import torch

from policies.learn.config.signals import GailSettings
from policies.learn.signals.gail import BETA_RATE, CODE_INFORMATION, GailSignal
from policies.learn.signals.signal import RewardSignal
from tests.unit.policies.learn.signals.transitions import PUSHED, STEERED, drawn

SMALL = {"hidden_units": 32, "num_layers": 1}


def signal(layout=PUSHED, seed=0, network=SMALL, **settings):
    settings = GailSettings(demo_path="unused", network_settings=network, learning_rate=3e-3, **settings)
    return GailSignal(layout, settings, drawn(layout, (512,), 1, centre=1.0), seed)


def train(gail, layout, count, first=0):
    return [gail.update(drawn(layout, (64,), first + k, centre=-1.0)) for k in range(count)]


@pytest.mark.parametrize("use_vail", [False, True])
@pytest.mark.parametrize("reward_form", ["ml-agents", "logit", "log"])
def test_it_learns_to_tell_the_expert_from_the_policy(use_vail, reward_form):
    gail = signal(use_vail=use_vail, reward_form=reward_form)
    before = gail.rewards(drawn(PUSHED, (100,), 2, centre=1.0)).mean()
    statistics = train(gail, PUSHED, 200)[-1]
    assert statistics["Policy/GAIL Expert Estimate"] > 0.7
    assert statistics["Policy/GAIL Policy Estimate"] < 0.3
    expert = gail.rewards(drawn(PUSHED, (20, 5), 2, centre=1.0)).mean()
    policy = gail.rewards(drawn(PUSHED, (20, 5), 3, centre=-1.0)).mean()
    assert expert > before > policy
    if reward_form == "ml-agents":
        assert policy > 0
    elif reward_form == "log":
        assert expert < 0
    else:
        assert expert > 0 > policy


def test_with_actions_it_tells_apart_who_sees_the_same_but_acts_otherwise():
    gail = signal(STEERED, use_actions=True)
    expert = gail.demonstrations
    for column, choice in ((0, 2), (1, 0)):
        expert.branches[:, column] = choice
    gail = GailSignal(STEERED, gail.settings, expert, 0)
    other = drawn(STEERED, (512,), 1, centre=1.0)
    other.branches[:, 0] = 0
    for _ in range(100):
        gail.update(other)
    assert (gail.rewards(expert) > gail.rewards(other)).float().mean() > 0.95


def test_without_actions_it_cannot_see_them():
    gail = signal(STEERED)
    rows = drawn(STEERED, (50,), 4)
    other = drawn(STEERED, (50,), 5)
    rows_with_other_actions = type(rows)(
        rows.observations, rows.next_observations, other.continuous, other.branches, rows.rewards, other.is_ended
    )
    assert torch.equal(gail.rewards(rows), gail.rewards(rows_with_other_actions))


def test_it_learns_from_some_rows_of_a_minibatch_as_well():
    gail = signal(batch_size=16)
    statistics = [gail.update(drawn(PUSHED, (256,), k, centre=-1.0)) for k in range(200)][-1]
    assert statistics["Policy/GAIL Expert Estimate"] > 0.7
    assert statistics["Policy/GAIL Policy Estimate"] < 0.3


def test_a_rollout_is_rewarded_row_by_row_as_a_batch_is():
    gail = signal()
    rollout = drawn(PUSHED, (7, 3))
    assert gail.rewards(rollout).shape == (7, 3)
    torch.testing.assert_close(gail.rewards(rollout)[2], gail.rewards(rollout[2]))
    assert not gail.rewards(rollout).requires_grad


def test_the_weight_of_the_code_follows_its_information_and_is_never_negative():
    gail = signal(use_vail=True)
    beta = 0.0
    for statistics in train(gail, PUSHED, 50):
        beta = max(0.0, beta + BETA_RATE * (statistics["Losses/GAIL KL Loss"] - CODE_INFORMATION))
        assert statistics["Policy/GAIL Beta"] == pytest.approx(beta, rel=1e-4, abs=1e-7)


def test_normalisation_makes_the_unit_of_observations_irrelevant():
    rewards = []
    for scale in (1.0, 1000.0):
        demonstrations = drawn(PUSHED, (512,), 1, centre=1.0)
        demonstrations.observations.mul_(scale)
        settings = GailSettings(demo_path="unused", network_settings={"normalize": True})
        gail = GailSignal(PUSHED, settings, demonstrations, 0)
        rows = drawn(PUSHED, (50,), 2)
        rows.observations.mul_(scale)
        rewards.append(gail.rewards(rows))
    torch.testing.assert_close(*rewards, rtol=0.02, atol=0.02)  # the statistics start with one row of unit variance


@pytest.mark.parametrize("use_vail", [False, True])
def test_a_restored_signal_continues_bit_for_bit(use_vail):
    first, second = signal(use_vail=use_vail), signal(use_vail=use_vail, seed=9)
    assert isinstance(first, RewardSignal)
    train(first, PUSHED, 5)
    second.load_state(first.state())
    assert train(first, PUSHED, 5, 5) == train(second, PUSHED, 5, 5)
    rows = drawn(PUSHED, (50,))
    assert torch.equal(first.rewards(rows), second.rewards(rows))


def test_a_state_does_not_change_with_the_signal():
    gail = signal(use_vail=True)
    train(gail, PUSHED, 1)
    state = gail.state()
    weights = state["network"]["estimator.weight"].clone()
    train(gail, PUSHED, 1)
    assert torch.equal(state["network"]["estimator.weight"], weights)
    assert not torch.equal(gail.network.estimator.weight, weights)
