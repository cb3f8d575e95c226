"""What a dataset is made of: whole episodes, and where they come from. A row more of observations than of actions."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from policies.tasks.layout import Layout

NUMBER_NOTE = "number "  # what notes of a task's numbers begin with


class DatasetError(ValueError):
    """A dataset, or what it is to be made from, that cannot be used; the message is one sentence for the user."""


@dataclass(frozen=True, slots=True, eq=False)
class EpisodeRows:
    """One episode."""

    observations: NDArray[np.float32]  # (steps + 1, elements)
    actions: NDArray[Any]  # as in the Gymnasium space: (steps, continuous) float32, (steps, ...) int64
    rewards: NDArray[np.float64]  # (steps,)
    is_terminated: bool  # by the last step; else the episode was cut there
    outcome: str  # as `Outcome`, in small letters
    images: NDArray[np.uint8] | None = None  # (steps + 1, height, width, channels); part of the observations or beside
    context: Mapping[str, str | float] = field(default_factory=dict)
    """Where it comes from and what it was flown in: source, airframe, wind."""

    def __post_init__(self) -> None:
        """Checks the shapes.

        Raises:
            DatasetError: they do not fit each other, or a number is none.
        """
        steps = len(self.rewards)
        if not steps or len(self.observations) != steps + 1 or len(self.actions) != steps:
            raise DatasetError(
                f"an episode of {steps} rewards has {len(self.observations)} observations, {len(self.actions)} actions"
            )
        if self.images is not None and len(self.images) != steps + 1:
            raise DatasetError(f"an episode of {steps + 1} observations has {len(self.images)} images")
        if not all(np.isfinite(array).all() for array in (self.observations, self.actions, self.rewards)):
            raise DatasetError("an episode holds a value that is not finite")

    def __len__(self) -> int:
        return len(self.rewards)

    @property
    def is_success(self) -> bool:
        return self.outcome == "success"


@dataclass(frozen=True, slots=True)
class DatasetOrigin:
    """What a whole dataset is of."""

    layout: Layout
    settings: Mapping[str, Any]  # of the task, as JSON
    pilot: str  # who flew or drove: "expert" in the metadata
    seed: int = 0
    rewards_by: str = "truth"  # or "estimate": what the rewards and ends were made from
    notes: Mapping[str, str] = field(default_factory=dict)
