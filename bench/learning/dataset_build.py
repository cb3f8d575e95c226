"""How much faster than real time is a dataset built of a flight's log, and is it the same bytes each time?"""

import tempfile
import time
from pathlib import Path

from rich.console import Console

from bench.row import Row, require
from mission.dataset.build import BuildOptions, build_dataset
from mission.dataset.recording import record_flight
from mission.flight_config import FlightConfig, OwnerConfig
from mission.follow.lockstep import flight_with_companion, follow_for
from policies.companion.skills.load_skill import load_follower
from policies.datasets.reader import DatasetReader
from policies.tasks.follow_me.world import FOLLOW_WORLD

SECONDS, TRIES = 120.0, 3
DECISION_S = 0.1  # of FollowMe
PILOT = "follow-me-tracked"
COMMAND = "python -m bench dataset"


def measure() -> list[Row]:
    """The time that decisions of a flight cover over what a dataset of them takes, in a process that has built one."""
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        run = folder / "run"
        run.mkdir()
        config = FlightConfig(owner=OwnerConfig(pace="walk"), world=FOLLOW_WORLD, seed=3, wind_m_s=2.0)
        flight, companion = flight_with_companion(config, load_follower(PILOT), folder=run)
        recording = record_flight(flight, companion, run, PILOT)
        follow_for(flight, companion, SECONDS)
        recording.close()
        took_s, bytes_of = [], []
        for k in range(TRIES + 1):
            out = folder / f"dataset-{k}"
            begun = time.perf_counter()
            build_dataset(BuildOptions((run,), "FollowMe", out), Console(quiet=True))
            took_s.append(time.perf_counter() - begun)
            bytes_of.append({path.name: path.read_bytes() for path in sorted(out.iterdir())})
        with DatasetReader(out) as reader:
            flown_s = DECISION_S * reader.steps
    require(flown_s > 0.9 * SECONDS, f"the dataset has {flown_s:g} s of {SECONDS:g} s")
    require(all(each == bytes_of[0] for each in bytes_of), "two datasets of one flight are not the same bytes")
    name = "dataset of two minutes of following: time flown over time to build it"
    return [Row(name, flown_s / min(took_s[1:]), "x", "higher", 50.0, COMMAND)]
