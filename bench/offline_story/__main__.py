"""`python -m bench.offline_story`: logged flights, a dataset of their ULogs alone, training, a forecast, then flights.

Each step is done once: what lies in its folder is not made again. docs/results/offline.md and its neighbours are
written from what they came to; what a story is of is told in story.py.
"""

import json
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from bench.offline_story.logging import SECONDS
from bench.offline_story.page import Result, coverage_image, write_page
from bench.offline_story.story import STORIES, Story
from bench.side_by_side import Job, run_side_by_side
from common.files import write_whole
from policies.learn.export.policy_path import find_policy

TRAINERS: dict[str, dict[str, Any]] = {
    "bc": {},
    "bc-best": {"best_fraction": 0.34},
    "iql": {},
    "td3_bc": {"alpha": 2.5},
}
MIXES = {"": ("clumsy", "shipped"), "medium-": ("clumsy",)}
"""Whose flights are learnt from, by what the names of runs begin with: best thirds of the first are the expert's."""


def main(
    story: Annotated[list[str] | None, typer.Option(help=f"{', '.join(STORIES)}; repeatable. Default: all.")] = None,
    folder: Annotated[Path, typer.Option(help="Where each story's logs, datasets and runs lie.")] = Path(
        "results/offline-story"
    ),
    clumsy: Annotated[int | None, typer.Option(min=3, help="Flights of the mediocre pilot.")] = None,
    shipped: Annotated[int | None, typer.Option(min=3, help="Flights of the policy that ships.")] = None,
    steps: Annotated[int | None, typer.Option(min=100, help="Gradient steps of each training.")] = None,
    flights: Annotated[int | None, typer.Option(min=1, help="Judged flights of each condition.")] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Processes at a time.")] = 2,
) -> None:
    """Tells stories whole, from logs to flights; sizes are each story's own unless they are given."""
    names = story or list(STORIES)
    if unknown := [name for name in names if name not in STORIES]:
        raise typer.BadParameter(f"--story {unknown[0]}: there are {', '.join(STORIES)}")
    for name in names:
        told = STORIES[name]
        given = {"clumsy": clumsy, "shipped": shipped, "flown": flights}
        sizes = {**told.sizes, **{key: size for key, size in given.items() if size is not None}}
        told = replace(told, sizes=sizes, steps=steps or told.steps)
        Telling(told, folder / name, jobs, Console(highlight=False)).tell()


@dataclass(frozen=True, slots=True)
class Telling:
    """One story, in a folder."""

    story: Story
    folder: Path
    jobs: int
    console: Console

    def tell(self) -> None:
        """From logs to the page."""
        self._begin()
        self._log()
        self._build()
        for mix in MIXES:
            self._train(mix)
        forecasts = {mix: self._forecast(mix) for mix in MIXES}
        validated = {mix: self._validate(mix) for mix in MIXES}
        chosen = {mix: self._chosen(found) for mix, found in validated.items()}
        self.console.print(f"chosen: {', '.join(chosen.values())}")
        matched = self._match(chosen)
        self._draw_coverage()
        flown = self._fly(chosen)
        sizes = {**self.story.sizes, "steps": self.story.steps}
        if not self.story.recorded:
            sizes["seconds"] = round(SECONDS)
        write_page(self.story, self.folder, Result(forecasts, validated, matched, flown, chosen, sizes))

    def _begin(self) -> None:
        """A folder holds one story: what was made by other numbers is not gone on with."""
        s = self.story
        given = {"sizes": s.sizes, "steps": s.steps, "seeds": s.seeds, "iql": s.iql, "evaluations": s.evaluations}
        given |= self._environment()
        file = self.folder / "given.json"
        is_older = not file.exists() and (self.folder / "logs").exists()
        self.folder.mkdir(parents=True, exist_ok=True)
        if is_older or _once(file, lambda: given) != json.loads(json.dumps(given)):
            raise SystemExit(f"{self.folder} holds a story of other numbers; take another --folder, or remove it")

    def _log(self) -> None:
        """Each pilot's flights; what was begun and not ended is flown anew."""
        if not self.story.recorded:
            self._log_in_a_world_of_its_own()
            return
        for name, pilot in self.story.pilots.items():
            count = self.story.sizes[name] // len(self.story.recorded)
            for number, condition in enumerate(self.story.recorded):
                target = self.folder / "logs" / name / condition
                if not target.exists():
                    part = target.with_name(f"{condition}.part")
                    shutil.rmtree(part, ignore_errors=True)
                    seed = self.story.seeds[name] + 2 * count * number
                    self._benchmark(pilot, (condition,), count, seed, "--record", str(part))
                    part.rename(target)

    def _log_in_a_world_of_its_own(self) -> None:
        """Every flight a process, so that a killed story goes on with the next."""
        waiting, first = [], 0
        for name, pilot in self.story.pilots.items():
            logs, count = self.folder / "logs" / name, self.story.sizes[name]
            for number in range(first, first + count):
                if not (logs / f"{number:03d}").exists():
                    words = ("bench.offline_story.logging", pilot, str(logs), str(number), "1")
                    waiting.append(Job(f"log-{name}-{number}", words))
            first += count
        job_logs = self.folder / "job-logs"
        if waiting and (failed := run_side_by_side(waiting, job_logs, self.jobs, self.console)):
            raise SystemExit(f"failed: {', '.join(failed)}; see {job_logs}")

    def _build(self) -> None:
        """A dataset of each pilot's logs, judged by the estimate: of other people's logs nobody has the truth."""
        for name in self.story.pilots:
            out = self.folder / "datasets" / name
            if not out.exists():
                out.parent.mkdir(parents=True, exist_ok=True)
                logs = [str(path) for path in sorted((self.folder / "logs" / name).rglob("flight.ulg"))]
                pairs = [word for pair in self.story.env_args for word in ("--env-args", pair)]
                numbers = (self.story.numbers or {}).items()
                pairs += [word for key, value in numbers for word in ("--number", f"{key}={value:g}")]
                _honeyguide("dataset", "build", *logs, "--task", self.story.task, "-o", str(out), "--no-truth", *pairs)

    def _train(self, mix: str) -> None:
        for trainer, hyperparameters in TRAINERS.items():
            name, given = f"{mix}{trainer}", dict(hyperparameters)
            if self._policy(name).exists():
                continue
            recipe = self.folder / f"{name}.yaml"
            if trainer == "iql":
                given |= self.story.iql
            behavior = self._behavior(mix, trainer.split("-")[0], given)
            told = {"behaviors": {self.story.task: behavior}, **self._environment()}
            write_whole(recipe, json.dumps(told, indent=1).encode())
            words = ("--run-id", name, "--results-dir", str(self.folder / "runs"), "--seed", "1", "--force")
            _honeyguide("train", str(recipe), *words)

    def _behavior(self, mix: str, trainer: str, hyperparameters: dict[str, Any]) -> dict[str, Any]:
        steps = self.story.steps
        return {
            "trainer_type": trainer,
            "hyperparameters": hyperparameters,
            "offline": {
                "dataset": [str(path) for path in self._datasets(mix)],
                "evaluation_interval": max(steps // self.story.evaluations, 1),
                "evaluation_episodes": 64,
            },
            "network_settings": {"normalize": True, "hidden_units": 128, "num_layers": 2},
            "reward_signals": {"extrinsic": {"gamma": self.story.gamma}},
            "keep_best": True,
            "max_steps": steps,
            "summary_freq": max(steps // 20, 1),
        }

    def _environment(self) -> dict[str, Any]:
        settings = {"env_path": self.story.task, "env_args": list(self.story.env_args), "num_areas": 64}
        numbers = {**(self.story.numbers or {}), **self.story.evaluated()}
        return {"environment_parameters": numbers, "env_settings": settings}

    def _datasets(self, mix: str) -> list[Path]:
        return [self.folder / "datasets" / name for name in MIXES[mix]]

    def _policy(self, name: str) -> Path:
        return self.folder / "runs" / name / f"{self.story.task}.pt"

    def _policies(self, mix: str) -> dict[str, Path]:
        return {f"{mix}{name}": self._policy(f"{mix}{name}") for name in TRAINERS}

    def _forecast(self, mix: str) -> dict[str, Any]:
        """What each policy is said to return before it has flown, by estimates on the logs."""
        from bench.offline_story.forecast import forecast

        given = self._datasets(mix), self._policies(mix), self.story.forecast_steps, self.jobs
        return _once(self.folder / f"{mix}forecast.json", lambda: forecast(*given))

    def _validate(self, mix: str) -> dict[str, Any]:
        """How the policies do in batch, in worlds of training, alone: the one that flies is chosen by this."""
        return _once(self.folder / f"{mix}validated.json", lambda: self.story.judge(self._policies(mix), "train"))

    def _chosen(self, validated: Mapping[str, Any]) -> str:
        """Who has most of what is measured first, over all conditions."""
        key = self.story.measures[0].key
        return max(validated, key=lambda name: sum(float(found[key][0]) for found in validated[name].values()))

    def _draw_coverage(self) -> None:
        """Where the policies of all flights leave them, as `dataset judge --picture` draws it."""
        from mission.dataset.judge import draw
        from policies.offline.evaluation.datasets import judged

        path = self.folder / "coverage.png"
        if not path.exists():
            files = {str(file): name for name, file in self._policies("").items()}
            datasets = [str(dataset) for dataset in self._datasets("")]
            found = judged(datasets, list(files), None, {"steps": 1})  # no return is asked for
            draw([replace(each, name=files[each.name]) for each in found], path)
        shutil.copyfile(path, coverage_image(self.story))

    def _match(self, chosen: Mapping[str, str]) -> dict[str, Any]:
        """How those that fly, and the policy that ships, do in batch in conditions like those they will meet."""
        policies = {**self._flying(chosen), "shipped": find_policy(self.story.pilots["shipped"])}
        return _once(self.folder / "matched.json", lambda: self.story.judge(policies, "test"))

    def _fly(self, chosen: Mapping[str, str]) -> dict[str, Any]:
        """Over MAVLink in held-out worlds: both pilots and those chosen, on the same seeds."""
        pilots = {**self.story.pilots, **{name: str(path) for name, path in self._flying(chosen).items()}}
        flown = {}
        for name, pilot in pilots.items():
            out = self.folder / "flown" / name
            if not (out / "flights.json").exists():
                conditions, count = self.story.conditions, self.story.sizes["flown"]
                self._benchmark(pilot, conditions, count, self.story.seeds["flown"], "--out", str(out))
            flown[name] = json.loads((out / "flights.json").read_text(encoding="utf-8"))["flights"]
        return flown

    def _flying(self, chosen: Mapping[str, str]) -> dict[str, Path]:
        """The files of those chosen, by the name of what they learnt from."""
        names = {"": "offline", "medium-": "medium"}
        return {names[mix]: self._policy(name) for mix, name in chosen.items()}

    def _benchmark(self, pilot: str, conditions: Sequence[str], flights: int, seed: int, *words: str) -> None:
        """Flights by `honeyguide benchmark`; what they fall short of is no failure."""
        asked = [word for condition in conditions for word in ("--condition", condition)]
        numbers = ("--flights", str(flights), "--seed", str(seed), "--jobs", str(self.jobs))
        _honeyguide("benchmark", self.story.benchmark, "--policy", pilot, *asked, *numbers, *words, accepted=(0, 1))


def _once(path: Path, make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """What a file holds; without it, it is made."""
    if not path.exists():
        write_whole(path, json.dumps(make(), indent=1).encode())
    return dict(json.loads(path.read_text(encoding="utf-8")))


def _honeyguide(*words: str, accepted: Sequence[int] = (0,)) -> None:
    ended = subprocess.run([str(Path(sys.executable).with_name("honeyguide")), *words], check=False)
    if ended.returncode not in accepted:
        raise SystemExit(f"honeyguide {' '.join(words[:2])} failed")


app = typer.Typer(add_completion=False)
app.command()(main)

if __name__ == "__main__":
    app()
