"""`python -m bench.navigate_mavlink [POLICY]`: how well does the trained policy cross forests over MAVLink?

One vehicle at a time, in lockstep: the whole flight controller, the scanner's messages, a companion computer with the
policy, a goto sent to it. In: the policy that ships, or a policy file. Held-out forests, goals, wind, noise and
vehicles drawn as the batch draws them. Out: the table of flights over MAVLink of docs/results/navigate.md.
"""

import sys
from collections.abc import Sequence
from math import nan
from pathlib import Path

import numpy as np

from bench.navigate import FLOWN
from bench.page_section import with_section
from bench.row import machine
from common.files import write_whole
from common.intervals import bootstrap, rate
from mission.benchmark.goal_flights import Crossing
from mission.benchmark.navigating import Forest, cross
from policies.companion.guard.settings import GuardSettings
from policies.companion.vector_pilot import NavigationPilot
from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import find_policy
from policies.tasks.follow_me.scorecard import written

ENDS = ("arrived", "collision", "over the forest", "other")
DENSITIES = (200.0, 400.0, 600.0)
FLIGHTS = 100  # of each density
FIRST_SEED = 1_000_003  # odd, as all worlds that are not trained in
UNGUARDED = GuardSettings(is_on=False)  # the policy alone, as in the batch
PAGE = Path(__file__).parent.parent / "docs" / "results" / "navigate.md"

SECTION = f"""\
{FLOWN}

The same policy, flown by its [companion](../how-to/companion.md): a goto is sent to it, the scanner's messages come
to it through the vehicle, its setpoints go to mode Offboard, without the guard. {{flights}} flights of each density,
one vehicle at a time, in lockstep; forests, goals, wind, noise and vehicles are drawn as above. Success is to come
within 3 m of the goal, by the truth as above, and to be handed back in mode Hold, untouched for 4 s more; the mean
speed is that of the way up to there, standing start and slowing down included. Made by `python -m
bench.navigate_mavlink`.

| trees/ha | success | mean speed | rests off the goal, median | collisions | over the forest | other |
|---|---|---|---|---|---|---|
{{rows}}

Measured on {{machine}}.
"""


def row(trees_per_ha: float, crossings: Sequence[Crossing]) -> str:
    """A line of the table."""
    outcomes = np.array([crossing.outcome for crossing in crossings])
    arrived = [crossing for crossing in crossings if crossing.outcome == "arrived"]
    speeds = np.array([crossing.speed_m_s for crossing in arrived])
    mean = bootstrap(len(speeds), lambda rows: float(speeds[rows].mean()) if len(rows) else nan)
    reached, *ends = (written(rate(outcomes == end), "%") for end in ENDS)
    rests = f"{np.median([crossing.miss_m for crossing in arrived] or nan):.1f} m"
    cells = [f"{trees_per_ha:.0f}", reached, written(mean, "m/s"), rests, *ends]
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
        forest = Forest(trees_per_ha, 0.0, 0.0, 1.0)
        crossings = [cross(pilot, forest, FIRST_SEED + 2 * (i + k * FLIGHTS), UNGUARDED) for i in range(count)]
        lines.append(told(trees_per_ha, crossings))
    if arguments:  # the page is of the policy that ships
        return 0
    section = SECTION.format(flights=count, rows="\n".join(lines), machine=machine())
    write_whole(PAGE, with_section(PAGE.read_text(), FLOWN, section).encode())
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
