"""Where along one key success turns into failure, by bisection.

In: a key, its range, seeds. Out: for each seed the interval in which the flight turns from one to the other. It assumes
that it turns once: where both ends pass, or both fail, there is no boundary to find.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import sqrt
from statistics import median

from mission.campaign.campaign import Boundary, Campaign
from mission.campaign.flying import Flights
from mission.campaign.runs import Order, Record

STEPS_MAX = 60  # more halvings than a double has bits left


@dataclass
class Bracket:
    """Between which values one seed's boundary lies."""

    seed: int
    passes: float
    fails: float
    runs: list[Record] = field(default_factory=list)
    has_boundary: bool = True

    @property
    def middle(self) -> float:
        return 0.5 * (self.passes + self.fails)


@dataclass(frozen=True, slots=True)
class BoundaryFound:
    """What bisection has found along a key."""

    key: str
    low: float
    high: float
    within: float
    brackets: tuple[Bracket, ...]

    @property
    def found(self) -> list[Bracket]:
        return [bracket for bracket in self.brackets if bracket.has_boundary]

    @property
    def sentence(self) -> str:
        found, count = self.found, len(self.brackets)
        if not found:
            is_passed = all(record.passed for bracket in self.brackets for record in bracket.runs)
            both = "passes" if is_passed else "does not turn from one to the other"
            return f"{self.key}: no boundary from {self.low:g} to {self.high:g}: it {both} at both ends with each seed"
        places = sorted(bracket.middle for bracket in found)
        fails = "above" if found[0].fails > found[0].passes else "below"
        spread = f" ({places[0]:.4g} to {places[-1]:.4g} by seed)" if len(places) > 1 else ""
        text = f"{self.key}: fails {fails} {median(places):.4g}{spread}, each within {self.within:.2g}"
        return text + (f"; {count - len(found)} of {count} seeds have no boundary" if len(found) < count else "")


def bisect(flights: Flights, search: Boundary, phase: str) -> BoundaryFound:
    """Halves the interval of each seed until it is small enough."""
    campaign = flights.campaign
    scenario = campaign.flown
    low, high = campaign.range_of(search)
    within = (high - low) / 100.0 if search.within is None else search.within
    seeds = [scenario.seeds[0] + i for i in range(search.seeds)]
    ends = flights.fly([_order(search, phase, i, end, seed, value)
                        for i, seed in enumerate(seeds) for end, value in enumerate((low, high))])  # fmt: skip
    brackets = [_bracket(seed, ends[2 * i : 2 * i + 2], low, high) for i, seed in enumerate(seeds)]
    for step in range(2, STEPS_MAX):
        wide = [(i, b) for i, b in enumerate(brackets) if b.has_boundary and abs(b.fails - b.passes) > 2.0 * within]
        if not wide:
            break
        middles = [_middle(campaign, search, bracket) for _, bracket in wide]
        orders = [_order(search, phase, i, step, b.seed, at) for (i, b), at in zip(wide, middles, strict=True)]
        for (_, bracket), at, record in zip(wide, middles, flights.fly(orders), strict=True):
            bracket.runs.append(record)
            if record.passed:
                bracket.passes = at
            else:
                bracket.fails = at
    return BoundaryFound(search.key, low, high, within, tuple(brackets))


def _order(search: Boundary, phase: str, i_seed: int, step: int, seed: int, value: float) -> Order:
    return Order(phase, i_seed * STEPS_MAX + step, seed, {search.key: value})


def _bracket(seed: int, ends: Sequence[Record], low: float, high: float) -> Bracket:
    first, last = ends
    passes, fails = (high, low) if last.passed else (low, high)
    return Bracket(seed, passes, fails, list(ends), first.passed != last.passed)


def _middle(campaign: Campaign, search: Boundary, bracket: Bracket) -> float:
    """By factors where the distribution is one of factors."""
    is_log = campaign.vary[search.key].loguniform is not None and min(bracket.passes, bracket.fails) > 0.0
    return sqrt(bracket.passes * bracket.fails) if is_log else bracket.middle
