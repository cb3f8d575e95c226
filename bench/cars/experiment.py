"""The experiments of the reproduction: what is trained, how often, on what it is judged, and what was reported."""

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, slots=True)
class Judged:
    """Held-out episodes of one kind."""

    label: str
    settings: dict[str, Any] = field(default_factory=dict)  # of the task, over those of the recipe
    episodes: int = 1000
    chooses: bool = False  # by these the seed is chosen whose policy ships: the one whose interval begins highest


@dataclass(frozen=True, slots=True)
class Experiment:
    """One row of the results."""

    name: str
    title: str
    recipe: str
    seeds: int = 5
    settings: dict[str, Any] = field(default_factory=dict)  # of the task, over those of the recipe
    changes: dict[str, Any] = field(default_factory=dict)  # of the recipe: path with dots to value
    judged: tuple[Judged, ...] = (Judged("held out"),)
    document: str = "not reported"
    target: float | None = None  # success at least
    limit_s: float | None = None  # wall clock at most
    threads: int = 1


NEW_SPOTS = Judged("new spots", {"split": "test"})
VALIDATION = Judged("validation spots", {"split": "validation"}, episodes=4000, chooses=True)
OTHER_DRAWS = Judged("validation draws", episodes=4000, chooses=True)  # of a task whose splits are alike
PARKING2_SPOTS = (
    Judged("training spots", {"split": "train"}),
    Judged("new spots, storey 1", {"split": "test", "storey": "1"}),
    Judged("new spots, storey 2", {"split": "test", "storey": "2"}),
)
