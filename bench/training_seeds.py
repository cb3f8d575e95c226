"""`python -m bench.training_seeds NAME [judge] [test] [POLICY …]`: three seeds of a policy, and which of them is best.

In: a name of `TRAININGS`, such as `navigate`, and the recipes of its legs. Out: results/NAME-seed-N with a run of each
leg, one on each core, and what it said in a log beside it; a table of how the last ones do in validation worlds, their
scans 0 to 0.2 s late, and the best as results/NAME-chosen.pt. With `judge`, or policy files, it judges only; with
`seed=N LEG` it trains that leg alone. What is chosen by is neither trained on nor of the tests; with `test` the worlds
are those of the tests, and nothing is chosen. The card of the best says how it did without lag.
"""

import json
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from bench.drive import LONGEST as DRIVE_LONGEST
from bench.goal_episodes import Outcomes, first_episodes
from bench.judged_card import write_judged
from bench.navigate import LONGEST as NAVIGATE_LONGEST
from bench.navigate import arrival_speeds
from bench.side_by_side import Job, run_side_by_side
from common.intervals import Interval, rate
from policies.learn.export.policy_file import load_policy
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.drive.drive import Drive
from policies.tasks.drive.drive_kernels import MEASURES as DRIVE_MEASURES
from policies.tasks.episode import Outcome
from policies.tasks.navigate.navigate import Navigate

SEEDS = (1, 2, 3)
LAGS_S = (0.0, 0.1, 0.2)
WORLDS_SEED = 1_000_003  # no training run is given it
RESULTS = Path("results")
HEAD = (
    "| policy | " + " | ".join(f"{1000 * lag_s:.0f} ms late" for lag_s in LAGS_S) + " |\n|" + "---|" * (1 + len(LAGS_S))
)

Measures = NDArray[np.float32]


def mean_speed(outcomes: Outcomes, measures: Measures) -> str:
    """Of the flights that arrived [m/s]."""
    speeds = arrival_speeds(outcomes, measures)
    return f"{speeds.mean():.2f} m/s" if len(speeds) else "-"


def touched_and_time(outcomes: Outcomes, measures: Measures) -> str:
    """How many of the drives touched something [%], and how long those took that arrived [s]."""
    times_s = measures[outcomes == Outcome.SUCCESS, DRIVE_MEASURES.index("time_s")]
    touched = f"touched {100 * rate(outcomes == Outcome.HIT_OBSTACLE).value:.1f} %"
    return f"{touched}, {times_s.mean():.1f} s" if len(times_s) else touched


@dataclass(frozen=True, slots=True)
class Training:
    """What is trained, and what it is judged in."""

    task: str
    legs: tuple[str, ...]  # recipes, each of which goes on from the one before
    longest: int  # decisions of an episode; time is up before
    besides: Callable[[Outcomes, Measures], str]  # success, for the table
    episodes: int  # of each lag
    numbers: Mapping[str, float] = field(default_factory=dict)


TRAININGS = {
    "navigate": Training(
        "Navigate",
        ("navigate", "navigate-careful"),
        NAVIGATE_LONGEST,
        mean_speed,
        episodes=1000,
        numbers={"trees_per_ha": 600.0},
    ),
    "navigate-rover": Training(
        "NavigateRover",
        ("navigate-rover",),
        NAVIGATE_LONGEST,
        mean_speed,
        episodes=1000,
        numbers={"trees_per_ha": 600.0},
    ),
    "navigate-rover-follow": Training(
        "NavigateRover",
        ("navigate-rover-follow",),
        NAVIGATE_LONGEST,
        mean_speed,
        episodes=400,
        numbers={"trees_per_ha": 300.0, "kept_m": 2.0},
    ),
    "drive-park": Training(
        "Drive", ("drive-park", "drive-park-careful"), DRIVE_LONGEST, touched_and_time, episodes=1000
    ),
    "drive-reach": Training("Drive", ("drive-reach",), DRIVE_LONGEST, touched_and_time, episodes=1000),
}


@dataclass(frozen=True, slots=True)
class Judged:
    """What a policy came to with scans of each lag."""

    path: Path
    success: tuple[Interval, ...]
    besides: tuple[str, ...]

    @property
    def low(self) -> float:
        """How good it is at least: the mean of where the intervals begin."""
        return sum(each.low for each in self.success) / len(self.success)

    @property
    def row(self) -> str:
        cells = [str(self.path)]
        for reached, besides in zip(self.success, self.besides, strict=True):
            within = f"{100 * reached.low:.1f} to {100 * reached.high:.1f}"
            cells.append(f"{100 * reached.value:.1f} % ({within}), {besides}")
        return "| " + " | ".join(cells) + " |"


def train_all(name: str) -> list[str]:
    """Trains every leg of every seed, one on each core, whichever may begin; names those that failed."""
    jobs = []
    _chosen(name).unlink(missing_ok=True)
    for before, leg in zip((None, *TRAININGS[name].legs), TRAININGS[name].legs, strict=False):
        for seed in SEEDS:
            policy_of(name, seed, leg).unlink(missing_ok=True)  # others wait for it
            words = ("bench.training_seeds", name, f"seed={seed}", leg)
            is_ready = policy_of(name, seed, before).exists if before else lambda: True
            jobs.append(Job(f"{name}-seed-{seed}-{leg}", words, is_ready=is_ready))
    return run_side_by_side(jobs, RESULTS, len(jobs), Console())


def train(name: str, seed: int, leg: str) -> None:
    """Trains a leg of a seed, a run in the folder of the seed.

    Raises:
        SystemExit: it was stopped before its end; no leg goes on from what it left.
    """
    folder = _folder(name, seed)
    folder.mkdir(parents=True, exist_ok=True)  # a recipe names the policy that it goes on from as it lies beside it
    command = [sys.executable, "-c", "from mission.cli import main; main()"]
    subprocess.run([*command, "train", leg, "--run-id", leg, "--seed", str(seed), "--force"], cwd=folder, check=True)
    path = policy_of(name, seed, leg)
    if json.loads((path.parent / "run_logs" / "training_status.json").read_text())["end"] == "stopped":
        path.unlink()
        raise SystemExit(f"training_seeds: {path}: training was stopped before its end")


def policy_of(name: str, seed: int, leg: str) -> Path:
    """Where the policy of a leg of a seed lies once it is trained."""
    return _folder(name, seed) / "results" / leg / f"{TRAININGS[name].task}.pt"


def _folder(name: str, seed: int) -> Path:
    return RESULTS / f"{name}-seed-{seed}"


def _chosen(name: str) -> Path:
    return RESULTS / f"{name}-chosen.pt"


def judged(training: Training, path: Path, split: str = "validation", lags_s: Sequence[float] = LAGS_S) -> Judged:
    """A policy in held-out worlds, on the flight controller's estimate."""
    policy, card = load_policy(path)
    settings: dict[str, Any] = card.settings | {"has_estimator": True, "split": split}
    task = build_task(training.task, training.episodes, task_settings(training.task, settings))
    if not isinstance(task, Navigate | Drive):
        raise TypeError(task)
    task.layout.require(policy.layout, str(path))
    success, besides = [], []
    for lag_s in lags_s:
        task.set_params({**training.numbers, "scan_lag_s": lag_s})
        task.reset(WORLDS_SEED)
        outcomes, measures = first_episodes(policy, task, training.longest)
        success.append(rate(outcomes == Outcome.SUCCESS))
        besides.append(training.besides(outcomes, measures))
    return Judged(path, tuple(success), tuple(besides))


def main(arguments: Sequence[str]) -> int:
    if not arguments or arguments[0] not in TRAININGS:
        print(f"training_seeds: name one of {', '.join(TRAININGS)}")
        return 2
    name, words = arguments[0], arguments[1:]
    if words and words[0].startswith("seed="):
        if len(words) != 2 or words[1] not in TRAININGS[name].legs:
            print(f"training_seeds: after seed=N name one of {', '.join(TRAININGS[name].legs)}")
            return 2
        train(name, int(words[0].removeprefix("seed=")), words[1])
        return 0
    if not words and (failed := train_all(name)):
        print(f"training_seeds: {', '.join(failed)} failed; see the ends of their logs in {RESULTS}")
        return 1
    named = [Path(text) for text in words if text not in ("judge", "test")]
    split = "test" if "test" in words else "validation"
    paths = named or [policy_of(name, seed, TRAININGS[name].legs[-1]) for seed in SEEDS]
    print(HEAD, flush=True)
    found = []
    for path in paths:
        found.append(judged(TRAININGS[name], path, split))
        print(found[-1].row, flush=True)
    if split == "test":
        return 0
    best = max(found, key=lambda each: each.low)
    print(f"chosen: {best.path}, whose intervals begin at {100 * best.low:.1f} % on average")
    if not named:
        write_judged(best.path, _chosen(name), "success", best.success[LAGS_S.index(0.0)], TRAININGS[name].episodes)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
