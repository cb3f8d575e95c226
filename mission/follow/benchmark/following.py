"""The benchmark of following, as `honeyguide benchmark follow` has it."""

from collections.abc import Sequence

from mission.benchmark.benchmark import Benchmark
from mission.follow.benchmark.conditions import BY_NAME
from mission.follow.benchmark.flights import Outcome, fly
from mission.follow.benchmark.pilots import any_pilot
from mission.follow.benchmark.table import COLUMNS, row
from policies.companion.guard.settings import GuardSettings
from policies.companion.skills.following import Pilot


def _flown(pilot: Pilot, condition: str, seed: int, has_guard: bool) -> Outcome:
    return fly(pilot, BY_NAME[condition], seed, GuardSettings(is_on=has_guard))


def _row(name: str, outcomes: Sequence[Outcome]) -> tuple[str, ...]:
    return row(BY_NAME[name], outcomes)


def misses(name: str, outcomes: Sequence[Outcome]) -> list[str]:
    """What fell short of the condition's own bounds, a sentence each."""
    condition, found = BY_NAME[name], []
    band = sum(outcome.in_band for outcome in outcomes) / len(outcomes)
    if condition.least_in_band is not None and band < condition.least_in_band:
        found.append(f"{condition.title}: {band:.1%} of the time in the band, wanted {condition.least_in_band:.0%}")
    hits = sum(outcome.is_collided for outcome in outcomes)
    if hits:
        people = sum(outcome.is_somebody_hit for outcome in outcomes)
        touched = f"touched somebody or something, {people} of them somebody"
        found.append(f"{condition.title}: {hits} of {len(outcomes)} flights {touched}")
    nearest_m = min((o.nearest_hidden_m for o in outcomes if o.nearest_hidden_m == o.nearest_hidden_m), default=9.0)
    if condition.least_m is not None and nearest_m < condition.least_m:
        found.append(f"{condition.title}: {nearest_m:.2f} m from a hidden owner, wanted {condition.least_m:g}")
    return found


BENCHMARK = Benchmark(
    titles={name: condition.title for name, condition in BY_NAME.items()},
    columns=COLUMNS,
    load=any_pilot,
    fly=_flown,
    row=_row,
    misses=misses,
)
