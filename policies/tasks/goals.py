"""Goals that are places: what a task says of them so that hindsight replay can put another goal into what was seen."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PositionGoal:
    """The episode ends with success as soon as the achieved place comes nearer to the goal than a radius.

    Both places are elements of the observation in the same unit and frame, and no other element tells of the goal.
    """

    goal: tuple[int, ...]  # elements of the newest frame: where to go
    achieved: tuple[int, ...]  # elements of the newest frame: where one is, in the same order
    radius: str  # the TaskParam that holds it, in the unit of the elements
    reward: float  # paid on reaching the goal; nothing else that is paid depends on the goal
