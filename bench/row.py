"""One measured figure, the best of several tries, and the machine it was measured on."""

import os
import platform
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Literal


@dataclass(frozen=True, slots=True)
class Row:
    """A line of `bench/results.json`."""

    name: str
    value: float
    unit: str
    better: Literal["higher", "lower"]
    target: float | None
    """At least, or at most, what `value` must be; None: only shown."""
    command: str

    @property
    def is_met(self) -> bool:
        if self.target is None:
            return True
        return self.value >= self.target if self.better == "higher" else self.value <= self.target


class WrongResult(Exception):
    """What was to be timed does not do what it should."""


def require(is_right: object, sentence: str) -> None:
    """Stops a benchmark whose result is wrong: its speed means nothing.

    Raises:
        WrongResult: it is.
    """
    if not is_right:
        raise WrongResult(sentence)


def best_of(count: int, measure: Callable[[], float]) -> float:
    """The smallest of several times: what the machine can do when nothing disturbs it."""
    return min(measure() for _ in range(count))


def machine() -> str:
    """Processor, cores and versions, in one line."""
    names = [line.split(":", 1)[1].strip() for line in _cpu_lines() if line.startswith("model name")]
    cpu = names[0] if names else platform.processor() or platform.machine()
    return (
        f"{cpu}, {os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}, "
        f"Warp {version('warp-lang')}, NumPy {version('numpy')}"
    )


def _cpu_lines() -> list[str]:
    path = Path("/proc/cpuinfo")
    return path.read_text(encoding="utf-8").splitlines() if path.exists() else []
