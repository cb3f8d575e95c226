"""The worst values of some keys, by the cross-entropy method (Rubinstein and Kroese 2004) on the least margin.

In: keys and a number of runs. Out: the worst run, and how the search came to it. Each generation is drawn from a normal
distribution in the space of standard normal numbers, and the next one is fitted to its worst fifth; so no value leaves
its distribution's bounds.
"""

from dataclasses import dataclass

import numpy as np

from mission.campaign.campaign import Worst
from mission.campaign.flying import Flights
from mission.campaign.runs import Order, Record
from mission.campaign.sampling import stream, values_at
from mission.campaign.statistics import worst_first

GENERATIONS, GENERATION_MIN = 8, 5
ELITE = 0.2  # of a generation
SMOOTHING = 0.8  # of the new mean and spread, the rest is of the old
STD_MIN = 0.05


@dataclass(frozen=True, slots=True)
class WorstFound:
    """What a search for the worst has found."""

    keys: tuple[str, ...]
    worst: Record
    records: tuple[Record, ...]
    generation: int
    """How many runs each generation has."""

    @property
    def sentence(self) -> str:
        values = ", ".join(f"{key} {_shown(self.worst.values[key])}" for key in self.keys)
        margin = self.worst.error or _margin(self.worst)
        first = worst_first(self.records[: self.generation])[0]
        before = first.error or _margin(first)
        return (
            f"worst of {len(self.records)} runs: {values}: {margin}; the worst of its first {self.generation}: {before}"
        )


def find_worst(flights: Flights, search: Worst, phase: str) -> WorstFound:
    """Draws generations, each nearer to what was worst."""
    campaign, count = flights.campaign, len(search.keys)
    size = max(GENERATION_MIN, -(-search.runs // GENERATIONS))
    mean, std, records = np.zeros(count), np.ones(count), list[Record]()
    while len(records) < search.runs:
        first = len(records)
        numbers = range(first, min(first + size, search.runs))
        z = np.array([mean + std * stream(campaign, phase, number).standard_normal(count) for number in numbers])
        orders = [
            Order(phase, n, search.seed, values_at(campaign, search.keys, at)) for n, at in zip(numbers, z, strict=True)
        ]
        flown = flights.fly(orders)
        records += flown
        worst = sorted(range(len(flown)), key=lambda i: (flown[i].passed, flown[i].score))
        elite = z[worst[: max(2, round(ELITE * len(flown)))]]
        mean = SMOOTHING * elite.mean(axis=0) + (1.0 - SMOOTHING) * mean
        std = np.maximum(SMOOTHING * elite.std(axis=0) + (1.0 - SMOOTHING) * std, STD_MIN)
    return WorstFound(search.keys, worst_first(records)[0], tuple(records), size)


def _shown(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _margin(record: Record) -> str:
    if record.margin is None:
        return "passed" if record.passed else "failed"
    return f"{record.check} {record.margin:.3g} {record.unit}".strip()
