"""What people wear, as far as images show it: whether two are likely the same person.

In: colours of chests. Out: a logarithm of a likelihood ratio. Who looks alike may be another in the same clothes; who
looks otherwise hardly is the same.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
# Measured in flights: colours of one person about their mean, and of people's means.
_SCATTER_VAR = np.array([0.014, 0.040, 0.036])
_APART = 2.2  # what is gained where there is no difference: people's means are so much farther apart, in logarithms,
_MATCHES = 1.6  # and at most: one of five others may wear the same
_DIFFERS = -4.0  # what is lost at most: light may have changed
UNLIKE = -3.0  # likeness below which two look otherwise
_SLOW = 0.5  # of the scatter is of light, which changes slowly
_MEMORY = 8  # images
_ENOUGH = 3  # images, before anything is said


@dataclass(slots=True)
class Looks:
    """Of one person."""

    mean: Floats | None = None
    """Of their colours, as a detection has them."""
    images: int = 0

    def see(self, colours: Floats | None, memory: int = _MEMORY) -> None:
        """Takes in an image."""
        if colours is None:
            return
        self.images = min(self.images + 1, memory)
        self.mean = colours if self.mean is None else self.mean + (colours - self.mean) / self.images


def likeness(one: Looks, other: Looks) -> float:
    """Logarithm of how much likelier two are the same person than not; 0: nobody knows yet."""
    if one.mean is None or other.mean is None or max(one.images, other.images) < _ENOUGH:
        return 0.0
    off = one.mean - other.mean
    scatter = _SLOW + (1.0 - _SLOW) * (1.0 / one.images + 1.0 / other.images)
    return float(np.clip(_APART - 0.5 * float((off * off / _SCATTER_VAR).sum()) / scatter, _DIFFERS, _MATCHES))
