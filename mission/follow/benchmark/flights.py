"""One flight of the benchmark, over MAVLink in lockstep: the whole autopilot, a companion, the truth watched over.

In: a policy, a condition, a seed. Out: an `Outcome`, plain numbers. Worlds, owners, wind and noise come from the seed;
those of the benchmark are odd, as those of all tests: training has the even ones.
"""

from dataclasses import dataclass
from math import nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from autopilot.interface.failure_requests import Failure, Unit
from mission.benchmark.benchmark import changed_per_min
from mission.benchmark.kept_flight import KeptFlight
from mission.flight_config import FlightConfig, OwnerConfig
from mission.follow.benchmark.conditions import Condition
from mission.follow.follow_scoring import FollowWatch
from mission.follow.lockstep import flight_with_companion, follow_for
from mission.follow.vehicle_setup import BY_SIGHT
from policies.companion.guard.settings import GuardSettings
from policies.companion.skills.following import Pilot
from policies.tasks.follow_me.track import Ranges, spans
from policies.tasks.follow_me.world import FOLLOW_WORLD

Array = NDArray[Any]
SECONDS = 60.0
TREES_PER_HA = (50.0, 100.0, 200.0)
WINDS_M_S = (0.0, 2.0, 4.0, 6.0, 8.0)
STANDS_M_S = 0.5
HOLD_S = 5.0  # after the last sight, until it must stand
BACK_S = 10.0  # after they are back, until it must follow
_SUSTAINED_S = 1.0
_AWAY_AND_BACK = (Failure.OFF, Failure.OK)


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of a flight."""

    seed: int
    in_band: float  # of the planned time
    is_collided: bool
    is_somebody_hit: bool  # and it was a person, not something solid
    nearest_m: float  # to the owner's chest
    nearest_hidden_m: float  # while they were hidden; NaN: they never were
    has_stood: bool | None  # five seconds after the last sight; None: never out of sight for so long
    has_resumed: bool | None  # ten seconds after the owner was back; None: never
    is_kept: bool  # the owner: to the end, and never out of the band for over ten seconds while they could be seen
    interventions_per_min: float
    accel_rms: float  # [m/s²] of the vehicle, level, samples 0.1 s apart
    yaw_rate_rms: float  # [deg/s]
    ended_s: float
    trouble: str  # why the companion gave up


def flight_of(condition: Condition, seed: int) -> FlightConfig:
    """What a flight in a condition is made from: how many trees, and how much wind if it is not said, by the seed."""
    k = seed // 2
    world = FOLLOW_WORLD.model_copy(update={"trees_per_ha": TREES_PER_HA[k % 3], "seed": seed})
    owner = OwnerConfig(pace=condition.pace, numbers=dict(condition.numbers))
    wind_m_s = WINDS_M_S[k % 5] if condition.wind_m_s is None else condition.wind_m_s
    return FlightConfig(
        owner=owner,
        world=world,
        seed=seed,
        wind_m_s=wind_m_s,
        airframe=condition.airframe,
        sensor_roughness=condition.sensor_roughness,
        parameters=dict(BY_SIGHT),
    )


def fly(
    pilot: Pilot,
    condition: Condition,
    seed: int,
    guard: GuardSettings,
    seconds: float = SECONDS,
    kept: KeptFlight | None = None,
) -> Outcome:
    """One flight; one that never began to follow did not follow at all."""
    pilot.reset()
    kept = kept or KeptFlight()
    flight, companion = flight_with_companion(flight_of(condition, seed), pilot, folder=kept.folder, guard=guard)
    kept.begin(flight, companion)
    is_hidden: list[bool] = []
    has_touched = False
    switches = [] if condition.gnss_away_s is None else list(zip(condition.gnss_away_s, _AWAY_AND_BACK, strict=True))

    def look(watch: FollowWatch) -> None:
        nonlocal has_touched
        while switches and watch.judged_s + watch.paused_s >= switches[0][0]:
            flight.injector.inject(Unit.GNSS, switches.pop(0)[1], 0)
        if watch.sample_count > len(is_hidden):
            truth = flight.rig.rows["truth"][0]
            has_touched = bool(truth["impact_speed"] > 0.0 or truth["is_on_ground"] or truth["is_crashed"])
            is_hidden.append(bool(flight.owner.cast.rows.drawn.numpy()[0, 0]["stature_m"] <= 0.0))

    watch = follow_for(flight, companion, seconds, look)
    track = watch.track()
    if track is None:
        raise ValueError("a flight of no time has no outcome")
    hidden, (north, east, _) = np.array(is_hidden), watch.motion[: len(is_hidden)].T
    is_collided = bool(track.is_collided.any())
    distance, speed = track.distance_m[: len(hidden)], np.hypot(north, east)
    bounds = Ranges()
    is_in_band = (distance >= bounds.near_m) & (distance <= bounds.far_m)
    smoothness = watch.smoothness()
    return Outcome(
        seed=seed,
        in_band=float(is_in_band.sum() / track.planned_count),
        is_collided=is_collided,
        is_somebody_hit=is_collided and not has_touched,
        nearest_m=float(track.distance_m.min()),
        nearest_hidden_m=float(distance[hidden].min()) if hidden.any() else nan,
        has_stood=_has_stood(hidden, speed, track.interval_s),
        has_resumed=_has_resumed(hidden, is_in_band, track.interval_s),
        is_kept=not is_collided and not companion.trouble and _is_kept(hidden, is_in_band, track.interval_s),
        interventions_per_min=changed_per_min(companion.skill.interventions, len(hidden) * track.interval_s),
        accel_rms=smoothness.accel_rms,
        yaw_rate_rms=smoothness.yaw_rate_rms,
        ended_s=float(track.time_s[-1]),
        trouble=companion.trouble,
    )


def _has_stood(hidden: Array, speed: Array, interval_s: float) -> bool | None:
    """Whether it stood five seconds after the last sight of each hiding that was so long."""
    due = round(HOLD_S / interval_s)
    begun = [first for first, end in spans(hidden) if end - first > due]
    if not begun:
        return None
    return all(speed[max(first + due - 5, 0) : first + due + 1].min() < STANDS_M_S for first in begun)


def _has_resumed(hidden: Array, is_in_band: Array, interval_s: float) -> bool | None:
    """Whether it was in the band for a second within ten of each return that was followed for so long."""
    due, length = round(BACK_S / interval_s), round(_SUSTAINED_S / interval_s)
    ends = [end for _, end in spans(hidden) if end + due <= len(hidden)]
    if not ends:
        return None
    return all(any(is_in_band[k : k + length].all() for k in range(end, end + due - length + 1)) for end in ends)


def _is_kept(hidden: Array, is_in_band: Array, interval_s: float) -> bool:
    """Whether it was never out of the band for longer than it may take to be back."""
    return all(end - first <= round(BACK_S / interval_s) for first, end in spans(~is_in_band & ~hidden))
