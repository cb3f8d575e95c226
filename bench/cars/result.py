"""What one training run came to; kept as JSON, so that a stopped reproduction goes on where it was."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

from bench.cars.statistics import Interval, wilson
from common.files import write_whole


@dataclass(frozen=True, slots=True)
class Point:
    """One point of a training curve, over the episodes that ended since the last."""

    steps: int
    wall_s: float
    success: float
    reward: float


@dataclass(frozen=True, slots=True)
class Evaluated:
    """A policy on held-out episodes, taking its most probable actions."""

    label: str
    successes: int
    episodes: int
    drawn_successes: int  # of as many episodes with actions drawn, as ML-Agents' runtime draws them by default
    mean_return: float
    outcomes: dict[str, int]

    @property
    def success(self) -> Interval:
        return wilson(self.successes, self.episodes)


@dataclass(frozen=True, slots=True)
class Result:
    """One run of one experiment."""

    experiment: str
    seed: int
    steps: int
    train_s: float  # wall clock of training, kernels compiled before
    threads: int
    machine: str
    policy_bytes: int
    curve: list[Point]
    evaluations: list[Evaluated]

    @property
    def steps_per_s(self) -> float:
        return self.steps / self.train_s


def write(path: Path, result: Result) -> None:
    """Writes a result whole."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, (json.dumps(asdict(result), indent=1) + "\n").encode())


def read(path: Path) -> Result:
    """Reads what `write` wrote."""
    raw = json.loads(path.read_text(encoding="utf-8"))
    raw["curve"] = [Point(**point) for point in raw["curve"]]
    raw["evaluations"] = [Evaluated(**evaluated) for evaluated in raw["evaluations"]]
    return Result(**raw)
