"""Datasets and policies by name, judged: what `honeyguide dataset judge` asks for."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from common.config.yaml_locations import ConfigError
from policies.datasets.episodes import DatasetError
from policies.learn.config.load import load_config
from policies.learn.config.recipes import recipe
from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import CheckpointError, find_policy
from policies.learn.rollout.demonstrations import DemonstrationError
from policies.learn.torch_threads import few_threads
from policies.offline.evaluation.judge import Judge, JudgeSettings, Verdict
from policies.offline.store import open_store

_GAMMA = 0.99  # of tasks without a recipe
_SEEN_MOST = 20_000  # decisions of an image


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """One policy and what the recording showed, thinned for an image."""

    name: str
    verdict: Verdict
    elements: tuple[str, ...]  # names of the observation's
    observations: NDArray[np.float32]  # (decisions, elements)
    outside: NDArray[np.float64]  # (decisions,)
    distances: NDArray[np.float64]  # (decisions,)
    limit: float  # of the distances: what lies above is outside


def recipe_gamma(task: str) -> float:
    """The discount of a task's recipe."""
    try:
        extrinsic = load_config(recipe(task)).config.behavior.reward_signals.extrinsic
    except ConfigError:
        return _GAMMA
    return _GAMMA if extrinsic is None else float(extrinsic.gamma)


def judged(
    datasets: Sequence[str], policies: Sequence[str], gamma: float | None, options: dict[str, Any]
) -> Iterator[Judged]:
    """Each policy's verdict, one after the other.

    Args:
        datasets: folders; several count as one, each of a pilot of its own.
        policies: files, runs or names.
        gamma: discount; none: that of the task's recipe.
        options: others of `JudgeSettings`.

    Raises:
        DatasetError: a dataset or a policy that cannot be judged.
        LayoutError: a policy of another task.
    """
    try:
        store = open_store(datasets)
        pilots = [open_store([path]).episode_count for path in datasets] if len(datasets) > 1 else ()
        named = [(name, load_policy(find_policy(name))[0]) for name in policies]
    except (CheckpointError, DemonstrationError) as error:
        raise DatasetError(str(error)) from error
    for name, policy in named:
        store.layout.require(policy.layout, name)
    settings = JudgeSettings(recipe_gamma(store.layout.task) if gamma is None else gamma, **options)
    thin = slice(None, None, max(1, len(store) // _SEEN_MOST))
    seen = store.observations[store.decisions[thin]].numpy().copy()
    names = tuple(element.name for element in store.layout.frame) * store.layout.stack
    with few_threads(has_images=False):
        try:
            judge = Judge(store, settings, pilots)
            for name, policy in named:
                verdict = judge.judge(policy)
                rows = verdict.outside[thin], verdict.distances[thin]
                yield Judged(name, verdict, names, seen, *rows, judge.limit)
        except ValueError as error:
            raise DatasetError(str(error)) from error
