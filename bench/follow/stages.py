"""The stages of the reproduction: what is trained after what, on what it is judged, and what was reported."""

from dataclasses import dataclass, field
from itertools import product
from typing import Any

TREES_PER_HA = (50.0, 100.0, 200.0)
OWNER_SPEEDS = (2.0, 5.0)  # [m/s] the fastest walk, and the fastest run


@dataclass(frozen=True, slots=True)
class Cell:
    """Held-out worlds of one tree density, with owners of one class of speed."""

    trees_per_ha: float
    owner_speed_max: float  # [m/s]


CELLS = tuple(Cell(trees, speed) for speed, trees in product(OWNER_SPEEDS, TREES_PER_HA))


@dataclass(frozen=True, slots=True)
class Stage:
    """One training, and how what comes of it is judged."""

    name: str
    title: str
    recipe: str
    teacher: str | None = None  # stage whose policy teaches
    start: str | None = None  # stage whose networks this one starts from
    changes: dict[str, Any] = field(default_factory=dict)  # of the recipe: path with dots to value
    judged: dict[str, Any] = field(default_factory=dict)  # settings of the task to judge in, over the recipe's
    reward: str = "ours"  # or the trackers', whose costs grow by lessons, or the document's: they cannot be compared
    takes_all: bool = False  # its training is given all cores
    flies: bool = False  # also judged in flights over MAVLink
    ships: bool = True  # with --publish the best seed's policy goes to policies/pretrained/
    ships_as: str = ""  # under this name; the recipe's, if none
    document: str = "not reported"
    limit_s: float | None = None  # wall clock at most, with all stages before it
    figure: str = "in_band"  # of the scorecard, that the targets are of
    targets: tuple[float | None, float | None] = (None, None)  # at OWNER_SPEEDS, at least

    @property
    def before(self) -> tuple[str, ...]:
        """Stages that must be done first."""
        return tuple(name for name in (self.teacher, self.start) if name is not None)

    @property
    def file_name(self) -> str:
        """Of the policy that ships."""
        return f"{self.ships_as or self.recipe}.pt"


STAGES: dict[str, Stage] = {
    stage.name: stage
    for stage in (
        Stage("teacher", "Teacher: sees the truth, PPO", "follow-me-teacher"),
        Stage(
            "student",
            "Improved: camera and phone, DAgger",
            "follow-me",
            teacher="teacher",
            flies=True,
            ships=False,
            document="reward 20 to 30, not ready for use, 36.4 h",
            limit_s=1800.0,
            targets=(0.98, 0.85),
        ),
        Stage(
            "tuned",
            "Tuned: the improved student goes on by PPO, its critic sees the truth",
            "follow-me-tuned",
            start="student",
            flies=True,
            ships=False,
        ),
        Stage(
            "late",
            "Hardened: the improved student goes on in late, lost, dark and depthless images, DAgger",
            "follow-me-late",
            teacher="teacher",
            start="student",
            flies=True,
            ships=False,
            limit_s=3600.0,
        ),
        Stage(
            "vision-only",
            "Vision only: no word of the owner, DAgger",
            "follow-me-vision",
            teacher="teacher",
            flies=True,
            ships=False,
            document="best published drone tracking success: about 72 % (GC-VAT)",
            figure="success",
            targets=(0.85, None),
        ),
        Stage(
            "tracked-student",
            "Tracked, first: what detector, filter and map say, no image, DAgger",
            "follow-me-tracked-student",
            teacher="teacher",
            reward="the trackers'",
            ships=False,
        ),
        Stage(
            "tracked",
            "Tracked, then: that student goes on by PPO",
            "follow-me-tracked",
            start="tracked-student",
            reward="the trackers'",
            ships=False,
        ),
        Stage(
            "tracked-wide",
            "Tracked: goes on by PPO on the estimate, with rough sensors, in three airframes",
            "follow-me-tracked-wide",
            start="tracked",
            reward="the trackers'",
            flies=True,
            ships_as="follow-me-tracked",
            limit_s=3600.0,
            targets=(0.98, 0.95),
        ),
        Stage(
            "document",
            "As documented: pixels and seven numbers, plain PPO",
            "follow-me-document",
            document="reward 20 to 30, 10 M steps, 36.4 h",
            limit_s=7200.0,
            reward="the document's",
            takes_all=True,
            ships=False,
        ),
    )
}


def in_order(names: list[str]) -> list[Stage]:
    """The stages of these names and those they need, each after what it needs."""
    found: dict[str, Stage] = {}

    def add(name: str) -> None:
        for before in STAGES[name].before:
            add(before)
        found.setdefault(name, STAGES[name])

    for name in names:
        add(name)
    return list(found.values())
