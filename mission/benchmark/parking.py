"""`honeyguide benchmark park`: a rover parks in spots of car parks on hillsides, among cars and carts that move.

In: a policy, a condition, a seed. Out: a `Parking`. Car parks, spots, wind and noise come from the seed; those of the
benchmark are odd, as those of all tests: training has the even ones.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan

import numpy as np

from common.intervals import bootstrap, rate
from mission.benchmark.benchmark import Benchmark, changed_per_min
from mission.benchmark.goal_pilots import goal_pilot
from mission.benchmark.kept_flight import KeptFlight
from mission.flight_config import FlightConfig
from mission.follow.lockstep import flight_with_driver
from mission.park.park_session import REVERSES, pose_in
from mission.park.parking import Arrival, drive, get_ready
from mission.script import Drone
from mission.simulator.flight_rig import TURBULENCE
from policies.companion.guard.settings import GuardSettings
from policies.companion.vector_pilot import DrivingPilot
from policies.tasks.drive.observe import STACK
from policies.tasks.follow_me.scorecard import written
from sim.wind import wind_model
from sim.world.driving_worlds import CAR_PARK
from sim.world.spots import spots_of

READY_S, ALL_S = 60.0, 240.0
WIND_MAX_M_S = 6.0
LEAST_PARKED, MOST_TOUCHED = 0.95, 0.02
COLUMNS = ("condition", "drives", "parked", "touched", "time", "off its middle", "changed / min")


@dataclass(frozen=True, slots=True)
class Lot:
    """One row of the table."""

    title: str
    is_reverse: bool
    cart_count: int
    lag_s: float = 0.0  # of the ranges


CONDITIONS = {
    "park": Lot("the tail to the aisle", False, 2),
    "reverse": Lot("the nose to the aisle", True, 2),
    "calm": Lot("the tail to the aisle, no carts", False, 0),
    "late-100": Lot("the tail to the aisle, ranges 100 ms late", False, 2, 0.1),
    "late-200": Lot("the tail to the aisle, ranges 200 ms late", False, 2, 0.2),
}


@dataclass(frozen=True, slots=True)
class Parking:
    """What one drive came to."""

    seed: int
    outcome: str  # "there", "touched" something, "missed" the pose
    seconds: float
    distance_m: float  # from the middle of the spot
    turn_deg: float
    interventions_per_min: float
    why: str


def flight_of(lot: Lot, seed: int, rng: np.random.Generator) -> FlightConfig:
    """What a drive in a condition is made from; how noisy its sensors are is drawn."""
    world = CAR_PARK.model_copy(update={"seed": seed, "mover_count": lot.cart_count})
    return FlightConfig(
        airframe="rover", has_lidar=True, has_base=True, world=world, seed=seed, noise=rng.uniform(0.5, 1.5),
        scan_lag_s=lot.lag_s, parameters=REVERSES,
    )  # fmt: skip


def parked(pilot: DrivingPilot, lot: Lot, seed: int, guard: GuardSettings, kept: KeptFlight | None = None) -> Parking:
    """One drive.

    Args:
        pilot: who drives.
        lot: the condition.
        seed: of all that is drawn; odd.
        guard: who bounds the pilot.
        kept: what stays of it; None: nothing.
    """
    pilot.reset()
    kept = kept or KeptFlight()
    rng = np.random.default_rng([seed, 0x5041])
    config = flight_of(lot, seed, rng)
    flight, companion = flight_with_driver(config, pilot, folder=kept.folder, guard=guard)
    kept.begin(flight, companion)
    try:
        ready = flight.fly(get_ready, seconds=READY_S)
        if ready.error is not None:
            return Parking(seed, "missed", nan, nan, nan, 0.0, str(ready.error))
        flight.rig.set_air(
            wind_model(rng.uniform(0.0, WIND_MAX_M_S), rng.uniform(0.0, 360.0), TURBULENCE, rng.uniform(0.0, 3.0))
        )
        free = [spot for spot in spots_of(flight.world) if spot.is_free]
        pose = pose_in(free[int(rng.integers(len(free)))], is_reverse=lot.is_reverse)

        async def script(drone: Drone) -> Arrival:
            return await drive(drone, flight, companion, pose)

        running = flight.fly(script, seconds=ALL_S)
        if running.error is not None:
            return Parking(seed, "missed", nan, nan, nan, 0.0, str(running.error))
        a: Arrival = running.result
        changes = changed_per_min(companion.skill.interventions, a.seconds)
        return Parking(seed, a.outcome, a.seconds, a.distance_m, a.turn_deg, changes, a.why)
    finally:
        flight.close()


def _load(name: str) -> DrivingPilot:
    return goal_pilot(name, DrivingPilot, STACK)


def _flown(pilot: DrivingPilot, condition: str, seed: int, guard: GuardSettings, kept: KeptFlight) -> Parking:
    return parked(pilot, CONDITIONS[condition], seed, guard, kept)


def _row(name: str, drives: Sequence[Parking]) -> tuple[str, ...]:
    outcomes = np.array([drive.outcome for drive in drives])
    there = [drive for drive in drives if drive.outcome == "there"]
    times = np.array([drive.seconds for drive in there])
    took = bootstrap(len(times), lambda rows: float(times[rows].mean()) if len(rows) else nan)
    return (
        CONDITIONS[name].title,
        str(len(drives)),
        *(written(rate(outcomes == outcome), "%") for outcome in ("there", "touched")),
        written(took, "s"),
        f"{np.median([drive.distance_m for drive in there]):.2f} m" if there else "-",
        f"{np.mean([drive.interventions_per_min for drive in drives]):.0f}",
    )


def _misses(name: str, drives: Sequence[Parking]) -> list[str]:
    title, count, found = CONDITIONS[name].title, len(drives), []
    there = sum(drive.outcome == "there" for drive in drives)
    touched = sum(drive.outcome == "touched" for drive in drives)
    if there < LEAST_PARKED * count:
        found.append(f"{title}: {there} of {count} parked, wanted {LEAST_PARKED:.0%}")
    if touched > MOST_TOUCHED * count:
        found.append(f"{title}: {touched} of {count} drives touched something, {MOST_TOUCHED:.0%} allowed")
    return found


BENCHMARK = Benchmark(
    titles={name: lot.title for name, lot in CONDITIONS.items()},
    columns=COLUMNS,
    load=_load,
    fly=_flown,
    row=_row,
    misses=_misses,
)
