"""Drive's settings: what is to be reached, and what a quick training may leave out."""

from typing import Literal

from policies.tasks.flight.settings import RigSettings

DrivePreset = Literal["reach", "park"]


class DriveSettings(RigSettings):
    """What a user may choose of Drive."""

    preset: DrivePreset = "reach"  # type: ignore[assignment]  # of its own, not the documents'
    """`reach`: a pose 5 to 30 m away on a course through hills; `park`: a free spot of a car park."""
