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
from policies.offline.fitted_q import FittedQ
from policies.offline.store import open_store

GAMMA, STEPS = 0.99, 5000


def forecast(datasets: Sequence[Path], policies: Mapping[str, Path], jobs: int) -> dict[str, Any]:
    """Discounted returns by fitted Q evaluation on all datasets together, and the mean reward that each holds."""
    with ProcessPoolExecutor(jobs, get_context("spawn")) as pool:
        estimates = dict(zip(policies, pool.map(partial(_estimate, list(datasets)), policies.values()), strict=True))
    stores = {path.name: open_store([str(path)]) for path in datasets}
    logged = {name: store.statistics().reward_mean for name, store in stores.items()}
    return {"gamma": GAMMA, "decisions": sum(map(len, stores.values())), "policies": estimates, "logged": logged}


def _estimate(datasets: Sequence[Path], policy: Path) -> dict[str, float]:
    torch.set_num_threads(1)
    fitted = FittedQ(open_store([str(path) for path in datasets]), load_policy(policy)[0], GAMMA)
    fitted.fit(STEPS)
    return asdict(fitted.estimate())
