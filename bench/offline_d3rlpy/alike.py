"""`python -m bench.offline_d3rlpy.alike --d3rlpy-python PATH`: do d3rlpy and we make the same steps?

Both begin with d3rlpy's untrained weights and see the same minibatches, of random numbers; there is no noise on TD3's
targets. Then what each network has moved is compared. Out: docs/results/offline-d3rlpy-alike.json.
"""

import json
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, cast

import numpy as np
import torch
import typer
from torch import Tensor, nn

from bench.offline_d3rlpy.page import ALIKE
from common.files import write_whole
from policies.learn.config.network import NetworkSettings
from policies.learn.config.offline import IqlHyperparameters, Td3BcHyperparameters
from policies.learn.networks.policy import Policy
from policies.learn.rollout.replay_buffer import ReplayBatch
from policies.offline.algorithm import NormalizedBatches
from policies.offline.iql import Iql
from policies.offline.stacked_networks import value_network
from policies.offline.td3_bc import Td3Bc
from policies.tasks.layout import Element, Layout

STEPS, BATCH, HIDDEN, GAMMA = 200, 256, 64, 0.99
SEEN, DONE = 20, 4
_OBSERVATION = tuple(Element(f"seen_{k}", "1") for k in range(SEEN))
LAYOUT = Layout("Alike", 1, _OBSERVATION, tuple(Element(f"done_{k}", "1") for k in range(DONE)))
IQL_DEVIATION = -1.5  # logarithm of what d3rlpy's begins with; ours begins with 0, as its authors' does


def main(
    d3rlpy_python: Annotated[Path, typer.Option(help="Python of the environment that has d3rlpy.", exists=True)],
) -> None:
    """Makes the steps of both and writes how far they are apart."""
    torch.set_num_threads(1)
    record: dict[str, float] = {"steps": STEPS}
    with tempfile.TemporaryDirectory() as folder:
        batches = Path(folder) / "batches.npz"
        np.savez(batches, allow_pickle=False, **_batches())
        for trainer in ("td3_bc", "iql"):
            job, out = Path(folder) / "job.json", Path(folder) / f"{trainer}.npz"
            words = {"trainer": trainer, "batches": str(batches), "out": str(out), "hidden": HIDDEN, "seed": 0}
            job.write_text(json.dumps(words | {"batch": BATCH, "gamma": GAMMA}))
            theirs = Path(__file__).with_name("theirs.py")
            subprocess.run(
                [str(d3rlpy_python), str(theirs), str(job)], check=True, stdout=subprocess.DEVNULL, cwd=folder
            )
            record |= {f"{trainer} {name}": value for name, value in _apart(trainer, dict(np.load(out))).items()}
    write_whole(ALIKE, f"{json.dumps(record, indent=1)}\n".encode())
    typer.echo(json.dumps(record, indent=1))


def _batches() -> dict[str, Any]:
    """Decisions of no task: whatever is learnt from them, both learn it."""
    rng, count = np.random.default_rng(0), STEPS * BATCH
    seen, following = rng.standard_normal((2, count, SEEN)).astype(np.float32)
    done = rng.uniform(-1.0, 1.0, (count, DONE)).astype(np.float32)
    rewards = (seen[:, :1] - np.square(done - seen[:, :DONE] / 3.0).sum(axis=1, keepdims=True)).astype(np.float32)
    ends = (rng.random((count, 1)) < 0.05).astype(np.float32)
    return {
        "observations": seen,
        "next_observations": following,
        "actions": done,
        "rewards": rewards,
        "terminals": ends,
    }


class _Batches:
    """Minibatches of those numbers, as an algorithm asks for them."""

    def __init__(self) -> None:
        self._arrays = {name: torch.from_numpy(array) for name, array in _batches().items()}

    def refresh(self) -> None:
        """Nothing is normalised."""

    def take(self, rows: Tensor) -> ReplayBatch:
        """These."""
        arrays = {name: array[rows] for name, array in self._arrays.items()}
        ends, choices = arrays["terminals"][:, 0], torch.zeros((len(rows), 0), dtype=torch.int64)
        seen, following, done = arrays["observations"], arrays["next_observations"], arrays["actions"]
        return ReplayBatch(seen, following, done, choices, arrays["rewards"][:, 0], ends, ends > 0.0)


def _apart(trainer: str, theirs: Mapping[str, Any]) -> dict[str, float]:
    """By network, how far ours is from theirs at the end, as a part of the way that theirs has gone."""
    settings = NetworkSettings(hidden_units=HIDDEN, normalize=False)
    policy = Policy(LAYOUT, settings, torch.Generator().manual_seed(0), is_squashed=True)
    batches, generator = cast("NormalizedBatches", _Batches()), torch.Generator().manual_seed(0)
    algorithm: Td3Bc | Iql
    if trainer == "td3_bc":
        numbers = Td3BcHyperparameters(target_noise=0.0)
        algorithm = Td3Bc(policy, batches, numbers, GAMMA, (generator, generator))
    else:
        algorithm = Iql(policy, batches, IqlHyperparameters(), GAMMA, generator)
        sigma = policy.heads.log_sigma
        assert isinstance(sigma, nn.Linear)
        nn.init.constant_(sigma.bias, IQL_DEVIATION)
    _begin(policy, algorithm, theirs)
    for k in range(STEPS):
        algorithm.step(torch.arange(k * BATCH, (k + 1) * BATCH))
    state = algorithm.state()
    ours = {"policy": [each.detach() for each in _parameters(policy)], "critics": list(state["critics"].values())}
    if trainer == "iql":
        value = value_network(LAYOUT, settings, generator)
        value.load_state_dict(state["value"])
        ours["value"] = list(value.sac_record().values())
    return {
        name: _part(arrays, _taken(theirs, "start", name), _taken(theirs, "end", name)) for name, arrays in ours.items()
    }


def _begin(policy: Policy, algorithm: Td3Bc | Iql, theirs: Mapping[str, Any]) -> None:
    """Gives all networks and targets d3rlpy's untrained weights."""
    with torch.no_grad():
        for here, there in zip(_parameters(policy), _taken(theirs, "start", "policy"), strict=True):
            here.copy_(there)
    critics = _record(_taken(theirs, "start", "critics"))
    state = algorithm.state() | {"critics": critics, "targets": critics}
    if "value" in state:
        value = value_network(LAYOUT, policy.settings, torch.Generator())
        value.load_sac_record(_record(_taken(theirs, "start", "value")))
        state["value"] = value.state_dict()
    else:
        state |= {"target_policy": policy.state_dict(), "step_count": 1}  # d3rlpy's policy learns in the first step
    algorithm.load_state(state)


def _parameters(policy: Policy) -> list[nn.Parameter]:
    """Of the mean, layer by layer."""
    assert policy.heads.mean is not None
    return [parameter for layer in (*policy.body.layers, policy.heads.mean) for parameter in layer.parameters()]


def _taken(theirs: Mapping[str, Any], when: str, network: str) -> list[Tensor]:
    """Weights and biases of d3rlpy's, layer by layer, network by network."""
    names = [name for name in sorted(theirs) if name.startswith(f"{when} {network} ")]
    return [torch.from_numpy(theirs[name]) for name in names]


def _record(arrays: list[Tensor]) -> dict[str, Tensor]:
    """As our stacked networks take them: two layers and an output each."""
    layers = [f"{layer}.{part}" for layer in ("body.layers.0", "body.layers.1", "heads") for part in ("weight", "bias")]
    return {f"{k // len(layers)}.{layers[k % len(layers)]}": array for k, array in enumerate(arrays)}


def _part(ours: list[Tensor], start: list[Tensor], end: list[Tensor]) -> float:
    here, first, there = (torch.cat([array.flatten() for array in arrays]) for arrays in (ours, start, end))
    return float(f"{(here - there).norm() / (there - first).norm():.2g}")


if __name__ == "__main__":
    typer.run(main)
