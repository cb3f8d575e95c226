"""What users may choose of every task that is flown or driven."""

from typing import ClassVar

from policies.tasks.task import TaskSettings


class RigSettings(TaskSettings):
    """Of vehicles with their flight controllers."""

    conditions: ClassVar = TaskSettings.conditions | {"has_estimator"}

    has_estimator: bool = True
    """Whether the flight controller goes by its estimate; if not, by the truth: quicker, in training only."""
