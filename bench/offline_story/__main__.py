"""`python -m bench.offline_story`: logged flights, a dataset of their ULogs alone, training, a forecast, then flights.

Each step is done once: what lies in its folder is not made again. docs/results/offline.md is written from what they
came to.
"""

import json
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from bench.offline_story.logging import SECONDS
from bench.offline_story.page import COVERAGE, Story, write_page
from bench.side_by_side import Job, run_side_by_side
from common.files import write_whole

PILOTS = {"clumsy": "bench.offline_story.pilots:Clumsy", "shipped": "follow-me-tracked"}
"""Who is logged: a mediocre pilot, and the follower that ships."""
SHIPPED = Path(__file__).parents[2] / "policies" / "pretrained" / "follow-me-tracked.pt"
TRAINERS: dict[str, dict[str, Any]] = {
    "bc": {},
    "bc-best": {"best_fraction": 0.34},
    "iql": {"expectile": 0.8, "inverse_temperature": 3.0},
    "td3_bc": {"alpha": 2.5},
}
MIXES = {"": ("clumsy", "shipped"), "medium-": ("clumsy",)}
"""Whose flights are learnt from, by what the names of runs begin with: best thirds of the first are the expert's."""
ENV_ARGS = ("observation=tracked", "has_estimator=false", "owner=any", "terrain=kept", "stack=3")
NUMBERS = {"collision_cost": 80.0, "lost_cost": 40.0, "jerk_cost": 0.2}
"""Costs by which nothing is dearer than to lose the owner: with the task's own, whoever trembles pays less the sooner
they are lost. The first two are those of policies/recipes/follow-me-tracked.yaml; by its jerk cost the mediocre pilot
would pay for hardly anything but jerks."""
CONDITIONS = ("walk", "run")
FLOWN_SEED = 3_780_001  # odd, as of all that is judged


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
    for mix in MIXES:
        _train(folder, mix, steps)
    forecasts = {mix: _forecast(folder, mix, jobs) for mix in MIXES}
    validated = {mix: _validate(folder, mix) for mix in MIXES}
    chosen = {mix: _chosen(found) for mix, found in validated.items()}
    console.print(f"chosen: {', '.join(chosen.values())}")
    matched = _match(folder, chosen)
    _draw_coverage(folder)
    flown = _fly(folder, chosen, flights, jobs)
    sizes = {"clumsy": clumsy, "shipped": shipped, "steps": steps, "seconds": SECONDS}
    write_page(folder, Story(forecasts, validated, matched, flown, chosen, sizes))


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
            pairs = [word for pair in ENV_ARGS for word in ("--env-args", pair)]
            pairs += [word for name, value in NUMBERS.items() for word in ("--number", f"{name}={value:g}")]
            _honeyguide("dataset", "build", *logs, "--task", "FollowMe", "-o", str(out), "--no-truth", *pairs)


def _train(folder: Path, mix: str, steps: int) -> None:
    for trainer, hyperparameters in TRAINERS.items():
        name = f"{mix}{trainer}"
        if (folder / "runs" / name / "FollowMe.pt").exists():
            continue
        recipe = folder / f"{name}.yaml"
        behavior = _behavior(folder, mix, trainer.split("-")[0], hyperparameters, steps)
        write_whole(recipe, json.dumps({"behaviors": {"FollowMe": behavior}, **_environment()}, indent=1).encode())
        words = ("--run-id", name, "--results-dir", str(folder / "runs"), "--seed", "1", "--force")
        _honeyguide("train", str(recipe), *words)


def _behavior(folder: Path, mix: str, trainer: str, hyperparameters: dict[str, Any], steps: int) -> dict[str, Any]:
    return {
        "trainer_type": trainer,
        "hyperparameters": hyperparameters,
        "offline": {
            "dataset": [str(path) for path in _datasets(folder, mix)],
            "evaluation_interval": max(steps // 5, 1),
            "evaluation_episodes": 64,
        },
        "network_settings": {"normalize": True, "hidden_units": 128, "num_layers": 2},
        "reward_signals": {"extrinsic": {"gamma": 0.97}},
        "max_steps": steps,
        "summary_freq": max(steps // 20, 1),
    }


def _environment() -> dict[str, Any]:
    return {
        "environment_parameters": NUMBERS,
        "env_settings": {"env_path": "FollowMe", "env_args": list(ENV_ARGS), "num_areas": 64},
    }


def _datasets(folder: Path, mix: str) -> list[Path]:
    return [folder / "datasets" / name for name in MIXES[mix]]


def _policies(folder: Path, mix: str) -> dict[str, Path]:
    return {f"{mix}{name}": folder / "runs" / f"{mix}{name}" / "FollowMe.pt" for name in TRAINERS}


def _forecast(folder: Path, mix: str, jobs: int) -> dict[str, Any]:
    """What each policy is said to return before it has flown, by doubly robust and fitted Q estimates on the logs."""
    from bench.offline_story.forecast import forecast

    return _once(folder / f"{mix}forecast.json", lambda: forecast(_datasets(folder, mix), _policies(folder, mix), jobs))


def _validate(folder: Path, mix: str) -> dict[str, Any]:
    """How the policies do in batch, in worlds of training, alone: the one that flies is chosen by this."""
    from bench.offline_story.batch import TRAINING, judged

    return _once(folder / f"{mix}validated.json", lambda: judged(_policies(folder, mix), TRAINING, NUMBERS))


def _draw_coverage(folder: Path) -> None:
    """Where the policies of all flights leave them, as `dataset judge --picture` draws it."""
    from mission.dataset.judge import draw
    from policies.offline.evaluation.datasets import judged

    if not COVERAGE.exists():
        files = {str(path): name for name, path in _policies(folder, "").items()}
        datasets = [str(path) for path in _datasets(folder, "")]
        found = judged(datasets, list(files), None, {"steps": 1})  # no return is asked for
        draw([replace(each, name=files[each.name]) for each in found], COVERAGE)


def _match(folder: Path, chosen: dict[str, str]) -> dict[str, Any]:
    """How those that fly, and the follower that ships, do in batch in conditions like those they will meet."""
    from bench.offline_story.batch import FLOWN, judged

    policies = {**_flying(folder, chosen), "shipped": SHIPPED}
    return _once(folder / "matched.json", lambda: judged(policies, FLOWN, NUMBERS))


def _fly(folder: Path, chosen: dict[str, str], flights: int, jobs: int) -> dict[str, Any]:
    """Over MAVLink in held-out worlds, the standard airframe: both pilots and those chosen, on the same seeds."""
    pilots = {**PILOTS, **{name: str(path) for name, path in _flying(folder, chosen).items()}}
    flown = {}
    for name, pilot in pilots.items():
        out = folder / "flown" / name
        if not (out / "flights.json").exists():
            conditions = [word for condition in CONDITIONS for word in ("--condition", condition)]
            words = ("--flights", str(flights), "--jobs", str(jobs), "--seed", str(FLOWN_SEED), "--out", str(out))
            _honeyguide("benchmark", "follow", "--policy", pilot, *conditions, *words, accepted=(0, 1))
        flown[name] = json.loads((out / "flights.json").read_text(encoding="utf-8"))["flights"]
    return flown


def _flying(folder: Path, chosen: dict[str, str]) -> dict[str, Path]:
    """The files of those chosen, by the name of what they learnt from."""
    names = {"": "offline", "medium-": "medium"}
    return {names[mix]: folder / "runs" / name / "FollowMe.pt" for mix, name in chosen.items()}


def _chosen(validated: dict[str, Any]) -> str:
    """Who is longest in the band, over both paces."""
    return max(validated, key=lambda name: sum(float(found["in_band"][0]) for found in validated[name].values()))


def _once(path: Path, make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """What a file holds; without it, it is made."""
    if not path.exists():
        write_whole(path, json.dumps(make(), indent=1).encode())
    return dict(json.loads(path.read_text(encoding="utf-8")))


def _honeyguide(*words: str, accepted: Sequence[int] = (0,)) -> None:
    ended = subprocess.run([str(Path(sys.executable).with_name("honeyguide")), *words], check=False)
    if ended.returncode not in accepted:
        raise SystemExit(f"honeyguide {' '.join(words[:2])} failed")


def _run(waiting: list[Job], folder: Path, jobs: int, console: Console) -> None:
    if waiting and (failed := run_side_by_side(waiting, folder / "job-logs", jobs, console)):
        raise SystemExit(f"failed: {', '.join(failed)}; see {folder / 'job-logs'}")


if __name__ == "__main__":
    typer.run(main)
