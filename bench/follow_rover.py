"""`python -m bench.follow_rover [POLICY [DRIVES]]`: how well does a rover follow somebody through hills and trees?

In: the policy that ships, or a policy file. Drives over MAVLink in lockstep, one rover at a time, by a companion with
camera, phone and scanner, as those of `bench.follow.flights`: held-out worlds, wind, noise. Prints the rows; those of
the policy that ships go into docs/results/follow-rover.md.
"""

import sys
from pathlib import Path

from bench.follow.flights import FIRST_SEED, SECONDS, fly
from bench.follow.stages import CELLS
from bench.page_section import kept_from
from bench.row import machine
from common.files import write_whole
from policies.companion.skills.load_skill import load_follower
from policies.tasks.follow_me.scorecard import NAMES, Scorecard, scorecard, written

DRIVES = 40  # of each kind
COMPARED = "## By the detector of people"  # a section that stays as it is
FIGURES = ("success", "tracking", "collision", "in_band", "distance_median_m", "in_view", "losses_per_minute")
PAGE_FILE = Path(__file__).parent.parent / "docs" / "results" / "follow-rover.md"
PAGE = """\
# A rover follows somebody

`honeyguide follow --airframe rover`: the policy that ships (`navigate-rover-follow`) drives a rover
after its owner, by its [companion](../how-to/companion.md), over MAVLink: {drives} drives of {seconds:.0f} s of each
kind, in hills and among trees that it was not trained in, with estimator, sensor noise, wind and a phone that is off
by metres. The figures are those of the [drone](follow.md); who walks into a rover that stands has not been run into.
Rates over drives have Wilson's 95 % interval, the others the bootstrap's. Made by `python -m bench.follow_rover`.

| trees/ha | owner | {names} |
|---|---|{lines}|
{rows}

Measured on {machine}.
"""


def row(trees_per_ha: float, owner_m_s: float, card: Scorecard) -> str:
    """A line of the table."""
    figures = [written(getattr(card, name), NAMES[name][1]) for name in FIGURES]
    return " | ".join([f"| {trees_per_ha:g}", f"{owner_m_s:g} m/s", *figures]) + " |"


def main(arguments: list[str]) -> int:
    pilot = load_follower(arguments[0] if arguments else "navigate-rover-follow")
    count = int(arguments[1]) if len(arguments) > 1 else DRIVES
    rows = []
    for k, cell in enumerate(CELLS):
        tracks = [fly(pilot, cell, FIRST_SEED + 2 * (k * count + i), airframe="rover") for i in range(count)]
        rows.append(row(cell.trees_per_ha, cell.owner_speed_max, scorecard(tracks)))
        print(rows[-1], flush=True)
    if arguments:
        return 0
    page = PAGE.format(
        drives=count,
        seconds=SECONDS,
        names=" | ".join(NAMES[name][0] for name in FIGURES),
        lines="|".join(["---"] * len(FIGURES)),
        rows="\n".join(rows),
        machine=machine(),
    )
    write_whole(PAGE_FILE, (page + kept_from(PAGE_FILE.read_text(), COMPARED)).encode())
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
