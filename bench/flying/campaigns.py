"""Rows of `scenarios.py`: how long does a campaign of 1,000 flights of two minutes take, by processes and in a batch?

The campaign that ships, a gale while a vehicle holds its place, with a longer hold and no search. Some of its runs are
flown both ways, and must have the same verdicts, before the whole is timed.
"""

import json
import subprocess
import time
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import yaml

import mission.campaign.ready
from bench.flying.startup import HONEYGUIDE
from bench.row import Row, require
from mission.campaign.run_store import RUNS_FILE
from mission.campaign.runs import Record

RUNS, COMPARED = 1000, 50
HOLD_S, FLIGHT_S = 92.6, 120.0
READY = Path(mission.campaign.ready.__path__[0]) / "gale-in-hold.campaign.yaml"
BATCH = "--batch"


def rows(command: str) -> list[Row]:
    with TemporaryDirectory() as folder:
        file = Path(folder) / "two-minutes.campaign.yaml"
        file.write_text(_two_minutes(), encoding="utf-8")
        other = _differing(_flown(file, COMPARED)[1], _flown(file, COMPARED, BATCH)[1])
        require(not other, f"runs {other} of {COMPARED} have other verdicts in a batch")
        alone_s, alone = _flown(file, RUNS)
        together_s, together = _flown(file, RUNS, BATCH)
    name = f"campaign of {RUNS:,} flights of two minutes"
    differing = len(_differing(alone, together))  # beyond the sample: a run at the very edge may
    return [
        Row(f"{name}, by processes", alone_s / 60.0, "min", "lower", 30.0, command),
        Row(f"{name}, in batches", together_s / 60.0, "min", "lower", 3.0, command),
        Row(f"{name}: verdicts that differ between the two", differing, "runs", "lower", None, command),
    ]


def _two_minutes() -> str:
    given = yaml.safe_load(READY.read_text(encoding="utf-8"))
    del given["search"], given["require"]  # what is asked of success says nothing of the time
    (hold,) = (step for step in given["scenario"]["vehicle"]["script"] if "hold" in step)
    hold["hold"] = HOLD_S
    return str(yaml.safe_dump(given))


def _flown(file: Path, runs: int, *options: str) -> tuple[float, list[Record]]:
    """Seconds from the command to its end, and the runs by their numbers."""
    with TemporaryDirectory() as folder:
        words = [HONEYGUIDE, "campaign", str(file), "--runs", str(runs), "--folder", folder, *options]
        start = time.perf_counter()
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        spent_s = time.perf_counter() - start
        require(done.returncode == 0, done.stderr[-1000:])
        lines = (Path(folder) / RUNS_FILE).read_text(encoding="utf-8").splitlines()
    records = sorted((Record.from_json(json.loads(line)) for line in lines), key=lambda record: record.number)
    lost = sum(record.is_lost for record in records)
    require(len(records) == runs and not lost, f"{len(records)} runs, {lost} of them lost")
    flown_s = median(record.simulated_s for record in records)
    require(abs(flown_s - FLIGHT_S) < 3.0, f"a flight takes {flown_s:.0f} s")
    return spent_s, records


def _differing(alone: list[Record], together: list[Record]) -> list[int]:
    """Numbers of the runs of which any check was judged otherwise."""
    pairs = zip(alone, together, strict=True)
    return [one.number for one, other in pairs if one.verdicts != other.verdicts or one.passed != other.passed]
