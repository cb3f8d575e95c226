"""What users may choose of every task that is flown or driven."""

from typing import ClassVar, Literal, get_args

from policies.tasks.task import TaskSettings

RigSplit = Literal["train", "validation", "test"]
SPLITS: tuple[RigSplit, ...] = get_args(RigSplit)


class RigSettings(TaskSettings):
    """Of vehicles with their flight controllers."""

    conditions: ClassVar = TaskSettings.conditions | {"has_estimator"}

    split: RigSplit = "train"  # type: ignore[assignment]  # others have no `validation`
    """`train`, `test`, or `validation`, by which to choose among policies: disjoint sets of worlds, paths, noise and
    starts."""
    has_estimator: bool = True
    """Whether the flight controller goes by its estimate; if not, by the truth: quicker, in training only."""
