"""What came of a scenario: plain values that can be pickled, written as JSON and compared. Light to import."""

from dataclasses import asdict, dataclass
from math import isfinite, nan
from pathlib import Path
from typing import Any


@dataclass(frozen=True, slots=True)
class CheckResult:
    """One thing that was asked, and what happened."""

    name: str
    passed: bool
    asked: str
    """As "tilt at most 30 deg"."""
    happened: str
    """As "24.1 deg at 13.2 s"."""
    margin: float = nan
    """Room left to the bound, in `unit`; negative: beyond it; NaN: it has no bound."""
    unit: str = ""
    worst_s: float = nan
    """Simulated time of the worst moment; NaN: there is none."""


@dataclass(frozen=True, slots=True)
class ScenarioResult:
    """One scenario flown once."""

    name: str
    file: str
    """Of the scenario; "": it was made in Python."""
    seed: int
    checks: tuple[CheckResult, ...]
    error: str = ""
    """Why it could not be flown to its end; "": it was."""
    simulated_s: float = 0.0
    cpu_s: float = 0.0
    """Processor time of this process that it took; no part of what is equal at each run."""
    texts: tuple[tuple[float, int, str], ...] = ()
    """What the vehicles said: simulated time [s], number of the vehicle from 1, text."""
    events: tuple[tuple[float, int, str], ...] = ()
    """What the scenario did, faults and marks: simulated time [s], number of the vehicle (0: of all), in words."""
    folder: str = ""
    """Where its logs are; "": none were written."""
    ulogs: tuple[str, ...] = ()
    tlogs: tuple[str, ...] = ()
    figures: dict[str, float] | None = None
    """Others that were measured, by name."""

    @property
    def passed(self) -> bool:
        """Whether it was flown to its end, and every check passed."""
        return not self.error and all(check.passed for check in self.checks)

    @property
    def failures(self) -> list[str]:
        """What failed, a sentence each."""
        found = [
            f"{check.name}: asked {check.asked}, but {check.happened}" for check in self.checks if not check.passed
        ]
        return [self.error, *found] if self.error else found

    def as_json(self) -> dict[str, Any]:
        """JSON values; null for what is not finite."""
        return {**_finite(asdict(self)), "passed": self.passed}


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if isfinite(value) else None
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each) for each in value]
    return str(value) if isinstance(value, Path) else value
