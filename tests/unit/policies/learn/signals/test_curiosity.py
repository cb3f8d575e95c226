import pytest
import torch

from policies.learn.config.signals import CuriositySettings
from policies.learn.signals.curiosity import CuriositySignal
from policies.learn.signals.signal import RewardSignal
from tests.unit.policies.learn.signals.transitions import PUSHED, STEERED, drawn


def signal(layout=PUSHED, seed=0, **settings):
    settings = CuriositySettings(learning_rate=1e-3, network_settings={"hidden_units": 32}, **settings)
    return CuriositySignal(layout, settings, seed)


def test_it_pays_nothing_before_its_first_update():
    curiosity = signal()
    rows = drawn(PUSHED, (4, 3))
    assert not curiosity.rewards(rows).any()
    curiosity.update(rows[0])
    assert (curiosity.rewards(rows) > 0).all()


def test_the_reward_is_at_most_one_after_strength():
    curiosity = signal(strength=50.0)
    rows = drawn(PUSHED, (100,), centre=30.0)
    curiosity.update(rows)
    assert (curiosity.strength * curiosity.rewards(rows)).max().item() == pytest.approx(1.0)


@pytest.mark.parametrize("layout", [PUSHED, STEERED])
def test_the_reward_falls_where_transitions_repeat_and_less_where_they_are_new(layout):
    curiosity = signal(layout, strength=1e-6)
    known, new = drawn(layout, (64,), 1), drawn(layout, (64,), 2, centre=6.0)
    curiosity.update(known)
    before = curiosity.rewards(known).mean()
    first = curiosity.update(known)
    for _ in range(300):
        last = curiosity.update(known)
    assert curiosity.rewards(known).mean() < 0.5 * before
    assert curiosity.rewards(new).mean() > 5.0 * curiosity.rewards(known).mean()
    assert last["Losses/Curiosity Inverse Loss"] < first["Losses/Curiosity Inverse Loss"]
    assert last["Losses/Curiosity Forward Loss"] == pytest.approx(curiosity.rewards(known).mean().item(), rel=0.1)


def test_ends_of_episodes_do_not_end_its_return():
    assert not signal().is_episodic


def test_a_restored_signal_continues_bit_for_bit():
    first, second = signal(STEERED), signal(STEERED, seed=9)
    assert isinstance(first, RewardSignal)
    first.update(drawn(STEERED, (64,)))
    second.load_state(first.state())
    for k in range(3):
        rows = drawn(STEERED, (64,), k)
        assert first.update(rows) == second.update(rows)
        assert torch.equal(first.rewards(rows), second.rewards(rows))
