import torch

from policies.learn.signals.extrinsic import ExtrinsicSignal
from policies.learn.signals.signal import RewardSignal, Transitions


def test_the_extrinsic_reward_is_the_tasks():
    rows = torch.arange(6.0).reshape(2, 3)
    transitions = Transitions(rows[..., None], rows[..., None], rows[..., None], rows[..., None].long(), rows, rows > 4)
    signal = ExtrinsicSignal(0.9, 2.0)
    assert isinstance(signal, RewardSignal)
    assert signal.rewards(transitions).tolist() == [[0, 1, 2], [3, 4, 5]]
    assert signal.update(transitions[0]) == {}
