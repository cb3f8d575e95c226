"""`python -m bench.navigate_mavlink [POLICY]`: how well does the trained policy cross forests over MAVLink?

One vehicle at a time, in lockstep: the whole flight controller, the scanner's messages, a companion computer with the
policy, a goto sent to it. In: the policy that ships, or a policy file. Held-out forests, goals, wind, noise and
vehicles drawn as the batch draws them. Out: the table of flights over MAVLink of docs/results/navigate.md.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, dist, nan, pi, sin
from pathlib import Path

import numpy as np

from autopilot.mavlink.wire.convert import degrees_e7
from bench.navigate import FLOWN
from bench.row import machine
from common.attitude import Vector
from common.files import write_whole
from common.geodesy import geodetic_from_ned
from mission.flight import Flight, FlightConfig
from mission.follow.lockstep import flight_with_navigator
from mission.script import take_off
from mission.simulator.flight_rig import TURBULENCE
from policies.companion.companion import Companion
from policies.companion.engagement import Phase
from policies.companion.vector_pilot import NavigationPilot
from policies.companion.vehicle_link import COMPONENT
from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import find_policy
from policies.tasks.intervals import Interval, bootstrap, rate
from policies.tasks.navigate.navigate_params import GOAL_MAX_M
from sim.wind import wind_model
from sim.world.forest_world import FOREST

DENSITIES = (200.0, 400.0, 600.0)
FLIGHTS = 100  # of each density
FIRST_SEED = 1_000_003  # odd, as all worlds that are not trained in
GOAL_MIN_M, GOAL_HEIGHT_M, GOAL_RADIUS_M, CEILING_M, SLOWEST_M_S = 60.0, 2.0, 3.0, 4.0, 3.0  # the task's
PAGE = Path(__file__).parent.parent / "docs" / "results" / "navigate.md"
_TAKEOFF_S, _SETTLE_S, _REST_S = 40.0, 2.0, 4.0
_DO_REPOSITION = 192

SECTION = f"""\
{FLOWN}

The same policy, flown by its [companion](../how-to/companion.md): a goto is sent to it, the scanner's messages come to
it through the vehicle, its setpoints go to mode Offboard. {{flights}} flights of each density, one vehicle at a time,
in lockstep; forests, goals, wind, noise and vehicles are drawn as above. Success is to come within 3 m of the goal, by
the truth as above, and to be handed back in mode Hold, untouched for 4 s more; the mean speed is that of the way up to
there, standing start and slowing down included. Made by `python -m bench.navigate_mavlink`.

| trees/ha | success | mean speed | rests off the goal, median | collisions | over the forest | other |
|---|---|---|---|---|---|---|
{{rows}}

Measured on {{machine}}.
"""


@dataclass(frozen=True, slots=True)
class Crossing:
    """What one flight came to."""

    seed: int
    outcome: str  # "arrived", "collision", "over the forest" or "other"
    speed_m_s: float  # way flown over time, from the goto to the end
    miss_m: float  # from the goal at the end, by the truth
    detail: str


def cross(pilot: NavigationPilot, trees_per_ha: float, seed: int) -> Crossing:
    """One flight.

    Args:
        pilot: who flies.
        trees_per_ha: of the forest.
        seed: of all that is drawn; odd.
    """
    rng = np.random.default_rng([seed, 0x4E41])
    wind_m_s, gust_m_s, noise = rng.uniform(0.0, 6.0), rng.uniform(0.0, 3.0), rng.uniform(0.5, 1.5)
    world = FOREST.model_copy(
        update={"seed": seed, "trees_per_ha": trees_per_ha, "hill_height_m": rng.uniform(0.0, 6.0)}
    )
    config = FlightConfig(is_forest=True, world=world, seed=seed, noise=noise)
    flight, companion = flight_with_navigator(config, pilot)
    try:
        flight.fly(take_off, seconds=_TAKEOFF_S)
        advance(flight, _SETTLE_S)
        flight.rig.set_air(wind_model(wind_m_s, rng.uniform(0.0, 360.0), TURBULENCE, gust_m_s))
        _vary_vehicle(flight, mass_scale=rng.uniform(0.9, 1.15), motor_scale=rng.uniform(0.93, 1.07))
        bearing, away_m = rng.uniform(-pi, pi), rng.uniform(GOAL_MIN_M, GOAL_MAX_M)
        north, east = away_m * cos(bearing), away_m * sin(bearing)
        goal_ned = (north, east, -float(flight.world.height(north, east)) - GOAL_HEIGHT_M)
        flight.rig.forget_impacts()
        send_goto(flight, goal_ned)
        return judged(flight, companion, goal_ned, seed)
    finally:
        flight.close()


def judged(
    flight: Flight, companion: Companion, goal_ned: Vector, seed: int, slowest_m_s: float = SLOWEST_M_S
) -> Crossing:
    """Flies to the goal, or to wherever it ends, and waits a little after it has been handed back."""
    truth = flight.rig.rows["truth"][0]
    begun_us, way_m, speed = flight.time_us, 0.0, nan
    last_ned = _place(truth)
    nearest_m = dist(last_ned, goal_ned)
    over_us = begun_us + round(nearest_m / slowest_m_s * 1e6)
    has_flown = is_back = False
    outcome = ""
    while not outcome and flight.time_us < over_us:
        flight.frame()
        pos_ned = _place(truth)
        nearest_m = min(nearest_m, dist(pos_ned, goal_ned))
        way_m += dist(pos_ned, last_ned)
        last_ned = pos_ned
        has_flown |= companion.phase is Phase.FLYING
        if float(truth["impact_speed"]) > 0.0:
            outcome = "collision"
        elif float(truth["height_agl_m"]) > CEILING_M:
            outcome = "over the forest"
        elif not is_back and has_flown and companion.phase is not Phase.FLYING:
            is_back, speed = True, way_m / (flight.time_us - begun_us) * 1e6
            over_us = flight.time_us + round(_REST_S * 1e6)
    if not outcome:
        outcome = "arrived" if is_back and nearest_m < GOAL_RADIUS_M else "other"
    state = f"{companion.phase.value}: {companion.trouble}" if companion.trouble else companion.phase.value
    return Crossing(seed, outcome, speed, dist(last_ned, goal_ned), f"{state}, nearest {nearest_m:.1f} m")


def _place(truth: np.void) -> Vector:
    north, east, down = (float(element) for element in truth["pos_ned"])
    return north, east, down


def _vary_vehicle(flight: Flight, mass_scale: float, motor_scale: float) -> None:
    """Gives the vehicle another mass and other motors, as an episode of the task has them."""
    model = flight.rig.rows["model"]  # live
    model["mass_kg"] *= mass_scale
    model["mass_inv"] /= mass_scale
    model["inertia_frd"] *= mass_scale
    model["inertia_inv_frd"] /= mass_scale
    model["thrust_n_s2"] *= motor_scale


def send_goto(flight: Flight, goal_ned: Vector) -> None:
    lat_deg, lon_deg, alt_amsl_m = geodetic_from_ned(*goal_ned, flight.config.home)
    flight.drone.send(
        "COMMAND_INT",
        target_system=1,
        target_component=COMPONENT,
        command=_DO_REPOSITION,
        frame=0,
        param1=-1.0,
        param4=nan,
        x=degrees_e7(lat_deg),
        y=degrees_e7(lon_deg),
        z=alt_amsl_m,
    )


def advance(flight: Flight, seconds: float) -> None:
    end_us = flight.time_us + round(seconds * 1e6)
    flight.run(lambda _: flight.time_us >= end_us)


def row(trees_per_ha: float, crossings: Sequence[Crossing]) -> str:
    """A line of the table."""
    outcomes = np.array([crossing.outcome for crossing in crossings])
    arrived = [crossing for crossing in crossings if crossing.outcome == "arrived"]
    speeds = np.array([crossing.speed_m_s for crossing in arrived])

    def percent(*names: str) -> str:
        fraction: Interval = rate(np.isin(outcomes, names))
        return f"{100 * fraction.value:.1f} % ({100 * fraction.low:.1f} to {100 * fraction.high:.1f})"

    mean = bootstrap(len(speeds), lambda rows: float(speeds[rows].mean()) if len(rows) else nan)
    cells = [f"{trees_per_ha:.0f}", percent("arrived"), f"{mean.value:.2f} m/s ({mean.low:.2f} to {mean.high:.2f})"]
    cells += [f"{np.median([crossing.miss_m for crossing in arrived] or nan):.1f} m"]
    cells += [percent("collision"), percent("over the forest"), percent("other")]
    return "| " + " | ".join(cells) + " |"


def told(trees_per_ha: float, crossings: Sequence[Crossing]) -> str:
    """A line of the table, printed below what did not arrive."""
    for crossing in crossings:
        if crossing.outcome != "arrived":
            print(crossing, flush=True)
    line = row(trees_per_ha, crossings)
    print(line, flush=True)
    return line


def main(arguments: list[str]) -> int:
    path = Path(arguments[0]) if arguments else find_policy("navigate")
    pilot = NavigationPilot(load_policy(path)[0], str(path))
    count = int(arguments[1]) if len(arguments) > 1 else FLIGHTS
    densities = [float(text) for text in arguments[2:]] or DENSITIES
    lines = []
    for k, trees_per_ha in enumerate(densities):
        crossings = [cross(pilot, trees_per_ha, FIRST_SEED + 2 * (i + k * FLIGHTS)) for i in range(count)]
        lines.append(told(trees_per_ha, crossings))
    page = PAGE.read_text()
    section = SECTION.format(flights=count, rows="\n".join(lines), machine=machine())
    before = page[: page.find(FLOWN)] if FLOWN in page else f"{page}\n"
    write_whole(PAGE, f"{before}{section}".encode())
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
