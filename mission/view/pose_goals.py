"""Where people can send a companion that drives into poses: named places, and anywhere by a click."""

from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Any

from mission.script import Drone

Pose = tuple[float, float, float]
"""North, east [m] and heading [rad]; NaN: any."""


@dataclass(frozen=True, slots=True)
class PoseGoals:
    """What the page shows of such a companion, and asks of it."""

    named: tuple[tuple[str, Pose], ...]  # a button each
    go: Callable[[Drone, Pose], Coroutine[Any, Any, None]]
    now: Callable[[], Pose | None]  # where it drives; None: nowhere
