import pytest
import torch

from policies.learn.config.signals import RndSettings
from policies.learn.signals.rnd import RndSignal
from policies.learn.signals.signal import RewardSignal
from policies.learn.signals.signal_losses import squared_error
from tests.unit.policies.learn.signals.transitions import PUSHED, drawn


def signal(*, normalize_reward=True, seed=0, gamma=0.9):
    settings = RndSettings(
        learning_rate=1e-3, gamma=gamma, network_settings={"hidden_units": 32}, normalize_reward=normalize_reward
    )
    return RndSignal(PUSHED, settings, seed)


def test_rewards_are_normalised_unless_ml_agents_form_is_asked_for():
    assert RndSettings().normalize_reward


@pytest.mark.parametrize("normalize_reward", [True, False])
def test_novelty_falls_where_it_has_been(normalize_reward):
    rnd = signal(normalize_reward=normalize_reward)
    rollout = drawn(PUSHED, (16, 16))
    elsewhere = drawn(PUSHED, (16,), 1, centre=3.0)
    for k in range(300):
        if k % 10 == 0:
            rnd.rewards(drawn(PUSHED, (16, 16), k))
        rnd.update(drawn(PUSHED, (64,), k))
    assert rnd.rewards(rollout).mean() < 0.2 * rnd.rewards(elsewhere).mean()


def test_ml_agents_form_is_the_bare_error_at_the_observation():
    rnd = signal(normalize_reward=False)
    rows = drawn(PUSHED, (20,))
    error = squared_error(rnd.network.predictor(rows.observations), rnd.network.target(rows.observations))
    assert torch.equal(rnd.rewards(rows), error.detach())


def test_normalised_rewards_have_discounted_sums_of_unit_deviation_whatever_the_scale_of_observations():
    for scale in (1.0, 1000.0):
        rnd = signal()
        rewards = []
        for k in range(30):
            rollout = drawn(PUSHED, (16, 64), k)
            rollout.next_observations.mul_(scale)
            rewards.append(rnd.rewards(rollout))
        running, sums = torch.zeros(64), []
        for row in torch.cat(rewards[10:]):
            running = 0.9 * running + row
            sums.append(running)
        assert torch.stack(sums[50:]).std().item() == pytest.approx(1.0, abs=0.3)


def test_the_fixed_network_stays_as_it_was():
    rnd = signal()
    before = [parameter.clone() for parameter in rnd.network.target.parameters()]
    rnd.update(drawn(PUSHED, (64,)))
    assert all(torch.equal(a, b) for a, b in zip(before, rnd.network.target.parameters(), strict=True))


@pytest.mark.parametrize("normalize_reward", [True, False])
def test_a_restored_signal_continues_bit_for_bit(normalize_reward):
    first, second = signal(normalize_reward=normalize_reward), signal(normalize_reward=normalize_reward, seed=9)
    assert isinstance(first, RewardSignal)
    first.rewards(drawn(PUSHED, (4, 8)))
    first.update(drawn(PUSHED, (64,)))
    second.load_state(first.state())
    for k in range(3):
        rows = drawn(PUSHED, (4, 8), k)
        assert torch.equal(first.rewards(rows), second.rewards(rows))
        assert first.update(rows[0]) == second.update(rows[0])
