"""Distributions of varied values. Light to import.

Each is drawn by its quantile: a run's value is the quantile of one uniform number. Searches that lean towards failures
move that number and know by how much; so all distributions are sampled, and searched, in the same way.
"""

from math import exp, log
from statistics import NormalDist
from typing import ClassVar, Self

from pydantic import Field, model_validator

from mission.scenario.parts.part import Finite, OneOf, Part

STANDARD = NormalDist()
TAIL_STD = 4.0  # where a normal distribution is cut that says nothing of it
Value = float | int | str | bool


class Normal(Part):
    """A normal distribution, cut."""

    mean: Finite
    std: float = Field(gt=0.0, allow_inf_nan=False)
    min: Finite | None = None
    """Left out: four standard deviations below the mean."""
    max: Finite | None = None

    @model_validator(mode="after")
    def _has_inside(self) -> Self:
        low, high = self.bounds
        if low >= high:
            raise ValueError(f"min {low:g} must be below max {high:g}")
        if STANDARD.cdf((high - self.mean) / self.std) - STANDARD.cdf((low - self.mean) / self.std) < 1e-9:
            raise ValueError("next to nothing of it lies between min and max")
        return self

    @property
    def bounds(self) -> tuple[float, float]:
        low = self.mean - TAIL_STD * self.std if self.min is None else self.min
        return low, self.mean + TAIL_STD * self.std if self.max is None else self.max


class Distribution(OneOf):
    """Where the value of a key comes from."""

    what: ClassVar[str] = "distribution"
    uniform: tuple[Finite, Finite] | None = None
    """From, to."""
    normal: Normal | None = None
    loguniform: tuple[Finite, Finite] | None = None
    """From, to, both above 0; each factor is as likely as its inverse."""
    integers: tuple[int, int] | None = None
    """Whole numbers from, to, both may come."""
    choice: tuple[float | int | str | bool, ...] | None = Field(default=None, min_length=1, max_length=1000)
    """One of these, each as likely."""

    @model_validator(mode="after")
    def _is_in_order(self) -> Self:
        for name in ("uniform", "loguniform", "integers"):
            given = getattr(self, name)
            if given is not None and given[0] >= given[1]:
                raise ValueError(f"{name}: the first bound must be below the second, not {given[0]:g}, {given[1]:g}")
        if self.loguniform is not None and self.loguniform[0] <= 0.0:
            raise ValueError(f"loguniform: bounds must be above 0, not {self.loguniform[0]:g}")
        return self

    @property
    def is_ordered(self) -> bool:
        """Whether its values are numbers that are more or less of something."""
        given = self.choice
        return given is None or all(isinstance(v, int | float) and not isinstance(v, bool) for v in given)

    @property
    def values(self) -> tuple[Value, ...]:
        """The least and the greatest, or all choices: what is checked before anything is flown."""
        if self.choice is not None:
            return self.choice
        return self.quantile(0.0), self.quantile(1.0)

    def quantile(self, fraction: float) -> Value:
        """The value that a fraction of all are below."""
        fraction = min(max(fraction, 0.0), 1.0)
        if self.choice is not None:
            return self.choice[min(int(fraction * len(self.choice)), len(self.choice) - 1)]
        if self.integers is not None:
            low, high = self.integers
            return min(low + int(fraction * (high - low + 1)), high)
        if self.loguniform is not None:
            low_log, high_log = (log(bound) for bound in self.loguniform)
            return min(max(exp(low_log + fraction * (high_log - low_log)), self.loguniform[0]), self.loguniform[1])
        if self.normal is not None:
            return _cut_normal(self.normal, fraction)
        first, last = self.uniform or (0.0, 0.0)
        return min(first + fraction * (last - first), last)


def _cut_normal(normal: Normal, fraction: float) -> float:
    low, high = normal.bounds
    below, above = (STANDARD.cdf((bound - normal.mean) / normal.std) for bound in (low, high))
    at = below + fraction * (above - below)
    if not 0.0 < at < 1.0:
        return low if at <= 0.0 else high
    return min(max(normal.mean + normal.std * STANDARD.inv_cdf(at), low), high)
