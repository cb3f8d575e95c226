"""Reward signals from their configuration: one for each block of `reward_signals`."""

import torch

from policies.learn.config.signals import CuriositySettings, GailSettings, RewardSignals, RndSettings
from policies.learn.rollout.demonstrations import load_demonstrations
from policies.learn.signals.curiosity import CuriositySignal
from policies.learn.signals.extrinsic import ExtrinsicSignal
from policies.learn.signals.gail import GailSignal
from policies.learn.signals.rnd import RndSignal
from policies.learn.signals.signal import RewardSignal
from policies.tasks.layout import Layout


def build_signals(
    settings: RewardSignals, layout: Layout, seed: int, device: torch.device | str = "cpu"
) -> list[RewardSignal]:
    """Untrained signals, in the order of the value heads.

    Args:
        settings: of the signals in use.
        layout: of the task.
        seed: of their weights and draws.
        device: where they learn.

    Raises:
        DemonstrationError: GAIL's demonstrations cannot be read.
        LayoutError: GAIL's demonstrations are of another task or preset.
    """
    signals: list[RewardSignal] = []
    for k, block in enumerate(settings.in_use.values()):
        signal_seed = seed + 1 + k  # not the policy's own stream
        if isinstance(block, GailSettings):
            demonstrations = load_demonstrations(block.demo_path, layout).to(device)
            signals.append(GailSignal(layout, block, demonstrations, signal_seed))
        elif isinstance(block, CuriositySettings):
            signals.append(CuriositySignal(layout, block, signal_seed, device))
        elif isinstance(block, RndSettings):
            signals.append(RndSignal(layout, block, signal_seed, device))
        else:
            signals.append(ExtrinsicSignal(block.gamma, block.strength))
    return signals
