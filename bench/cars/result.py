"""What one training run came to; kept as JSON, so that a stopped reproduction goes on where it was."""

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

from common.files import write_whole

POINTS_KEPT = 80  # of a curve, beside the page


@dataclass(frozen=True, slots=True)
class Point:
    """One point of a training curve, over the episodes that ended since the last."""

    steps: int
    wall_s: float  # by the run's clock
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


@dataclass(frozen=True, slots=True)
class Result:
    """One run of one experiment."""

    experiment: str
    seed: int
    steps: int
    train_s: float  # of training by the run's clock, kernels compiled before
    threads: int
    machine: str
    policy_bytes: int
    curve: list[Point]
    evaluations: list[Evaluated]
    clock: Literal["wall", "processor"] = "wall"
    """`processor`: time of the processor, which other work on the machine does not lengthen."""

    @property
    def steps_per_s(self) -> float:
        return self.steps / self.train_s


def write(path: Path, result: Result) -> None:
    """Writes a result whole."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, (json.dumps(asdict(result), indent=1) + "\n").encode())


def read(path: Path) -> Result:
    """Reads what `write` wrote."""
    return _parsed(path.read_text(encoding="utf-8"))


def write_all(path: Path, results: Iterable[Result]) -> None:
    """Writes results as lines of one file, curves thinned: what a page was made of."""
    lines = []
    for result in results:
        raw = asdict(result)
        spacing = max(1, len(raw["curve"]) // POINTS_KEPT)
        raw["curve"] = [{k: round(v, 4) for k, v in point.items()} for point in raw["curve"][::spacing]]
        lines.append(json.dumps(raw, separators=(",", ":")) + "\n")
    write_whole(path, "".join(lines).encode())


def read_all(path: Path) -> list[Result]:
    """Reads what `write_all` wrote."""
    return [_parsed(line) for line in path.read_text(encoding="utf-8").splitlines()]


def _parsed(text: str) -> Result:
    raw = json.loads(text)
    raw["curve"] = [Point(**point) for point in raw["curve"]]
    raw["evaluations"] = [Evaluated(**evaluated) for evaluated in raw["evaluations"]]
    return Result(**raw)
