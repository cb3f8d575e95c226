"""`python -m bench.offline_story`: logged flights, a dataset of their ULogs alone, training, a forecast, then flights.

Each step is done once: what lies in its folder is not made again. docs/results/offline.md is written from what they
came to.
"""

import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from bench.offline_story.logging import SECONDS
from bench.offline_story.page import write_page
from bench.side_by_side import Job, run_side_by_side
from common.files import write_whole

PILOTS = {"clumsy": "bench.offline_story.pilots:Clumsy", "shipped": "follow-me-tracked"}
"""Who is logged: a mediocre pilot, and the follower that ships."""
TRAINERS: dict[str, dict[str, Any]] = {
    "bc": {},
    "bc-best": {"best_fraction": 0.34},
    "iql": {"expectile": 0.8, "inverse_temperature": 3.0},
    "td3_bc": {"alpha": 1.0},
}
ENV_ARGS = ("observation=tracked", "has_estimator=false", "owner=any", "terrain=kept", "stack=3")
CONDITIONS = ("walk", "run")
FLOWN_SEED = 3_780_001  # odd, as of all that is judged
JUDGED_SEED = 3_790_001


def main(
    folder: Annotated[Path, typer.Option(help="Where logs, datasets and runs lie.")] = Path("results/offline-story"),
    clumsy: Annotated[int, typer.Option(min=2, help="Flights of the mediocre pilot.")] = 24,
    shipped: Annotated[int, typer.Option(min=2, help="Flights of the follower that ships.")] = 12,
    steps: Annotated[int, typer.Option(min=100, help="Gradient steps of each training.")] = 20_000,
    flights: Annotated[int, typer.Option(min=1, help="Judged flights of each condition.")] = 12,
    jobs: Annotated[int, typer.Option(min=1, help="Processes at a time.")] = 2,
) -> None:
    """Tells the whole story, from logs to flights."""
    console = Console(highlight=False)
    folder.mkdir(parents=True, exist_ok=True)
    _log(folder, {"clumsy": clumsy, "shipped": shipped}, jobs, console)
    _build(folder)
    _train(folder, steps)
    forecast = _forecast(folder, jobs)
    validated = _validate(folder)
    chosen = max(validated, key=lambda name: sum(found["in_band"][0] for found in validated[name].values()))
    console.print(f"chosen: {chosen}")
    flown = _fly(folder, chosen, flights, jobs)
    write_page(
        folder,
        forecast,
        validated,
        flown,
        chosen,
        {"clumsy": clumsy, "shipped": shipped, "steps": steps, "seconds": SECONDS},
    )


def _log(folder: Path, counts: dict[str, int], jobs: int, console: Console) -> None:
    """Every flight a process, so that a killed story goes on with the next."""
    waiting, first = [], 0
    for name, count in counts.items():
        for number in range(first, first + count):
            if not (folder / "logs" / name / f"{number:03d}").exists():
                words = ("bench.offline_story.logging", PILOTS[name], str(folder / "logs" / name), str(number), "1")
                waiting.append(Job(f"log-{name}-{number}", words))
        first += count
    _run(waiting, folder, jobs, console)


def _build(folder: Path) -> None:
    """A dataset of each pilot's logs, judged by the estimate: of other people's logs nobody has the truth."""
    for name in PILOTS:
        out = folder / "datasets" / name
        if not out.exists():
            out.parent.mkdir(parents=True, exist_ok=True)
            logs = [str(path) for path in sorted((folder / "logs" / name).glob("*/flight.ulg"))]
            env_args = [word for pair in ENV_ARGS for word in ("--env-args", pair)]
            _honeyguide("dataset", "build", *logs, "--task", "FollowMe", "-o", str(out), "--no-truth", *env_args)


def _train(folder: Path, steps: int) -> None:
    for trainer, hyperparameters in TRAINERS.items():
        if (folder / "runs" / trainer / "FollowMe.pt").exists():
            continue
        recipe = folder / f"{trainer}.yaml"
        write_whole(
            recipe, json.dumps(_recipe(folder, trainer.split("-")[0], hyperparameters, steps), indent=1).encode()
        )
        words = ("--run-id", trainer, "--results-dir", str(folder / "runs"), "--seed", "1", "--force")
        _honeyguide("train", str(recipe), *words)


def _recipe(folder: Path, trainer: str, hyperparameters: dict[str, Any], steps: int) -> dict[str, Any]:
    return {
        "behaviors": {
            "FollowMe": {
                "trainer_type": trainer,
                "hyperparameters": hyperparameters,
                "offline": {"dataset": [str(folder / "datasets" / name) for name in PILOTS]},
                "network_settings": {"normalize": True, "hidden_units": 128, "num_layers": 2},
                "reward_signals": {"extrinsic": {"gamma": 0.97}},
                "max_steps": steps,
                "summary_freq": max(steps // 20, 1),
            }
        },
        "env_settings": {"env_path": "FollowMe", "env_args": list(ENV_ARGS), "num_areas": 64},
    }


def _forecast(folder: Path, jobs: int) -> dict[str, Any]:
    """What each policy is said to return before it has flown, by doubly robust and fitted Q estimates on the logs."""
    from bench.offline_story.forecast import forecast

    path = folder / "forecast.json"
    if not path.exists():
        policies = {name: folder / "runs" / name / "FollowMe.pt" for name in TRAINERS}
        datasets = [folder / "datasets" / name for name in PILOTS]
        write_whole(path, json.dumps(forecast(datasets, policies, jobs), indent=1).encode())
    return dict(json.loads(path.read_text(encoding="utf-8")))


def _validate(folder: Path) -> dict[str, Any]:
    """How the policies do in batch, in worlds of training, alone: the one that flies is chosen by this."""
    from bench.offline_story.batch import judged

    path = folder / "validated.json"
    if not path.exists():
        found = judged({name: folder / "runs" / name / "FollowMe.pt" for name in TRAINERS}, "train")
        write_whole(path, json.dumps(found, indent=1).encode())
    return dict(json.loads(path.read_text(encoding="utf-8")))


def _fly(folder: Path, chosen: str, flights: int, jobs: int) -> dict[str, Any]:
    """Over MAVLink in held-out worlds, the standard airframe: both pilots and the chosen policy, on the same seeds."""
    pilots = {**PILOTS, "offline": str(folder / "runs" / chosen / "FollowMe.pt")}
    flown = {}
    for name, pilot in pilots.items():
        out = folder / "flown" / name
        if not (out / "flights.json").exists():
            conditions = [word for condition in CONDITIONS for word in ("--condition", condition)]
            words = ("--flights", str(flights), "--jobs", str(jobs), "--seed", str(FLOWN_SEED), "--out", str(out))
            _honeyguide("benchmark", "follow", "--policy", pilot, *conditions, *words, accepted=(0, 1))
        flown[name] = json.loads((out / "flights.json").read_text(encoding="utf-8"))["flights"]
    return flown


def _honeyguide(*words: str, accepted: Sequence[int] = (0,)) -> None:
    ended = subprocess.run([str(Path(sys.executable).with_name("honeyguide")), *words], check=False)
    if ended.returncode not in accepted:
        raise SystemExit(f"honeyguide {' '.join(words[:2])} failed")


def _run(waiting: list[Job], folder: Path, jobs: int, console: Console) -> None:
    if waiting and (failed := run_side_by_side(waiting, folder / "job-logs", jobs, console)):
        raise SystemExit(f"failed: {', '.join(failed)}; see {folder / 'job-logs'}")


if __name__ == "__main__":
    typer.run(main)
