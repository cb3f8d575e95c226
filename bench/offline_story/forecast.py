"""What policies are said to return before they have flown, and what their data returned."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import torch

from policies.learn.export.policy_file import load_policy
from policies.offline.fitted_q import FittedQ
from policies.offline.store import open_store

GAMMA, STEPS = 0.97, 4000


def forecast(datasets: Sequence[Path], policies: Mapping[str, Path]) -> dict[str, Any]:
    """Discounted returns by fitted Q evaluation on all datasets together, and the mean reward that each holds."""
    torch.set_num_threads(1)
    store = open_store([str(path) for path in datasets])
    estimates = {}
    for name, path in policies.items():
        fitted = FittedQ(store, load_policy(path)[0], GAMMA)
        fitted.fit(STEPS)
        found = asdict(fitted.estimate())
        estimates[name] = {"estimate": found.pop("mean"), **found}
    logged = {path.name: open_store([str(path)]).statistics().reward_mean for path in datasets}
    return {"gamma": GAMMA, "decisions": len(store), "policies": estimates, "logged": logged}
