"""The benchmark of following, as `honeyguide benchmark follow` has it."""

from collections.abc import Sequence

from mission.benchmark.benchmark import Benchmark
from mission.benchmark.kept_flight import KeptFlight
from mission.follow.benchmark.conditions import BY_NAME, LEAST_KEPT, LEAST_RESUMED, LEAST_STOOD
from mission.follow.benchmark.flights import BACK_S, HOLD_S, Outcome, fly
from mission.follow.benchmark.pilots import any_pilot
from mission.follow.benchmark.table import COLUMNS, row
from policies.companion.guard.settings import GuardSettings
from policies.companion.skills.following import Pilot


def _flown(pilot: Pilot, condition: str, seed: int, guard: GuardSettings, kept: KeptFlight) -> Outcome:
    return fly(pilot, BY_NAME[condition], seed, guard, kept=kept)


def _row(name: str, outcomes: Sequence[Outcome]) -> tuple[str, ...]:
    return row(BY_NAME[name], outcomes)


def misses(name: str, outcomes: Sequence[Outcome]) -> list[str]:
    """What fell short of the condition's own bounds and of those of all, a sentence each, with what is wanted."""
    condition, found = BY_NAME[name], []
    band = sum(outcome.in_band for outcome in outcomes) / len(outcomes)
    if condition.least_in_band is not None and band < condition.least_in_band:
        found.append(f"{band:.1%} of the time in the band, wanted {condition.least_in_band:.0%}")
    hits = sum(outcome.is_collided for outcome in outcomes)
    if hits:
        people = sum(outcome.is_somebody_hit for outcome in outcomes)
        found.append(f"{hits} of {len(outcomes)} flights touched somebody or something, {people} of them somebody")
    found += [
        *_rare("kept the owner", [outcome.is_kept for outcome in outcomes], LEAST_KEPT),
        *_rare(f"stood {HOLD_S:g} s after the last sight", [outcome.has_stood for outcome in outcomes], LEAST_STOOD),
        *_rare(
            f"followed again within {BACK_S:g} s of a return",
            [outcome.has_resumed for outcome in outcomes],
            LEAST_RESUMED,
        ),
    ]
    nearest_m = min((o.nearest_hidden_m for o in outcomes if o.nearest_hidden_m == o.nearest_hidden_m), default=9.0)
    if condition.least_m is not None and nearest_m < condition.least_m:
        found.append(f"{nearest_m:.2f} m from a hidden owner, wanted {condition.least_m:g}")
    accel = sum(outcome.accel_rms for outcome in outcomes) / len(outcomes)
    if condition.most_accel is not None and accel >= condition.most_accel:
        found.append(f"accelerates by {accel:.2f} m/s² RMS, wanted less than {condition.most_accel:g}")
    yaw_rate = sum(outcome.yaw_rate_rms for outcome in outcomes) / len(outcomes)
    if condition.most_yaw_rate is not None and yaw_rate >= condition.most_yaw_rate:
        found.append(f"turns by {yaw_rate:.1f} deg/s RMS, wanted less than {condition.most_yaw_rate:g}")
    return [f"{condition.title}: {text}" for text in found]


def _rare(text: str, truths: Sequence[bool | None], least: float) -> list[str]:
    """That something was true too rarely, of those of which it can be said; nothing if it was not."""
    known = [truth for truth in truths if truth is not None]
    if sum(known) >= least * len(known):
        return []
    return [f"{sum(known)} of {len(known)} flights {text}, wanted {least:.0%}"]


BENCHMARK = Benchmark(
    titles={name: condition.title for name, condition in BY_NAME.items()},
    columns=COLUMNS,
    load=any_pilot,
    fly=_flown,
    row=_row,
    misses=misses,
)
