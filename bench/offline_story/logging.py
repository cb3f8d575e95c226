"""Flights that are learnt from: another airframe, windier worlds, and what each decision saw in their logs.

`python -m bench.offline_story.logging PILOT FOLDER FIRST COUNT` logs flights of a pilot. What is logged stays.
"""

import sys
from pathlib import Path

from mission.dataset.recording import record_flight
from mission.flight_config import FlightConfig, OwnerConfig
from mission.follow.benchmark.pilots import any_pilot
from mission.follow.lockstep import flight_with_companion, follow_for
from mission.view.replay_file import keep_for_replay
from policies.tasks.follow_me.world import FOLLOW_WORLD

AIRFRAME = "f450"
SECONDS = 60.0
WINDS_M_S = (6.0, 8.0, 10.0)
TREES_PER_HA = (50.0, 100.0, 200.0)
PACES = ("walk", "run")
FIRST_SEED = 500_000  # even, as of all that is learnt from


def fly(pilot_name: str, folder: Path, number: int) -> None:
    """Logs one flight, unless that was done; a folder that is there is whole."""
    target = folder / f"{number:03d}"
    if target.exists():
        return
    part = target.with_suffix(".part")
    part.mkdir(parents=True, exist_ok=True)
    seed = FIRST_SEED + 2 * number
    world = FOLLOW_WORLD.model_copy(update={"trees_per_ha": TREES_PER_HA[number % 3], "seed": seed})
    owner, wind = OwnerConfig(pace=PACES[number % 2]), WINDS_M_S[number // 2 % 3]
    config = FlightConfig(airframe=AIRFRAME, owner=owner, world=world, seed=seed, wind_m_s=wind)
    pilot = any_pilot(pilot_name)
    pilot.reset()
    flight, companion = flight_with_companion(config, pilot, folder=part)
    keep_for_replay(flight)
    recording = record_flight(flight, companion, part, pilot_name)
    try:
        follow_for(flight, companion, SECONDS)
    finally:
        recording.close()
    (part / "images.zip").unlink(missing_ok=True)  # the tracked setting looks at no image
    part.rename(target)


def main(pilot_name: str, folder: str, first: str, count: str) -> None:
    for number in range(int(first), int(first) + int(count)):
        fly(pilot_name, Path(folder), number)


if __name__ == "__main__":
    main(*sys.argv[1:])
