"""`python -m bench.navigate_mavlink [POLICY]`: how well does the trained policy cross forests over MAVLink?

One vehicle at a time, in lockstep: the whole flight controller, the scanner's messages, a companion computer with the
policy, a goto sent to it. In: the policy that ships, or a policy file. Held-out forests, goals, wind, noise and vehicles
drawn as the batch draws them. Out: the table of flights over MAVLink of docs/results/navigate.md.
"""

import sys
from dataclasses import dataclass
from math import cos, dist, nan, pi, sin
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.row import machine
from common.files import write_whole
from common.geodesy import geodetic_from_ned
from mission.flight import Flight, FlightConfig
from mission.follow.lockstep import flight_with_navigator
from mission.script import take_off
from policies.companion.engagement import Phase
from policies.companion.navigation_pilot import NavigationPilot
from policies.companion.vehicle_link import COMPONENT
from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import find_policy
from policies.tasks.intervals import Interval, bootstrap, rate
from policies.tasks.navigate.navigate_params import GOAL_MAX_M
from policies.tasks.navigate.world import NAVIGATE_WORLD
from sim.sensors.sensors import sensor_model

DENSITIES = (200.0, 400.0, 600.0)
FLIGHTS = 100  # of each density
FIRST_SEED = 1_000_003  # odd, as all worlds that are not trained in
GOAL_MIN_M, GOAL_HEIGHT_M, GOAL_RADIUS_M, CEILING_M, SLOWEST_M_S = 60.0, 2.0, 3.0, 4.0, 3.0  # the task's
PAGE = Path(__file__).parent.parent / "docs" / "results" / "navigate.md"
BEGIN, END = "<!-- flown: made by bench.navigate_mavlink -->", "<!-- /flown -->"
_TAKEOFF_S, _SETTLE_S, _REST_S = 40.0, 2.0, 4.0
_DO_REPOSITION = 192

SECTION = """\
## Over MAVLink

The same policy, flown by its [companion](../how-to/companion.md): a goto is sent to it, the scanner's messages come to
it through the vehicle, its setpoints go to mode Offboard. {flights} flights of each density, one vehicle at a time, in
lockstep; forests, goals, wind, noise and vehicles are drawn as above. A flight has arrived when the companion hands back
within 3 m of the goal, by the truth, and the vehicle then stays untouched for 4 s. Made by
`python -m bench.navigate_mavlink`.

| trees/ha | success | mean speed | collisions | over the forest | other |
|---|---|---|---|---|---|
{rows}

Measured on {machine}.
"""


@dataclass(frozen=True, slots=True)
class Crossing:
    """What one flight came to."""

    seed: int
    outcome: str  # "arrived", "collision", "over the forest", "other"
    speed_m_s: float  # way flown over time, from the goto to the end
    detail: str = ""


def cross(pilot: NavigationPilot, trees_per_ha: float, seed: int) -> Crossing:
    """One flight.

    Args:
        pilot: who flies.
        trees_per_ha: of the forest.
        seed: of all that is drawn; odd.
    """
    rng = np.random.default_rng([seed, 0x4E41])
    wind_m_s, gust_m_s, noise = rng.uniform(0.0, 6.0), rng.uniform(0.0, 3.0), rng.uniform(0.5, 1.5)
    world = NAVIGATE_WORLD.model_copy(
        update={"seed": seed, "trees_per_ha": trees_per_ha, "hill_height_m": rng.uniform(0.0, 6.0)}
    )
    config = FlightConfig(is_forest=True, world=world, seed=seed)
    flight, companion = flight_with_navigator(config, pilot)
    try:
        flight.fly(take_off, seconds=_TAKEOFF_S)
        _advance(flight, _SETTLE_S)
        _vary(flight, rng, wind_m_s, gust_m_s, noise)
        bearing, away_m = rng.uniform(-pi, pi), rng.uniform(GOAL_MIN_M, GOAL_MAX_M)
        north, east = away_m * cos(bearing), away_m * sin(bearing)
        goal_ned = (north, east, -float(flight.world.height(north, east)) - GOAL_HEIGHT_M)
        _send_goto(flight, goal_ned)
        return _watched(flight, lambda: companion.phase, goal_ned, seed)
    finally:
        flight.close()


def _vary(flight: Flight, rng: np.random.Generator, wind_m_s: float, gust_m_s: float, noise: float) -> None:
    """Gives the flight the air, the sensors, the mass and the motors of its draw, as an episode of the task has them."""
    flight.set_wind(wind_m_s, float(rng.uniform(0.0, 360.0)))
    mass_scale, motor_scale = rng.uniform(0.9, 1.15), rng.uniform(0.93, 1.07)
    model = flight.rig.models.numpy()  # live
    model["mass_kg"] *= mass_scale
    model["mass_inv"] /= mass_scale
    model["inertia_frd"] *= mass_scale
    model["inertia_inv_frd"] /= mass_scale
    model["thrust_n_s2"] *= motor_scale
