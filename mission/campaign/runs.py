"""One run of a campaign: what is flown, and what came of it. Plain values, written as JSON. Light to import."""

import re
from dataclasses import asdict, dataclass, field
from math import inf, isfinite
from typing import Any

from mission.campaign.distributions import Value
from mission.scenario.result import ScenarioResult

SAMPLE = "sample"
_VEHICLE = re.compile(r"^vehicle \d+: ")  # before the name of a result, where there are several vehicles


@dataclass(frozen=True, slots=True)
class Order:
    """One run, before it is flown."""

    phase: str
    """`sample`, or which search it is of: `bisect-0`, `worst-1`."""
    number: int
    """Within the phase, from 0."""
    seed: int
    """Of the flight."""
    values: dict[str, Value]
    """Of the varied keys."""
    weight: float = 1.0
    """How much more probable it is by the distributions than by what it was drawn from."""

    @property
    def key(self) -> tuple[str, int]:
        return self.phase, self.number

    @property
    def folder(self) -> str:
        """What its folder is called if it is kept."""
        return f"{self.phase}-{self.number}"


@dataclass(frozen=True, slots=True)
class Record:
    """One run, flown."""

    phase: str
    number: int
    seed: int
    values: dict[str, Value]
    weight: float
    passed: bool
    margin: float | None
    """The least one; None: it has none, or the run ended before it was judged."""
    check: str = ""
    """Whose margin that is."""
    unit: str = ""
    error: str = ""
    """Why it was not flown to its end."""
    is_lost: bool = False
    """Its process ended or hung."""
    failures: tuple[str, ...] = ()
    verdicts: dict[str, bool] = field(default_factory=dict)
    """Of each check by its name."""
    margins: dict[str, float] = field(default_factory=dict)
    simulated_s: float = 0.0
    cpu_s: float = 0.0

    @property
    def key(self) -> tuple[str, int]:
        return self.phase, self.number

    @property
    def order(self) -> Order:
        return Order(self.phase, self.number, self.seed, self.values, self.weight)

    @property
    def score(self) -> float:
        """By which runs are ranked: the margin; what failed without one is the worst.

        What failed by another check than the one whose margin counts has just failed.
        """
        if self.passed:
            return inf if self.margin is None else self.margin
        return -inf if self.margin is None else min(self.margin, 0.0)

    def as_json(self) -> dict[str, Any]:
        return asdict(self)

    @classmethod
    def from_json(cls, given: dict[str, Any]) -> "Record":
        """Raises TypeError or KeyError where it is no record."""
        return cls(**{**given, "failures": tuple(given["failures"])})


def lost(order: Order, why: str) -> Record:
    """The record of a run whose process ended or hung."""
    return Record(
        order.phase, order.number, order.seed, order.values, order.weight, passed=False, margin=None, error=why,
        is_lost=True, failures=(why,),
    )  # fmt: skip


def record_of(order: Order, result: ScenarioResult, margin_check: str) -> Record:
    """The record of a run that was judged.

    Args:
        order: what was flown.
        result: what came of it.
        margin_check: whose least margin counts, of all its bounds and vehicles; "": the least of all checks.
    """
    margins: dict[str, float] = {}
    for check in result.checks:
        if isfinite(check.margin):
            margins[check.name] = min(check.margin, margins.get(check.name, inf))
    asked = {name: each for name, each in margins.items() if not margin_check or _is_of(name, margin_check)}
    least = min(asked, key=lambda name: asked[name], default="")
    units = {check.name: check.unit for check in result.checks}
    verdicts: dict[str, bool] = {}
    for check in result.checks:
        verdicts[check.name] = check.passed and verdicts.get(check.name, True)
    return Record(
        order.phase, order.number, order.seed, order.values, order.weight,
        passed=result.passed, margin=asked.get(least), check=least, unit=units.get(least, ""), error=result.error,
        failures=tuple(result.failures), verdicts=verdicts, margins=margins,
        simulated_s=result.simulated_s, cpu_s=result.cpu_s,
    )  # fmt: skip


def _is_of(result: str, check: str) -> bool:
    """Whether a result is of a check: a check with several bounds has one for each, and one for each vehicle."""
    return any(name == check or name.startswith(f"{check}: ") for name in (result, _VEHICLE.sub("", result)))
