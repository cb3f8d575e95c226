"""`python -m bench.offline_d3rlpy --d3rlpy-python PATH`: our IQL and TD3+BC beside d3rlpy's, like for like.

Both learn from the same datasets, ours from its folder, d3rlpy from its D4RL export, the same networks (2 layers,
swish) with the same batches, discount, rates and steps, on one thread. Each policy then plays the same episodes in our
batch simulator. d3rlpy is in an environment of its own (`pip install torch d3rlpy h5py`). All rows of one seed come
before those of the next. A seed of a row that is in docs/results/offline-d3rlpy.jsonl already is not measured again,
unless it is of other sizes.
"""

import json
import subprocess
import time
from itertools import product
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import torch
import typer
from rich.console import Console

from bench.learning.offline import built
from bench.offline_d3rlpy.cases import CASES, QUALITIES, Case, collected
from bench.offline_d3rlpy.page import MOST_SEEDS, RESULTS, write_section
from bench.row import require
from common.files import write_whole
from policies.datasets.exporting import export_d4rl
from policies.learn.evaluate import evaluate
from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import find_policy
from policies.learn.networks.normalizer import LIMIT
from policies.learn.networks.policy import Policy
from policies.offline.draws import Draws
from policies.offline.scores import normalized_score
from policies.offline.store import OfflineStore, open_store
from policies.tasks.catalogue import settings_of

TRAINERS = ("iql", "td3_bc")
BATCH, GAMMA, BLOCK = 256, 0.99, 200
EVALUATION_SEED = 11
OF_SEEDS = ("scores", "d3rlpy_scores", "cpu_s", "d3rlpy_cpu_s")
"""What a row has a list of, a value for each seed from 0 on."""


def main(
    d3rlpy_python: Annotated[Path, typer.Option(help="Python of the environment that has d3rlpy.", exists=True)],
    case: Annotated[list[str] | None, typer.Option(help=f"Of {', '.join(CASES)}; all. Repeatable.")] = None,
    steps: Annotated[int, typer.Option(min=200, help="Gradient steps of each training.")] = 5_000,
    hidden: Annotated[int, typer.Option(min=1, help="Units of each of two layers.")] = 64,
    episodes: Annotated[int, typer.Option(min=1, help="Judged episodes of each policy.")] = 100,
    seeds: Annotated[int, typer.Option(min=1, max=MOST_SEEDS, help="Trainings of each row by both.")] = 3,
    folder: Annotated[Path, typer.Option(help="Where datasets lie.")] = Path("results/offline-d3rlpy"),
) -> None:
    """Collects, trains, judges, and writes the rows and their section of docs/results/offline.md."""
    torch.set_num_threads(1)
    console = Console(highlight=False)
    if unknown := [name for name in case or () if name not in CASES]:
        raise typer.BadParameter(f"no case {unknown[0]}; there are {', '.join(CASES)}", param_hint="--case")
    sizes = {"steps": steps, "hidden": hidden, "episodes": episodes}
    for seed, name, trainer, quality in product(range(seeds), case or CASES, TRAINERS, QUALITIES):
        key = {"case": name, "quality": quality, "trainer": trainer}
        there = [row for row in _rows() if row.items() >= (key | sizes).items()]
        row: dict[str, Any] = there[0] if there else key | sizes | {each: [] for each in OF_SEEDS}
        if len(row["scores"]) > seed:
            continue
        found = _measured(CASES[name], trainer, quality, folder / name, sizes | {"seed": seed}, d3rlpy_python, console)
        row |= found | {each: [*row[each], found[each]] for each in OF_SEEDS}
        write_whole(RESULTS, "".join(f"{json.dumps(each)}\n" for each in _with(row, list(key))).encode())
        console.print(row)
    write_section(_rows())


def _rows() -> list[dict[str, Any]]:
    return [json.loads(line) for line in RESULTS.read_text(encoding="utf-8").splitlines()] if RESULTS.exists() else []


def _with(row: dict[str, Any], names: list[str]) -> list[dict[str, Any]]:
    """All rows, with this one in place of the one that is alike in these names, or at the end."""
    rows = _rows()
    places = [k for k, other in enumerate(rows) if all(other[name] == row[name] for name in names)]
    return [*rows[: places[0]], row, *rows[places[0] + 1 :]] if places else [*rows, row]


def _measured(
    case: Case, trainer: str, quality: str, folder: Path, sizes: dict[str, int], python: Path, console: Console
) -> dict[str, Any]:
    """Scores and times of both, of one seed."""
    folder.mkdir(parents=True, exist_ok=True)
    dataset = collected(case, quality, folder, console)
    store = open_store([str(dataset)])
    ours, our_s = _ours(trainer, store, sizes)
    theirs, their_s, notes = _theirs(trainer, store, dataset, sizes, python)
    episodes = sizes["episodes"]
    references = [_mean_return(collected(case, "random", folder, console)), _best(case, episodes, folder, console)]
    scores = [normalized_score(_judged(policy, case, episodes), references) for policy in (ours, theirs)]
    is_alike = case.pilot == "expert"  # a policy's dataset has rewards by the numbers of its training
    return {
        "decisions": len(store),
        **notes,
        "scores": round(scores[0], 2),
        "d3rlpy_scores": round(scores[1], 2),
        "dataset_score": round(normalized_score(_mean_return(dataset), references), 2) if is_alike else None,
        "cpu_s": round(our_s, 2),
        "d3rlpy_cpu_s": round(their_s, 2),
        "references": [round(value, 3) for value in references],
    }


def _judged(policy: Policy, case: Case, episodes: int) -> float:
    """Its mean return by the task's own numbers and the case's, in episodes of one seed."""
    settings = settings_of(case.task, case.env_args)
    numbers = dict(case.numbers)
    return evaluate(policy, case.task, settings, episodes=episodes, seed=EVALUATION_SEED, params=numbers).mean_return


def _best(case: Case, episodes: int, folder: Path, console: Console) -> float:
    """What the pilot returns without noise, judged as the policies are."""
    if case.pilot == "expert":
        return _mean_return(collected(case, "best", folder, console))
    policy, _ = load_policy(find_policy(case.pilot))
    return _judged(policy, case, episodes)


def _mean_return(dataset: Path) -> float:
    return float(open_store([str(dataset)]).episode_returns().mean())


def _ours(trainer: str, store: OfflineStore, sizes: dict[str, int]) -> tuple[Policy, float]:
    policy, algorithm = built(trainer, store, sizes["hidden"], sizes["seed"])
    draws, generator = Draws(store, BATCH, 1, 1.0), torch.Generator().manual_seed(sizes["seed"])
    start_s = time.process_time()
    for first in range(0, sizes["steps"], BLOCK):
        for rows in draws.block(min(BLOCK, sizes["steps"] - first), generator):
            algorithm.step(rows)
    return policy, time.process_time() - start_s


def _theirs(
    trainer: str, store: OfflineStore, dataset: Path, sizes: dict[str, int], python: Path
) -> tuple[Policy, float, dict[str, Any]]:
    """d3rlpy's policy as one of ours, weight by weight."""
    policy, _ = built("bc", store, sizes["hidden"])
    normalizer = policy.body.normalizer
    assert normalizer is not None
    assert policy.heads.mean is not None
    exported = dataset.with_suffix(".hdf5")
    if not exported.exists():
        export_d4rl(dataset, exported)
    job, out = dataset.with_suffix(".json"), dataset.with_suffix(".npz").absolute()
    record = {
        "trainer": trainer, "dataset": str(exported.absolute()), "out": str(out), "steps": sizes["steps"],
        "hidden": sizes["hidden"], "batch": BATCH, "gamma": GAMMA, "seed": sizes["seed"], "limit": LIMIT,
        "mean": normalizer.mean.tolist(), "deviation": normalizer.deviation.tolist(),
    }  # fmt: skip
    write_whole(job, json.dumps(record).encode())
    words = [str(python), str(Path(__file__).with_name("theirs.py").absolute()), str(job.absolute())]
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL, cwd=dataset.parent)
    with np.load(out) as arrays:
        weights = [torch.from_numpy(arrays[name]) for name in sorted(arrays.files) if name.startswith("w")]
        spent_s, actions = float(arrays["spent_s"]), arrays["actions"]
        notes = {"d3rlpy_decisions": int(arrays["decisions"]), "d3rlpy": str(arrays["version"])}
    layers = [*policy.body.layers, policy.heads.mean]
    parameters = [parameter for layer in layers for parameter in layer.parameters()]
    with torch.no_grad():
        for there, here in zip(parameters, weights, strict=True):
            there.copy_(here)
        chosen, _ = policy.act(store.observations[: len(actions)].contiguous(), policy.start_memory(len(actions)))
    apart = np.abs(policy.bounded(chosen).numpy() - actions).max()
    require(apart < 1e-4, f"{dataset}: {trainer}: the policy that is played is {apart:.2g} off d3rlpy's")
    return policy, spent_s, notes


if __name__ == "__main__":
    typer.run(main)
