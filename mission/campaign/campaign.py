"""A campaign: a scenario, what varies in it and how, how often it is flown, what is searched. Light to import."""

import re
from pathlib import Path
from typing import ClassVar, Self

from pydantic import Field, model_validator

from mission.campaign.distributions import Distribution
from mission.scenario.parts.part import FileName, Finite, OneOf, Part, Short
from mission.scenario.scenario import Scenario

SEED_KEY = "seed"
SEED_MAX = 2**31 - 1
_REQUIRED = re.compile(r"^success >= (0(\.\d+)?|1(\.0+)?)$")


class Boundary(Short):
    """Where along one key success turns into failure, by bisection; all else is as in the scenario."""

    short: ClassVar[str] = "key"
    key: str
    low: Finite | None = None
    """Left out, as `high`: the bounds of the key's distribution."""
    high: Finite | None = None
    within: float | None = Field(default=None, gt=0.0)
    """So near the boundary is found; left out: a hundredth of the range."""
    seeds: int = Field(default=3, ge=1, le=100)
    """Flights with so many seeds are bisected, each by itself."""


class Worst(Part):
    """The worst values of some keys, by the cross-entropy method on the least margin."""

    keys: tuple[str, ...] = Field(min_length=1, max_length=20)
    runs: int = Field(default=100, ge=10, le=100_000)
    seed: int = Field(default=1, ge=0, le=SEED_MAX)
    """Of the flights: the same for all, so that only the keys differ."""


class Rare(Part):
    """How probable a rare failure is: the distributions lean towards it step by step, and each run is weighed."""

    runs: int = Field(default=400, ge=40, le=1_000_000)
    """Half of them to find where failures are, half to count them."""


class Search(OneOf):
    """One search; its runs come after the samples."""

    what: ClassVar[str] = "search"
    bisect: Boundary | None = None
    worst: Worst | None = None
    rare: Rare | None = None


class Campaign(Part):
    """One campaign."""

    name: FileName = ""
    """Left out: the file's."""
    about: str = ""
    """What it is to show, in a sentence."""
    scenario: Path | Scenario
    """A scenario file, or a scenario written out."""
    vary: dict[str, Distribution] = Field(min_length=1, max_length=100)
    """Keys of the scenario with dots and numbers from 0: `wind.speed_m_s`, `faults.0.at`; `seed` is the flight's."""
    runs: int = Field(default=1000, ge=0, le=10_000_000)
    """Samples of all keys together."""
    seed: int = Field(default=1, ge=0, le=SEED_MAX)
    """Of what is drawn; and, unless `seed` varies, of the flights: each has one of its own."""
    margin: str = ""
    """The name of the check whose margin is the least one; left out: the least of all, whatever their units."""
    require: str = ""
    """`success >= 0.95`: the command fails below it."""
    search: tuple[Search, ...] = ()

    @model_validator(mode="before")
    @classmethod
    def _one_search_is_a_list(cls, given: object) -> object:
        if isinstance(given, dict) and isinstance(given.get("search"), dict):
            return {**given, "search": [given["search"]]}
        return given

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.require and not _REQUIRED.match(self.require):
            raise ValueError(f"require: must be 'success >= FRACTION', as 'success >= 0.95', not '{self.require}'")
        for number, search in enumerate(self.search):
            keys = [search.bisect.key] if search.bisect else list(search.worst.keys) if search.worst else []
            for key in keys:
                if key not in self.vary:
                    raise ValueError(f"search[{number}]: '{key}' is not among the varied: {', '.join(self.vary)}")
            if search.bisect is not None:
                self._check_bisection(number, search.bisect)
        return self

    def _check_bisection(self, number: int, search: Boundary) -> None:
        distribution = self.vary[search.key]
        if distribution.choice is not None or distribution.integers is not None:
            raise ValueError(f"search[{number}]: '{search.key}': bisection needs uniform, normal or loguniform")
        low, high = self.range_of(search)
        if low >= high:
            raise ValueError(f"search[{number}]: low {low:g} must be below high {high:g}")

    def range_of(self, search: Boundary) -> tuple[float, float]:
        """Between which values a boundary is looked for."""
        low, high = (float(value) for value in self.vary[search.key].values)
        return low if search.low is None else search.low, high if search.high is None else search.high

    @property
    def flown(self) -> Scenario:
        """The scenario that is flown, once its file has been read."""
        if not isinstance(self.scenario, Scenario):
            raise TypeError(f"{self.scenario} has not been read")
        return self.scenario

    @property
    def success_min(self) -> float | None:
        """The fraction that is required."""
        return float(self.require.rpartition(" ")[2]) if self.require else None
