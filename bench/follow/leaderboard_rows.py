"""The leaderboard of `honeyguide benchmark follow`: what an entry has flown, and who is ahead.

In: `flights.json` of the benchmark, flown as CONDITIONS, FLIGHTS and FIRST_SEED say. Out: rows of
docs/results/leaderboard.jsonl, one line an entry, and their order.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.cars.page import DOCS
from common.files import write_whole
from common.intervals import Interval, bootstrap, rate

ROWS = DOCS / "leaderboard.jsonl"
CONDITIONS = ("walk", "run", "late-200", "gone-8", "no-depth", "twins")
FLIGHTS = 8  # of each condition
FIRST_SEED = 3_500_001
SEEDS = tuple(FIRST_SEED + 2 * k for k in range(FLIGHTS))


class EntryError(ValueError):
    """Flights that cannot be compared with the others; the text is one sentence for the user."""


@dataclass(frozen=True, slots=True)
class Flown:
    """What is kept of a flight."""

    in_band: float  # [1] of the planned time
    is_collided: bool
    is_somebody_hit: bool
    nearest_m: float  # to the owner's chest
    interventions_per_min: float  # decisions that the guard changed


@dataclass(frozen=True, slots=True)
class Entry:
    """One row: who flew, and what came of the same flights as everybody's."""

    name: str
    policy: str  # as --policy has it
    sees: str
    made: str  # by whom or what, on what, for how long
    flights: Mapping[str, tuple[Flown, ...]]
    """By condition, in the order of SEEDS."""
    commit: str = ""  # of the code that flew it: guard, senses, vehicle

    def figure(self, name: str) -> NDArray[np.float64]:
        """A figure of all flights, shape (conditions, seeds)."""
        return np.array([[getattr(flown, name) for flown in self.flights[key]] for key in CONDITIONS], dtype=float)

    @property
    def score(self) -> float:
        """[1] in band: the mean over the conditions, each of which counts the same."""
        return float(self.figure("in_band").mean())

    @property
    def clear(self) -> Interval:
        """The fraction of the flights that touched nothing and nobody."""
        return rate(self.figure("is_collided").ravel() == 0.0)


def score_interval(entry: Entry, other: Entry | None = None) -> Interval:
    """The score with its interval over seeds; with another, by how much that one's is higher on the same seeds."""
    figures = entry.figure("in_band")
    if other is not None:
        figures = other.figure("in_band") - figures
    return bootstrap(FLIGHTS, lambda seeds: float(figures[:, seeds].mean()))


def ranked(entries: Iterable[Entry]) -> list[Entry]:
    """The best first: by the score, then by the flights that touched nothing, then by name."""
    return sorted(entries, key=lambda entry: (-round(entry.score, 4), -entry.clear.value, entry.name))


def entry_from(record: Mapping[str, Any], name: str, sees: str, made: str) -> Entry:
    """An entry of what the benchmark has written.

    Args:
        record: `flights.json`, read.
        name: of the entry, as the page has it.
        sees: what the policy is shown.
        made: how it came to be.

    Raises:
        EntryError: other flights than those of the other entries.
    """
    if record.get("task") != "follow" or not record.get("has_guard"):
        raise EntryError("flights.json: entries fly `benchmark follow` under the guard")
    if record.get("guard_settings"):
        raise EntryError(f"flights.json: entries fly under the guard as it ships, not with {record['guard_settings']}")
    flights = record["flights"]
    missing = [key for key in CONDITIONS if key not in flights]
    if missing:
        raise EntryError(f"flights.json: no flights of {', '.join(missing)}")
    for key in CONDITIONS:
        seeds = tuple(flown["seed"] for flown in flights[key])
        if seeds != SEEDS:
            raise EntryError(f"flights.json: {key}: seeds {seeds}, wanted {SEEDS}")
    commit = record.get("code", {}).get("commit", "")
    policy = record["policy"]
    return _parsed({"name": name, "policy": policy, "sees": sees, "made": made, "flights": flights, "commit": commit})


def read_rows(path: Path = ROWS) -> list[Entry]:
    """The entries of a file of rows; none without a file."""
    if not path.exists():
        return []
    return [_parsed(json.loads(line)) for line in path.read_text(encoding="utf-8").splitlines()]


def write_rows(entries: Iterable[Entry], path: Path = ROWS) -> None:
    """Writes a line for each entry, the best first."""
    lines = [json.dumps(asdict(entry), separators=(",", ":"), ensure_ascii=False) + "\n" for entry in ranked(entries)]
    write_whole(path, "".join(lines).encode())


def _parsed(raw: Mapping[str, Any]) -> Entry:
    flights = {key: tuple(_flown(flown) for flown in raw["flights"][key]) for key in CONDITIONS}
    return Entry(raw["name"], raw["policy"], raw["sees"], raw["made"], flights, raw.get("commit", ""))


def _flown(raw: Mapping[str, Any]) -> Flown:
    return Flown(
        round(raw["in_band"], 4),
        raw["is_collided"],
        raw["is_somebody_hit"],
        round(raw["nearest_m"], 3),
        round(raw["interventions_per_min"], 1),
    )
