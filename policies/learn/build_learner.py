"""A learner from its configuration: policy, reward signals, cloning, algorithm.

In: a configuration and the task's environments. Out: a learner whose every random draw comes from the seed.
"""

import math
from collections.abc import Iterator

import torch

from policies.learn.algorithms.behavioural_cloning import Cloning
from policies.learn.algorithms.dagger import Dagger
from policies.learn.algorithms.learner import Learner
from policies.learn.algorithms.ppo import Ppo
from policies.learn.algorithms.sac import Sac
from policies.learn.algorithms.teacher import load_teacher
from policies.learn.config.behavior import Behavior, DaggerHyperparameters, PpoHyperparameters, SacHyperparameters
from policies.learn.config.offline import OfflineHyperparameters
from policies.learn.config.run import RunConfig
from policies.learn.networks.policy import Policy
from policies.learn.rollout.demonstrations import load_demonstrations
from policies.learn.signals.build_signals import build_signals
from policies.offline.build_offline import build_offline_learner, open_offline_store
from policies.offline.conservative_start import ConservativeStart
from policies.tasks.task import Task


def build_learner(config: RunConfig, task: Task, seed: int) -> Learner:
    """An untrained learner; the task is reset.

    Args:
        config: of the run.
        task: its environments all belong to the learner.
        seed: of every random draw.

    Raises:
        CheckpointError: a teacher that cannot be read.
        DemonstrationError: demonstrations or datasets that cannot be read.
        LayoutError: demonstrations, datasets or a teacher of another task.
        OfflineError: what the offline algorithm does not do.
        SacError: what soft actor-critic does not do.
    """
    behavior = config.behavior
    hyperparameters = behavior.hyperparameters
    is_squashed = isinstance(hyperparameters, SacHyperparameters) or (
        isinstance(hyperparameters, OfflineHyperparameters) and hyperparameters.is_squashed
    )
    generator = torch.Generator().manual_seed(seed)
    policy = Policy(task.layout, behavior.network_settings, generator, is_squashed=is_squashed).to(task.device)
    if isinstance(hyperparameters, OfflineHyperparameters):
        return build_offline_learner(config, policy, seed)
    if isinstance(hyperparameters, DaggerHyperparameters):
        teacher = load_teacher(hyperparameters.teacher, task.layout, task.device)
        return Dagger(task, policy, behavior, teacher, seed=seed)
    signals = build_signals(behavior.reward_signals, task.layout, seed, task.device)
    cloning = _cloning(behavior, policy, seed, task.device)
    if isinstance(hyperparameters, SacHyperparameters):
        start = None
        if behavior.offline is not None:
            store = open_offline_store(behavior.offline, task.layout)
            start = ConservativeStart(store, hyperparameters, task.device)
        return Sac(task, policy, behavior, signals, seed=seed, cloning=cloning, start=start)
    return Ppo(task, policy, behavior, signals, seed=seed, cloning=cloning)


def remarks(behavior: Behavior, env_count: int) -> Iterator[str]:
    """What the configuration does not say outright of so many environments, one line for the user each."""
    memory, hyperparameters = behavior.network_settings.memory, behavior.hyperparameters
    if not isinstance(hyperparameters, PpoHyperparameters):
        return
    steps = math.ceil(hyperparameters.buffer_size / env_count)
    if memory is not None and steps < memory.sequence_length:
        yield (
            f"network_settings.memory.sequence_length {memory.sequence_length}: is {steps} here, as buffer_size "
            f"{hyperparameters.buffer_size} is {steps} decisions of each of {env_count} environments"
        )


def _cloning(behavior: Behavior, policy: Policy, seed: int, device: str) -> Cloning | None:
    settings = behavior.behavioral_cloning
    if settings is None:
        return None
    hyperparameters = behavior.hyperparameters
    epochs = getattr(hyperparameters, "num_epoch", 1)  # SAC has none
    demonstrations = load_demonstrations(settings.demo_path, policy.layout).to(device)
    return Cloning(
        policy, settings, demonstrations, (hyperparameters.learning_rate, hyperparameters.batch_size, epochs), seed
    )
