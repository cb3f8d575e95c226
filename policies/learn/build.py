"""A learner from its configuration: policy, reward signals, cloning, algorithm.

In: a configuration and the task's environments. Out: a learner whose every random draw comes from the seed.
"""

import torch

from policies.learn.bc import Cloning
from policies.learn.config.behavior import Behavior
from policies.learn.config.run import RunConfig
from policies.learn.config.signals import CuriositySettings, GailSettings, RndSettings, SignalSettings
from policies.learn.demonstrations import load_demonstrations
from policies.learn.learner import Learner
from policies.learn.policy import Policy
from policies.learn.ppo import Ppo
from policies.learn.signals.curiosity import CuriositySignal
from policies.learn.signals.extrinsic import ExtrinsicSignal
from policies.learn.signals.gail import GailSignal
from policies.learn.signals.rnd import RndSignal
from policies.learn.signals.signal import RewardSignal
from policies.tasks.layout import Layout
from policies.tasks.task import Task


def build_learner(config: RunConfig, task: Task, seed: int) -> Learner:
    """An untrained learner; the task is reset.

    Args:
        config: of the run.
        task: its environments all belong to the learner.
        seed: of every random draw.

    Raises:
        DemonstrationError: demonstrations that cannot be read.
        LayoutError: demonstrations of another task.
    """
    behavior = config.behavior
    generator = torch.Generator().manual_seed(seed)
    policy = Policy(task.layout, behavior.network_settings, generator, is_squashed=behavior.trainer_type == "sac")
    signals = [
        _signal(settings, task.layout, torch.Generator().manual_seed(seed + 1 + k))
        for k, settings in enumerate(behavior.reward_signals.in_use.values())
    ]
    cloning = _cloning(behavior, policy, torch.Generator().manual_seed(seed))
    return Ppo(task, policy, behavior, signals, seed=seed, cloning=cloning)


def _signal(settings: SignalSettings, layout: Layout, generator: torch.Generator) -> RewardSignal:
    """A reward signal that knows nothing yet; the generator becomes its own."""
    match settings:
        case GailSettings():
            demonstrations = load_demonstrations(settings.demo_path, layout)
            return GailSignal(layout, settings, demonstrations, generator)
        case CuriositySettings():
            return CuriositySignal(layout, settings, generator)
        case RndSettings():
            return RndSignal(layout, settings, generator)
        case _:
            return ExtrinsicSignal(settings.gamma, settings.strength)


def _cloning(behavior: Behavior, policy: Policy, generator: torch.Generator) -> Cloning | None:
    settings = behavior.behavioral_cloning
    if settings is None:
        return None
    numbers = behavior.hyperparameters
    epochs = getattr(numbers, "num_epoch", 1)  # SAC has none
    demonstrations = load_demonstrations(settings.demo_path, policy.layout)
    algorithm = (numbers.learning_rate, numbers.batch_size, epochs)
    return Cloning(policy, settings, demonstrations, algorithm, generator)
