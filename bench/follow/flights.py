"""`python -m bench.follow.flights STAGE SEED FOLDER`: flies a stage's policy over MAVLink, and adds what came of it.

One vehicle at a time, in lockstep: the whole flight controller, a companion computer with the policy, the owner's
phone, wind and sensor noise. A flight that ends early, because the companion gave control back or the vehicle crashed,
is not followed for the rest of its minute.
"""

import sys
from dataclasses import replace
from pathlib import Path

from bench.follow.judge import scorecards
from bench.follow.result import read, write
from bench.follow.run import policy_path, result_path
from bench.follow.stages import CELLS, Cell
from mission.flight import FlightConfig
from mission.flight_config import OwnerConfig
from mission.follow.lockstep import flight_with_companion, follow_for
from policies.companion.guard.settings import GuardSettings
from policies.companion.pilot import load_pilot
from policies.companion.skills.following import Pilot
from policies.companion.vector_pilot import NavigationPilot
from policies.tasks.follow_me.track import Track
from policies.tasks.follow_me.world import FOLLOW_WORLD

FLIGHTS = 20  # of each cell
SECONDS = 60.0
FIRST_SEED = 1_000_003  # odd, as of all tests: training has the even ones
_WINDS_M_S = (0.0, 1.5, 3.0, 4.5, 6.0)  # the range of training, by seed


def fly(
    pilot: Pilot | NavigationPilot, cell: Cell, seed: int, seconds: float = SECONDS, airframe: str = "x500"
) -> Track:
    """One flight or drive; one that never began to follow did not follow at all.

    Args:
        pilot: who flies or drives.
        cell: how many trees, and how fast an owner.
        seed: of the world, the owner, the phone, wind and noise.
        seconds: how long it is to follow.
        airframe: what follows.
    """
    pilot.reset()
    world = FOLLOW_WORLD.model_copy(update={"trees_per_ha": cell.trees_per_ha, "seed": seed})
    owner = OwnerConfig(pace="walk" if cell.owner_speed_max < 3.0 else "run")
    config = FlightConfig(
        airframe=airframe,
        owner=owner,
        world=world,
        is_forest=isinstance(pilot, NavigationPilot),
        seed=seed,
        wind_m_s=_WINDS_M_S[seed % len(_WINDS_M_S)],
    )
    alone = GuardSettings(is_on=False)  # the page is about policies
    flight, companion = flight_with_companion(config, pilot, guard=alone)
    watch = follow_for(flight, companion, seconds)
    if not companion.decision_count:
        print(f"{cell}, seed {seed}: never followed: {companion.trouble}", flush=True)
    track = watch.track()
    assert track is not None  # one sample at least
    return replace(track, trees_per_ha=cell.trees_per_ha, owner_speed_max=cell.owner_speed_max)


def seeds_of(i_cell: int) -> tuple[int, ...]:
    """Of the flights of a cell: odd, and no two flights of any with one."""
    return tuple(FIRST_SEED + 2 * (i_cell * FLIGHTS + k) for k in range(FLIGHTS))


def main(name: str, seed: str, folder: str) -> None:
    where = Path(folder)
    pilot = load_pilot(str(policy_path(where, name, int(seed))))
    tracks: dict[Cell, list[Track]] = {}
    for i, cell in enumerate(CELLS):
        tracks[cell] = [fly(pilot, cell, flown) for flown in seeds_of(i)]
        print(f"{cell}: flown", flush=True)
    path = result_path(where, name, int(seed))
    result = read(path)
    judged = [item for item in result.judged if not item.is_flown]
    write(path, replace(result, judged=[*judged, *scorecards(tracks, is_flown=True)]))


if __name__ == "__main__":
    main(*sys.argv[1:])
