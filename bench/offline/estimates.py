"""Estimates of policies from recorded decisions against the truth: `python -m bench.offline.estimates`.

RollerBall. Recorded are the shipped policy with much noise, and chance. Judged are checkpoints of a short training and
the shipped policy with ever more noise on its weights; the truth is what each returns in the batch simulator, from the
beginnings that the recordings have: of its most probable actions for fitted Q, of its Gaussian for weighted estimates.
Prints Spearman's rank correlation and how many intervals hold the truth, writes a JSON row and the page's section.
"""

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import torch
import typer
from numpy.typing import NDArray
from rich.console import Console

from bench.offline.page import ESTIMATES, write_page
from common.files import write_whole
from common.intervals import Z_95
from policies.learn.export.policy_file import load_policy
from policies.learn.networks.policy import Policy
from policies.offline.evaluation.judge import Judge, JudgeSettings
from policies.offline.store import open_store
from policies.pretrained.pretrained_policies import pretrained
from policies.tasks.catalogue import build_task

TASK, GAMMA = "RollerBall", 0.99  # of its recipe
RECORDED = {"noisy": ("roller-ball", 0.8), "chance": ("random", 0.0)}
WEIGHT_NOISES = (0.0, 0.3, 0.5, 0.6, 0.7, 0.8, 1.0)
TRAINED_STEPS, CHECKPOINTS = 160_000, 7
TRUTH_SEED = 771


def main(
    folder: Annotated[Path, typer.Option(help="Where datasets and runs lie.")] = Path("results/offline-estimates"),
    episodes: Annotated[int, typer.Option(min=10, max=256, help="Of each dataset, all from the same beginning.")] = 256,
    truth: Annotated[int, typer.Option(min=500, help="Episodes that the truth is the mean of.")] = 2000,
    steps: Annotated[int, typer.Option(min=100, help="Of fitted Q evaluation.")] = 3000,
    seed: Annotated[int, typer.Option(min=0, help="Of the recordings, the training and the noise on weights.")] = 100,
) -> None:
    """Judges all policies and compares."""
    torch.set_num_threads(1)
    console = Console(highlight=False)
    folder /= str(seed)  # what is there is not made again
    folder.mkdir(parents=True, exist_ok=True)
    _record(folder, episodes, seed)
    policies = _policies(folder, seed)
    store = open_store([str(folder / name) for name in RECORDED])
    settings = JudgeSettings(GAMMA, steps=steps)
    judge = Judge(store, settings, (episodes,) * len(RECORDED))
    rows = []
    for name, policy in policies.items():
        began = time.process_time()
        verdict = judge.judge(policy)
        row: dict[str, Any] = {
            "policy": name,
            "truth": _mean(true_returns(policy, truth)),
            "truth_drawn": _mean(true_returns(policy, truth, settings.width)),
            "outside": verdict.outside_fraction,
            "effective": verdict.effective_episodes,
            "cpu_s": time.process_time() - began,
        }
        for key in ESTIMATES:
            found = getattr(verdict, key)
            row[key] = [found.value, found.low, found.high]
        rows.append(row)
        console.print(json.dumps(row))
    summary = {key: _compared(rows, key) for key in ESTIMATES}
    content: dict[str, Any] = {"decisions": len(store), "episodes": store.episode_count, "truth_episodes": truth}
    content |= {"steps": steps, "seed": seed, "width": settings.width}
    write_whole(folder / "estimates.json", json.dumps(content | {"rows": rows, "summary": summary}, indent=1).encode())
    write_page(content, rows, summary)
    console.print(summary)


def _compared(rows: list[dict[str, Any]], key: str) -> dict[str, float]:
    """Rank correlation with the truth, and how many intervals hold it: of what is judged, and of what flies."""
    values, low, high = np.array([row[key] for row in rows]).T
    found: dict[str, float] = {"of": len(rows)}
    for name, truth in (("", ESTIMATES[key].truth), ("flown_", "truth")):
        truths = np.array([row[truth][0] for row in rows])
        found[f"{name}spearman"] = spearman(values, truths)
        found[f"{name}held"] = int(((low <= truths) & (truths <= high)).sum())
    return found


def _mean(returns: NDArray[np.float64]) -> tuple[float, float]:
    """And half of its 95 % interval."""
    return float(returns.mean()), float(Z_95 * returns.std() / len(returns) ** 0.5)


def spearman(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """The correlation of the ranks, of values without ties."""
    ranks = [np.argsort(np.argsort(values)) for values in (a, b)]
    return float(np.corrcoef(ranks[0], ranks[1])[0, 1])


@torch.inference_mode()
def true_returns(policy: Policy, episodes: int, width: float = 0.0) -> NDArray[np.float64]:
    """Discounted returns in the batch simulator, of one episode of each environment.

    Args:
        policy: whose most probable actions are played.
        episodes: how many.
        width: of a Gaussian around them; what it leads out of the bounds is clipped.
    """
    task = build_task(TASK, episodes)
    task.reset(TRUTH_SEED)
    generator = torch.Generator().manual_seed(TRUTH_SEED)
    returns, runs, discount = np.zeros(episodes), np.ones(episodes, np.bool_), 1.0
    while runs.any():
        seen = torch.from_numpy(task.buffers.observations.numpy().copy())
        actions, _ = policy.act(seen, policy.start_memory(episodes))
        means = policy.bounded(actions)
        played = (means + width * torch.randn(means.shape, generator=generator)).clamp(-1.0, 1.0)
        task.buffers.continuous.assign(played.numpy())
        task.step()
        returns += discount * task.buffers.rewards.numpy() * runs
        runs &= task.buffers.outcomes.numpy() == 0
        discount *= GAMMA
    return returns


def _record(folder: Path, episodes: int, seed: int) -> None:
    for k, (name, (policy, noise)) in enumerate(RECORDED.items()):
        if not (folder / name).exists():
            words = ("--episodes", str(episodes), "--noise", str(noise), "--seed", str(seed + k))
            _honeyguide("dataset", "collect", TASK, "--policy", policy, "-o", str(folder / name), *words)


def _policies(folder: Path, seed: int) -> dict[str, Policy]:
    """Checkpoints of a training, and the shipped policy with noise on its weights, in deviations of each tensor."""
    run = folder / "runs" / "graded"
    if not run.exists():
        recipe = Path(__file__).parents[2] / "policies" / "recipes" / "roller-ball.yaml"
        text = recipe.read_text(encoding="utf-8").replace("max_steps: 1000000", f"max_steps: {TRAINED_STEPS}")
        text = text.replace(
            "    success_target: 0.99\n", f"    keep_checkpoints: {CHECKPOINTS}\n    even_checkpoints: true\n"
        )
        (folder / "graded.yaml").write_text(text, encoding="utf-8")
        words = ("--run-id", "graded", "--results-dir", str(folder / "runs"), "--seed", str(seed))
        _honeyguide("train", str(folder / "graded.yaml"), *words)
    files = sorted(run.glob(f"**/{TASK}-*.pt"), key=lambda path: int(path.stem.split("-")[-1]))
    policies = {path.stem: load_policy(path)[0] for path in files[:-1]}  # the last learnt at a rate of nothing
    shipped = pretrained(TASK)
    if shipped is None:
        raise SystemExit(f"no policy of {TASK} ships")
    generator = torch.Generator().manual_seed(seed)
    for noise in WEIGHT_NOISES:
        policy = load_policy(shipped)[0]
        with torch.no_grad():
            for weights in policy.parameters():
                if weights.dim() > 1:
                    weights.add_(torch.randn(weights.shape, generator=generator), alpha=noise * float(weights.std()))
        policies[f"shipped, noise {noise:g}"] = policy
    return policies


def _honeyguide(*words: str) -> None:
    ended = subprocess.run([str(Path(sys.executable).with_name("honeyguide")), *words], check=False)
    if ended.returncode:
        raise SystemExit(f"honeyguide {' '.join(words[:2])} failed")


if __name__ == "__main__":
    typer.run(main)
