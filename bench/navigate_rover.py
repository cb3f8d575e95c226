"""`python -m bench.navigate_rover [POLICY [DRIVES]]`: how well does a rover get through between trees and walls?

In: the policy that ships, or a policy file. Held-out worlds of two densities, with estimator, wind, noise and varied
vehicles: in the batch, and over MAVLink, one rover at a time, in lockstep, by a companion and its messages. Prints
the rows; those of the policy that ships go into docs/results/navigate-rover.md.
"""

import sys
from itertools import product
from math import cos, pi, sin
from pathlib import Path

import numpy as np

from bench.navigate import EPISODES, build, fly, row
from bench.navigate_mavlink import FIRST_SEED, UNGUARDED, told
from bench.row import machine
from common.files import write_whole
from mission.benchmark.goal_flights import Crossing, advance, crossed, send_goto
from mission.client import Client
from mission.flight import FlightConfig
from mission.follow.lockstep import flight_with_navigator
from mission.simulator.flight_rig import TURBULENCE
from policies.companion.guard.settings import GuardSettings
from policies.companion.vector_pilot import RoverNavigationPilot
from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import find_policy
from policies.tasks.navigate.navigate_params import ROVER_GOALS_M
from sim.wind import wind_model
from sim.world.forest_world import WALLED_FOREST

DENSITIES = (400.0, 600.0)
DRIVES = 100  # of each density, over MAVLink
GUARDS = {"no": UNGUARDED, "yes": GuardSettings()}
LAGS_S = (0.0, 0.1)
SLOWEST_M_S = 1.0  # the task's
PAGE_FILE = Path(__file__).parent.parent / "docs" / "results" / "navigate-rover.md"
PAGE = """\
# Navigate on wheels: a rover between trees and walls

The policy that ships (`policies/pretrained/navigate-rover.pt`, on ranges) in held-out forests with {walls}
free-standing walls and kerbs on 112 m by 112 m, {episodes} episodes of each density, goals 30 to 45 m away: estimator,
sensor noise, wind up to 6 m/s with gusts, hills up to 3 m, masses and motors that differ. Success is to come within 3 m
of the goal without having touched anything. Actions are the most probable ones; rates have Wilson's 95 % interval,
speeds the bootstrap's. Made by `python -m bench.navigate_rover`; the task is told in
[navigate.md](../explanation/navigate.md).

| trees/ha | success | mean speed | straight | collisions | over the forest | out of time |
|---|---|---|---|---|---|---|
{batch}

## Over MAVLink

The same policy, driven by its [companion](../how-to/companion.md): a goto is sent to it, the scanner's messages come
to it, velocities go to mode Offboard. {drives} drives of each density, one rover at a time, in lockstep, with and
without [the guard](../how-to/navigate.md#the-guard), the scanner on time or 100 ms late; worlds, goals, wind and noise
are drawn as above, and alike in all rows of a density; the vehicle is that of the airframe file. Success is to come
within 3 m, and to be handed back in mode Hold, untouched for 4 s more.

| guard | scans | trees/ha | success | mean speed | rests off the goal, median | collisions | over the forest | other |
|---|---|---|---|---|---|---|---|---|
{link}

Measured on {machine}.
"""


def drive(
    pilot: RoverNavigationPilot, trees_per_ha: float, seed: int, guard: GuardSettings, scan_lag_s: float
) -> Crossing:
    """One drive; an odd seed is of a world that is not trained in."""
    rng = np.random.default_rng([seed, 0x4E52])
    wind_m_s, gust_m_s, noise = rng.uniform(0.0, 6.0), rng.uniform(0.0, 3.0), rng.uniform(0.5, 1.5)
    world = WALLED_FOREST.model_copy(
        update={"seed": seed, "trees_per_ha": trees_per_ha, "hill_height_m": rng.uniform(0.0, 3.0)}
    )
    config = FlightConfig(airframe="rover", is_forest=True, world=world, seed=seed, noise=noise, scan_lag_s=scan_lag_s)
    flight, companion = flight_with_navigator(config, pilot, guard=guard)

    async def arm(drone: Client) -> None:
        await drone.wait_ready()
        await drone.arm()

    try:
        flight.fly(arm, seconds=60.0)
        advance(flight, 1.0)
        flight.rig.set_air(wind_model(wind_m_s, rng.uniform(0.0, 360.0), TURBULENCE, gust_m_s))
        bearing, away_m = rng.uniform(-pi, pi), rng.uniform(ROVER_GOALS_M["goal_min_m"], ROVER_GOALS_M["goal_max_m"])
        north, east = away_m * cos(bearing), away_m * sin(bearing)
        goal_ned = (north, east, -float(flight.world.height(north, east)))
        flight.rig.forget_impacts()
        send_goto(flight, goal_ned)
        return crossed(flight, companion, goal_ned, seed, SLOWEST_M_S)
    finally:
        flight.close()


def main(arguments: list[str]) -> int:
    path = Path(arguments[0]) if arguments else find_policy("navigate-rover")
    policy, card = load_policy(path)
    settings = {key: str(value) for key, value in card.settings.items()} | {"has_estimator": "true"}
    batch, link = [], []
    for trees_per_ha in DENSITIES:
        task = build(settings, trees_per_ha, EPISODES, "NavigateRover")
        task.layout.require(policy.layout, "the policy")
        batch.append(row(trees_per_ha, fly(policy, task)))
        print(batch[-1], flush=True)
    pilot = RoverNavigationPilot(policy, str(path))
    count = int(arguments[1]) if len(arguments) > 1 else DRIVES
    for (name, guard), lag_s in product(GUARDS.items(), LAGS_S):
        for k, trees_per_ha in enumerate(DENSITIES):
            seeds = [FIRST_SEED + 2 * (i + k * DRIVES) for i in range(count)]
            line = told(trees_per_ha, [drive(pilot, trees_per_ha, seed, guard, lag_s) for seed in seeds])
            link.append(f"| {name} | {1000.0 * lag_s:.0f} ms late {line}")
    if arguments:
        return 0
    tables = {"batch": "\n".join(batch), "link": "\n".join(link)}
    page = PAGE.format(walls=WALLED_FOREST.wall_count, episodes=EPISODES, drives=count, machine=machine(), **tables)
    write_whole(PAGE_FILE, page.encode())
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
