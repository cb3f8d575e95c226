"""What one stage came to; kept as JSON, so that a stopped reproduction goes on where it was."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from math import isnan, nan
from pathlib import Path
from typing import Any

from bench.cars.result import POINTS_KEPT, Point
from common.files import write_whole
from common.intervals import Interval
from policies.tasks.follow_me.scorecard import NAMES, Scorecard


@dataclass(frozen=True, slots=True)
class Judged:
    """The scorecard of one policy on held-out worlds."""

    is_flown: bool  # over MAVLink, one by one; else in batch
    trees_per_ha: float | None  # none: of all densities together
    owner_speed_max: float  # [m/s]
    mean_return: float | None  # of an episode, in the task's reward; flights have none
    card: Scorecard


@dataclass(frozen=True, slots=True)
class Result:
    """One stage with one seed."""

    stage: str
    seed: int
    steps: int
    train_s: float  # wall clock of training, kernels compiled before
    cores: int  # that it was trained on
    machine: str
    policy_bytes: int
    curve: list[Point]
    judged: list[Judged]
    commit: str = ""  # of the code that trained it; none: of before this was kept

    @property
    def steps_per_s(self) -> float:
        return self.steps / self.train_s

    def cards(self, *, is_flown: bool) -> dict[tuple[float | None, float], Judged]:
        """By density (none: all) and owner speed."""
        return {(item.trees_per_ha, item.owner_speed_max): item for item in self.judged if item.is_flown == is_flown}


def write(path: Path, result: Result) -> None:
    """Writes a result whole."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, (json.dumps(_plain(asdict(result), 12), indent=1) + "\n").encode())


def read(path: Path) -> Result:
    """Reads what `write` wrote."""
    return _parsed(json.loads(path.read_text(encoding="utf-8")))


def write_all(path: Path, results: Iterable[Result]) -> None:
    """Writes results as lines of one file, curves thinned: what a page was made of."""
    lines = []
    for result in results:
        raw = asdict(result)
        raw["curve"] = raw["curve"][:: max(1, len(raw["curve"]) // POINTS_KEPT)]
        lines.append(json.dumps(_plain(raw, 4), separators=(",", ":")) + "\n")
    write_whole(path, "".join(lines).encode())


def read_all(path: Path) -> list[Result]:
    """Reads what `write_all` wrote."""
    return [_parsed(json.loads(line)) for line in path.read_text(encoding="utf-8").splitlines()]


def _parsed(raw: dict[str, Any]) -> Result:
    curve = [Point(**point) for point in raw["curve"]]
    judged = [Judged(**(item | {"card": _card(item["card"])})) for item in raw["judged"]]
    return Result(**(raw | {"curve": curve, "judged": judged}))


def _card(raw: Mapping[str, Any]) -> Scorecard:
    figures = {
        name: Interval(**{key: nan if value is None else value for key, value in raw[name].items()}) for name in NAMES
    }
    return Scorecard(**figures, episodes=raw["episodes"], minutes=raw["minutes"])


def _plain(value: Any, digits: int) -> Any:
    """Rounded, and null for what is not known: JSON has no NaN."""
    if isinstance(value, dict):
        return {key: _plain(item, digits) for key, item in value.items()}
    if isinstance(value, list):
        return [_plain(item, digits) for item in value]
    if isinstance(value, float):
        return None if isnan(value) else round(value, digits)
    return value
