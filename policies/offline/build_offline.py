"""An offline learner from its configuration: store, policy, algorithm, and who judges it."""

from collections.abc import Callable
from pathlib import Path

import torch

from policies.learn.config.behavior import Behavior
from policies.learn.config.offline import (
    AwacHyperparameters,
    BcHyperparameters,
    IqlHyperparameters,
    OfflineSettings,
    Td3BcHyperparameters,
)
from policies.learn.config.run import RunConfig
from policies.learn.curriculum import Curriculum
from policies.learn.evaluate import Evaluation, evaluate
from policies.learn.networks.policy import Policy
from policies.offline.algorithm import NormalizedBatches, OfflineAlgorithm, OfflineError
from policies.offline.awac import Awac
from policies.offline.cloning import StoreCloning
from policies.offline.initial_weights import draw_policy
from policies.offline.iql import Iql
from policies.offline.learner import OfflineLearner
from policies.offline.store import MEMORY_LIMIT, OfflineStore, open_store
from policies.offline.td3_bc import Td3Bc
from policies.tasks.catalogue import settings_of
from policies.tasks.layout import Layout

_CRITIC_SEED = 1_000_003  # apart from the policy's: their bodies are to begin with other weights


def build_offline_learner(config: RunConfig, policy: Policy, seed: int) -> OfflineLearner:
    """An untrained learner.

    Args:
        config: of the run, with `offline`.
        policy: untrained.
        seed: of every random draw.

    Raises:
        DemonstrationError: datasets that cannot be read.
        LayoutError: datasets of another task.
        OfflineError: what the algorithm does not do.
    """
    behavior = config.behavior
    if behavior.offline is None:
        raise TypeError("the behaviour is not of an offline algorithm")
    store = open_offline_store(behavior.offline, policy.layout)
    normalizer = policy.body.normalizer
    if normalizer is not None:
        statistics = store.statistics()
        normalizer.take(statistics.mean, statistics.variance, len(store.rows))
    algorithm = build_algorithm(behavior, policy, store, seed)
    return OfflineLearner(policy, store, algorithm, behavior, seed=seed, judge=_judge(config, seed))


def build_algorithm(behavior: Behavior, policy: Policy, store: OfflineStore, seed: int) -> OfflineAlgorithm:
    """The algorithm of a behaviour on a store; the policy's normaliser has its statistics already, its weights not.

    Raises:
        OfflineError: what the algorithm does not do.
    """
    device = next(policy.parameters()).device
    signals = behavior.reward_signals.in_use
    extrinsic = behavior.reward_signals.extrinsic
    if extrinsic is None or len(signals) != 1:
        others = ", ".join(name for name in signals if name != "extrinsic") or "none"
        raise OfflineError(f"reward_signals: {behavior.trainer_type} takes extrinsic alone, and there is {others}")
    generators = torch.Generator().manual_seed(seed + _CRITIC_SEED), torch.Generator(device).manual_seed(seed)
    draw_policy(policy, generators[0])
    batches = NormalizedBatches(store, policy, extrinsic.strength)
    match behavior.hyperparameters:
        case BcHyperparameters() as settings:
            return StoreCloning(policy, store, settings)
        case Td3BcHyperparameters() as settings:
            return Td3Bc(policy, batches, settings, extrinsic.gamma, generators)
        case IqlHyperparameters() as settings:
            return Iql(policy, batches, settings, extrinsic.gamma, generators[0])
        case AwacHyperparameters() as settings:
            return Awac(policy, batches, settings, extrinsic.gamma, generators)
        case _:
            raise TypeError("hyperparameters are not of an offline algorithm")


def open_offline_store(settings: OfflineSettings, layout: Layout) -> OfflineStore:
    """The datasets that a behaviour names.

    Raises:
        DemonstrationError: datasets that cannot be read.
        LayoutError: datasets of another task.
    """
    cache = Path(settings.cache) if settings.cache else None
    return open_store(settings.dataset, layout, cache=cache, memory_limit=MEMORY_LIMIT)


def _judge(config: RunConfig, seed: int) -> Callable[[Policy], Evaluation]:
    """Plays the same episodes at every evaluation, in the last lesson."""
    name = config.env_settings.env_path or ""
    settings = settings_of(name, config.env_settings.env_args)
    params = Curriculum(config.environment_parameters).final_params()
    episodes = config.behavior.offline.evaluation_episodes if config.behavior.offline is not None else 0
    episodes_seed = (seed + 1) % 2**31

    def judge(policy: Policy) -> Evaluation:
        return evaluate(policy, name, settings, episodes=episodes, seed=episodes_seed, params=params)

    return judge
