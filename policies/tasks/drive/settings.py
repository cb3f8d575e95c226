"""Drive's settings: what is to be reached, and what a quick training may leave out."""

from typing import ClassVar, Literal

from policies.tasks.task import TaskSettings

DrivePreset = Literal["reach", "park"]


class DriveSettings(TaskSettings):
    """What a user may choose of Drive."""

    conditions: ClassVar = TaskSettings.conditions | {"has_estimator"}

    preset: DrivePreset = "reach"  # type: ignore[assignment]  # of its own, not the documents'
    """`reach`: a pose 5 to 30 m away on a course through hills; `park`: a free spot of a car park."""
    has_estimator: bool = True
    """Whether the flight controller drives on its estimate; if not, on the truth: quicker, in training only."""
