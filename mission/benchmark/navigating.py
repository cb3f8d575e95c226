"""`honeyguide benchmark navigate`: a drone reaches goals through forests, its scans late.

In: a policy, a condition, a seed. Out: a `Crossing`. Forests, goals, wind, noise and vehicles come from the seed; those
of the benchmark are odd, as those of all tests: training has the even ones.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, isfinite, pi, sin

import numpy as np

from common.intervals import bootstrap, rate
from mission.benchmark.benchmark import Benchmark
from mission.benchmark.goal_flights import Crossing, advance, crossed, send_goto
from mission.benchmark.goal_pilots import goal_pilot
from mission.benchmark.kept_flight import KeptFlight
from mission.flight import Flight
from mission.flight_config import FlightConfig
from mission.follow.lockstep import flight_with_navigator
from mission.script import take_off
from mission.simulator.flight_rig import TURBULENCE
from policies.companion.guard.settings import GuardSettings
from policies.companion.vector_pilot import NavigationPilot
from policies.tasks.follow_me.scorecard import written
from policies.tasks.navigate.observe import GOAL_MAX_M, RAY_STACK
from sim.wind import wind_model
from sim.world.forest_world import FOREST

GOAL_MIN_M, GOAL_HEIGHT_M = 60.0, 2.0  # of the task
LEAST_SPEED_M_S = 5.0  # mean of the flights that arrive
TAKEOFF_S, SETTLE_S = 40.0, 2.0
COLUMNS = (
    "condition", "flights", "reached", "collided", "over the forest", "mean speed", "rests off the goal",
    "changed / min",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Forest:
    """One row of the table."""

    trees_per_ha: float
    lag_s: float  # of the scans
    least_reached: float
    most_collided: float

    @property
    def title(self) -> str:
        return f"{self.trees_per_ha:.0f} trees/ha, scans {1000.0 * self.lag_s:.0f} ms late"


CONDITIONS = {
    f"{trees}-late-{lag_ms}": Forest(trees, lag_ms * 1e-3, reached, collided)
    for trees, reached, collided in ((200, 0.99, 0.01), (400, 0.97, 0.02), (600, 0.93, 0.03))
    for lag_ms in (0, 100, 200)
}


def cross(
    pilot: NavigationPilot, forest: Forest, seed: int, guard: GuardSettings, kept: KeptFlight | None = None
) -> Crossing:
    """One flight.

    Args:
        pilot: who flies.
        forest: the condition.
        seed: of all that is drawn; odd.
        guard: who bounds the pilot.
        kept: what stays of it; None: nothing.
    """
    pilot.reset()
    kept = kept or KeptFlight()
    rng = np.random.default_rng([seed, 0x4E41])
    wind_m_s, gust_m_s, noise = rng.uniform(0.0, 6.0), rng.uniform(0.0, 3.0), rng.uniform(0.5, 1.5)
    world = FOREST.model_copy(
        update={"seed": seed, "trees_per_ha": forest.trees_per_ha, "hill_height_m": rng.uniform(0.0, 6.0)}
    )
    config = FlightConfig(is_forest=True, world=world, seed=seed, noise=noise, scan_lag_s=forest.lag_s)
    flight, companion = flight_with_navigator(config, pilot, folder=kept.folder, guard=guard)
    kept.begin(flight, companion)
    try:
        flight.fly(take_off, seconds=TAKEOFF_S)
        advance(flight, SETTLE_S)
        flight.rig.set_air(wind_model(wind_m_s, rng.uniform(0.0, 360.0), TURBULENCE, gust_m_s))
        _vary_vehicle(flight, mass_scale=rng.uniform(0.9, 1.15), motor_scale=rng.uniform(0.93, 1.07))
        bearing, away_m = rng.uniform(-pi, pi), rng.uniform(GOAL_MIN_M, GOAL_MAX_M)
        north, east = away_m * cos(bearing), away_m * sin(bearing)
        goal_ned = (north, east, -float(flight.world.height(north, east)) - GOAL_HEIGHT_M)
        flight.rig.forget_impacts()
        send_goto(flight, goal_ned)
        return crossed(flight, companion, goal_ned, seed)
    finally:
        flight.close()


def _vary_vehicle(flight: Flight, mass_scale: float, motor_scale: float) -> None:
    """Gives the vehicle another mass and other motors, as an episode of the task has them."""
    model = flight.rig.rows["model"]  # live
    model["mass_kg"] *= mass_scale
    model["mass_inv"] /= mass_scale
    model["inertia_frd"] *= mass_scale
    model["inertia_inv_frd"] /= mass_scale
    model["thrust_n_s2"] *= motor_scale


def _load(name: str) -> NavigationPilot:
    return goal_pilot(name, NavigationPilot, RAY_STACK)


def _flown(pilot: NavigationPilot, condition: str, seed: int, guard: GuardSettings, kept: KeptFlight) -> Crossing:
    return cross(pilot, CONDITIONS[condition], seed, guard, kept)


def _row(name: str, crossings: Sequence[Crossing]) -> tuple[str, ...]:
    outcomes = np.array([crossing.outcome for crossing in crossings])
    arrived = [crossing for crossing in crossings if crossing.outcome == "arrived"]
    speeds = np.array([crossing.speed_m_s for crossing in arrived])
    speed = bootstrap(len(speeds), lambda rows: float(speeds[rows].mean()) if len(rows) else float("nan"))
    rests_m = float(np.median([crossing.miss_m for crossing in arrived])) if arrived else float("nan")
    return (
        CONDITIONS[name].title,
        str(len(crossings)),
        *(written(rate(outcomes == outcome), "%") for outcome in ("arrived", "collision", "over the forest")),
        written(speed, "m/s"),
        f"{rests_m:.1f} m" if isfinite(rests_m) else "-",
        f"{np.mean([crossing.interventions_per_min for crossing in crossings]):.0f}",
    )


def _misses(name: str, crossings: Sequence[Crossing]) -> list[str]:
    forest, count, found = CONDITIONS[name], len(crossings), []
    reached = sum(crossing.outcome == "arrived" for crossing in crossings)
    collided = sum(crossing.outcome == "collision" for crossing in crossings)
    speeds_m_s = [crossing.speed_m_s for crossing in crossings if crossing.outcome == "arrived"]
    if speeds_m_s and np.mean(speeds_m_s) < LEAST_SPEED_M_S:
        found.append(f"{forest.title}: {np.mean(speeds_m_s):.2f} m/s on the way, wanted {LEAST_SPEED_M_S:g}")
    if reached < forest.least_reached * count:
        found.append(f"{forest.title}: {reached} of {count} goals reached, wanted {forest.least_reached:.0%}")
    if collided > forest.most_collided * count:
        found.append(f"{forest.title}: {collided} of {count} flights collided, {forest.most_collided:.0%} allowed")
    return found


BENCHMARK = Benchmark(
    titles={name: forest.title for name, forest in CONDITIONS.items()},
    columns=COLUMNS,
    load=_load,
    fly=_flown,
    row=_row,
    misses=_misses,
)
