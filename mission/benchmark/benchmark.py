"""What the benchmark of a task consists of, and which there are.

Light to import but for `benchmark_of`: a wrong option is told at once.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mission.benchmark.kept_flight import KeptFlight
    from policies.companion.guard.settings import GuardSettings

TASKS = {
    "follow": ("mission.follow.benchmark.following", "follow-me-tracked"),
    "navigate": ("mission.benchmark.navigating", "navigate"),
    "park": ("mission.benchmark.parking", "drive-park"),
}
"""By the name on the command line: the module whose BENCHMARK it is, and the policy that is judged if none is named."""
FIRST_SEED = 3_000_003  # odd, as of all tests; no training and no tuning is given those from here on


@dataclass(frozen=True, slots=True)
class Benchmark:
    """Of one task. An outcome is a dataclass of plain numbers and texts, of the task's own."""

    titles: Mapping[str, str]
    """Of the conditions by their names, in the order of the table."""
    columns: tuple[str, ...]
    load: Callable[[str], Any]
    """The pilot that a name means; raises PilotError."""
    fly: "Callable[[Any, str, int, GuardSettings, KeptFlight], Any]"
    """One flight by a pilot in a condition, from a seed, under a guard, of which something may stay: its outcome."""
    row: Callable[[str, Sequence[Any]], tuple[str, ...]]
    """The figures of a condition, as people read them."""
    misses: Callable[[str, Sequence[Any]], list[str]]
    """What fell short in a condition, a sentence each."""


def changed_per_min(interventions: Counter[str] | None, seconds: float) -> float:
    """Decisions that a guard has changed, per minute; None: there was no guard."""
    return 60.0 * (interventions or Counter()).total() / max(seconds, 1.0)


def benchmark_of(task: str) -> Benchmark:
    """The benchmark of a task."""
    found: Benchmark = import_module(TASKS[task][0]).BENCHMARK
    return found
