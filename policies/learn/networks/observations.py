"""What networks see: floats, an image where the task shows one, and what critics alone may see.

All parts share their leading dimensions: rows, or steps and environments. Networks also take a bare tensor of floats,
where there is no image.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from torch import Tensor


@dataclass(frozen=True, slots=True)
class Observation:
    """Observations."""

    vector: Tensor  # (..., floats)
    image: Tensor | None = None  # (..., height, width, channels) uint8
    privileged: Tensor | None = None  # (..., elements), never shown to a policy

    def mapped(self, change: Callable[[Tensor], Tensor]) -> "Observation":
        """The same change to every part."""
        image, privileged = self.image, self.privileged
        return Observation(
            change(self.vector),
            change(image) if image is not None else None,
            change(privileged) if privileged is not None else None,
        )

    def write(self, row: int, observation: "Observation") -> None:
        """Puts what was seen into a row of this, as far as this has its parts."""
        for part, made in ((self.image, observation.image), (self.privileged, observation.privileged)):
            if part is not None and made is not None:
                part[row] = made
        self.vector[row] = observation.vector

    def __getitem__(self, rows: Any) -> "Observation":
        """Those that `rows` picks along the leading dimensions."""
        return self.mapped(lambda part: part[rows])


def as_observation(observations: Tensor | Observation) -> Observation:
    """Floats alone are all that is seen."""
    return observations if isinstance(observations, Observation) else Observation(observations)
