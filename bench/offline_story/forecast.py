"""What policies are said to return before they have flown, and what their data returned."""

from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import torch

from policies.learn.export.policy_file import load_policy
from policies.offline.evaluation.judge import Judge, JudgeSettings
from policies.offline.store import open_store

GAMMA = 0.99


def forecast(datasets: Sequence[Path], policies: Mapping[str, Path], steps: int, jobs: int) -> dict[str, Any]:
    """Discounted returns by doubly robust and fitted Q estimates on all datasets together, and what each holds.

    Args:
        datasets: one of each pilot.
        policies: files, by name.
        steps: of fitted Q evaluation.
        jobs: processes at a time.
    """
    stores = {path.name: open_store([str(path)]) for path in datasets}
    pilots = [store.episode_count for store in stores.values()]
    with ProcessPoolExecutor(jobs, get_context("spawn")) as pool:
        verdicts = pool.map(partial(_judged, list(datasets), pilots, steps), policies.values())
        estimates = dict(zip(policies, verdicts, strict=True))
    logged = {name: store.statistics().reward_mean for name, store in stores.items()}
    return {"gamma": GAMMA, "decisions": sum(map(len, stores.values())), "policies": estimates, "logged": logged}


def _judged(datasets: Sequence[Path], pilots: Sequence[int], steps: int, policy: Path) -> dict[str, Any]:
    torch.set_num_threads(1)
    judge = Judge(open_store([str(path) for path in datasets]), JudgeSettings(GAMMA, steps=steps), pilots)
    verdict = judge.judge(load_policy(policy)[0])
    return {
        "robust": asdict(verdict.robust),
        "fitted_q": asdict(verdict.fitted_q),
        "importance": asdict(verdict.importance),
        "effective_episodes": verdict.effective_episodes,
        "outside": verdict.outside_fraction,
    }
