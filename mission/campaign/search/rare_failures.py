"""How probable a rare failure is: importance sampling, with what is drawn found by the cross-entropy method.

In: a number of runs. Out: the probability with its 95 % interval. In the space of standard normal numbers the mean
moves, level by level, to where margins are least (Rubinstein and Kroese 2004); then runs are drawn from there, one in
five from the distributions themselves, so that no weight is above five (defensive mixture, Hesterberg 1995).
"""

from dataclasses import dataclass
from math import sqrt

import numpy as np
import numpy.typing as npt

from common.intervals import Z_95
from mission.campaign.campaign import SEED_KEY, Campaign, Rare
from mission.campaign.flying import Flights
from mission.campaign.runs import Record
from mission.campaign.sampling import draw, order_at, stream

LEVELS = 5
ELITE = 0.1  # of a level, unless more fail
PLAIN = 0.2  # of the runs that count come from the distributions themselves
SHIFT_MAX = 4.0  # standard deviations
Rows = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class RareFound:
    """What was found about rare failures."""

    probability: float
    low: float
    high: float
    failed_count: int
    records: tuple[Record, ...]
    """Those that were counted."""
    shift: dict[str, float]
    """How far each key was moved towards failures [standard deviations]."""

    @property
    def sentence(self) -> str:
        count = len(self.records)
        if not self.failed_count:
            where = f"none in {count} runs drawn where margins are least"
            return f"rare failures: {where}; below {self.high:.2g}, if they are there"
        interval = f"95 % interval {self.low:.2g} to {self.high:.2g}"
        counted = f"from {self.failed_count} failures in {count} runs"
        return f"rare failures: probability {self.probability:.2g}, {interval}, {counted}"


def estimate_rare(flights: Flights, search: Rare, phase: str) -> RareFound:
    """Moves to where failures are, then counts them."""
    campaign = flights.campaign
    shift, first = np.zeros(len(campaign.vary)), 0
    size = max(4, search.runs // 2 // LEVELS)
    for _ in range(LEVELS):
        z, weights, records = _fly(flights, phase, range(first, first + size), shift)
        first += size
        failing = np.array([not record.passed for record in records])
        if failing.sum() < ELITE * size:
            order = sorted(range(size), key=lambda i: (records[i].passed, records[i].score))
            failing[order[: max(2, round(ELITE * size))]] = True
        shift = _moved(campaign, z[failing], weights[failing])
    _, weights, records = _fly(flights, phase, range(first, max(search.runs, first + size)), shift)
    counted = weights * np.array([not record.passed for record in records])
    probability, count = float(counted.mean()), len(records)
    half = Z_95 * float(counted.std(ddof=1)) / sqrt(count)
    failed = sum(not record.passed for record in records)
    high = min(1.0, probability + half) if failed else 3.0 * float(weights.max()) / count  # the rule of three
    moved = {key: round(float(by), 3) for key, by in zip(campaign.vary, shift, strict=True)}
    return RareFound(probability, max(0.0, probability - half), min(1.0, high), failed, tuple(records), moved)


def _fly(flights: Flights, phase: str, numbers: range, shift: Rows) -> tuple[Rows, Rows, list[Record]]:
    campaign = flights.campaign
    z = np.array([draw(campaign, phase, number) for number in numbers])
    is_moved = np.array([stream(campaign, f"{phase} part", number).random() >= PLAIN for number in numbers])
    z[is_moved] += shift
    weights = 1.0 / (PLAIN + (1.0 - PLAIN) * np.exp(z @ shift - 0.5 * shift @ shift))
    orders = [order_at(campaign, phase, n, at, float(w)) for n, at, w in zip(numbers, z, weights, strict=True)]
    return z, weights, flights.fly(orders)


def _moved(campaign: Campaign, z: Rows, weights: Rows) -> Rows:
    """The mean of what failed, as probable as it is; of seeds no one leads to the next."""
    mean: Rows = np.clip((weights[:, None] * z).sum(axis=0) / weights.sum(), -SHIFT_MAX, SHIFT_MAX)
    if SEED_KEY in campaign.vary:
        mean[list(campaign.vary).index(SEED_KEY)] = 0.0
    return mean
