"""What do missions as tests cost: scenarios, campaigns of them, a test in pytest, and the review of a flight's log?

A scenario with everything on takes turns with the default mission of `flight.py` in the same process; its time is all
that a scenario takes, built, flown, logged and judged. Commands are timed by the wall clock, on all cores.
"""

import json
import multiprocessing
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from hashlib import sha256
from pathlib import Path
from re import DOTALL, search, sub
from statistics import fmean
from tempfile import TemporaryDirectory
from typing import Any
from xml.etree import ElementTree as ET

from bench.flying import campaigns
from bench.flying.flight import CONFIG, rate
from bench.flying.startup import HONEYGUIDE
from bench.row import Row, best_of, require
from bench.soak import AIRFRAME, CAPACITY
from common.pool_worker import end_with_parent
from mission.scenario.runner import run_scenario
from mission.scenario.scenario import Scenario
from mission.scenario.scenario_file import READY, find_files, read_scenario

COMMAND = "python -m bench scenarios"
TURNS = 4  # the first one loads kernels
TRIES = 3
TESTS = 20
FLOWN_S = 1200.0
EVERYTHING = Path(__file__).with_name("everything.scenario.yaml")
SQUARE = [(40, 0, -10), (40, 40, -12), (0, 40, -10), (0, 0, -12)]
ROUNDS = 35
TESTS_FILE = f"""
import pytest


@pytest.mark.parametrize("number", range({1 + TESTS}))
async def test_flies_nothing(vehicle, number):
    pass


@pytest.mark.parametrize("number", range({1 + TESTS}))
def test_nothing(number):
    pass
"""


def measure() -> list[Row]:
    everything = read_scenario(EVERYTHING)
    alone = everything.model_copy(update={"owner": None})
    turns = [(rate(CONFIG), _rate(everything), _rate(alone)) for _ in range(TURNS)][1:]
    plain, busy, lonely = (max(rates) for rates in zip(*turns, strict=True))
    review_s, page_mb = _review()
    name = "one scenario, everything on, people too"
    return [
        Row(name, busy, "simulated s/CPU s", "higher", None, COMMAND),
        Row(f"{name}, over the default mission", busy / plain, "x", "higher", 0.5, COMMAND),
        Row("the same scenario without people, over the default mission", lonely / plain, "x", "higher", None, COMMAND),
        Row("all scenarios that ship, on all cores", _ready_s(), "s", "lower", 240.0, COMMAND),
        *campaigns.rows(COMMAND),
        Row("review of a log of 20 minutes", review_s, "s", "lower", 10.0, COMMAND),
        Row("its page", page_mb, "MB", "lower", 5.0, COMMAND),
        Row("a test in pytest with a vehicle, after the first", _test_s(), "s", "lower", 0.3, COMMAND),
    ]


def _rate(scenario: Scenario) -> float:
    """Simulated seconds per CPU second, from the scenario to its result, logs and replay kept."""
    with TemporaryDirectory() as folder:
        result = run_scenario(scenario, folder=Path(folder))
        require(result.passed, "; ".join(result.failures))
        require(result.ulogs and result.tlogs, "no logs were kept")
    return result.simulated_s / result.cpu_s


def require_same_logs(repeats: int) -> int:
    """Flies every scenario that ships so often, by processes that have flown others; how many flights each time.

    Raises:
        WrongResult: one failed, or left other logs than before.
    """
    scenarios = [read_scenario(path) for path in find_files([READY])]
    flights = [(scenario, seed) for scenario in scenarios for seed in scenario.seeds]
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(len(os.sched_getaffinity(0)), spawn, end_with_parent) as pool:
        first = list(pool.map(_logs_hash, flights))
        for _ in range(repeats - 1):
            again = list(pool.map(_logs_hash, reversed(flights)))[::-1]
            for (scenario, seed), one, other in zip(flights, first, again, strict=True):
                require(one == other, f"{scenario.name}, seed {seed}: other logs at another flight")
    return len(flights)


def _ready_s() -> float:
    """From the command to its end; before that each is flown twice."""
    count = require_same_logs(2)

    def once() -> float:
        start = time.perf_counter()
        done = subprocess.run([HONEYGUIDE, "test", "--ready"], capture_output=True, text=True, check=False)
        spent = time.perf_counter() - start
        is_good = done.returncode == 0 and f"{count} of {count} passed" in done.stdout
        require(is_good, done.stdout[-2000:] + done.stderr)
        return spent

    return best_of(2, once)


def _logs_hash(flight: tuple[Scenario, int]) -> str:
    with TemporaryDirectory() as folder:
        result = run_scenario(*flight, folder=Path(folder))
        require(result.passed, f"{result.name}: {'; '.join(result.failures)}")
        logs = [Path(path).read_bytes() for path in (*result.ulogs, *result.tlogs)]
    require(logs, f"{result.name}: no logs")
    return sha256(b"".join(logs)).hexdigest()


def _review() -> tuple[float, float]:
    """Seconds of the command, and the size of its page [MB]; the pack lasts, as large as that of `soak.py`."""
    with TemporaryDirectory() as folder:
        airframe, page = Path(folder) / "large.toml", Path(folder) / "page.html"
        airframe.write_text(sub(CAPACITY, r"\g<1>\g<2>e2", AIRFRAME.read_text(encoding="utf-8")), encoding="utf-8")
        round_and_round = {"fly_path": {"points": SQUARE * ROUNDS, "speed_m_s": 5}}
        vehicle = {"airframe": str(airframe), "script": [round_and_round]}
        long = Scenario.model_validate({"time_max_s": 2 * FLOWN_S, "wind": {"speed_m_s": 5}, "vehicle": vehicle})
        result = run_scenario(long, folder=Path(folder) / "run")
        require(result.passed and result.simulated_s >= FLOWN_S, f"{result.simulated_s:.0f} s: {result.error}")

        def once() -> float:
            start = time.perf_counter()
            subprocess.run(
                [HONEYGUIDE, "review", *result.ulogs, "--output", str(page)], check=True, stdout=subprocess.DEVNULL
            )
            return time.perf_counter() - start

        seconds = best_of(TRIES, once)
        _check_page(page.read_text(encoding="utf-8"), result.simulated_s)
        return seconds, page.stat().st_size / 1e6


def _check_page(text: str, flown_s: float) -> None:
    """Nothing is missing, and the time is all of the flight's."""
    embedded = search(r'<script id="data" type="application/json">(.*?)</script>', text, DOTALL)
    data = json.loads(embedded[1]) if embedded else {"sections": []}
    sections: Sequence[dict[str, Any]] = data["sections"]
    require(sections and all(each["panels"] and not each["missing"] for each in sections), "the page lacks sections")
    require(abs(data["span"][1] - flown_s) < 1.0, f"the page is of {data['span'][1]:.0f} s")


def _test_s() -> float:
    """What a test with a vehicle takes that flies nothing, beyond a test without one: the mean of all but the first."""

    def once() -> float:
        with TemporaryDirectory() as folder:
            (Path(folder) / "test_nothing.py").write_text(TESTS_FILE, encoding="utf-8")
            options = ["-q", "-p", "no:cacheprovider", "--junit-xml", "tests.xml"]
            command = [sys.executable, "-m", "pytest", *options]
            subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL)
            cases = list(ET.parse(Path(folder) / "tests.xml").iter("testcase"))
        require(len(cases) == 2 * (1 + TESTS), f"pytest ran {len(cases)} tests")
        times = [float(case.attrib["time"]) for case in cases]
        return fmean(times[1 : 1 + TESTS]) - fmean(times[2 + TESTS :])

    return best_of(TRIES, once)


if __name__ == "__main__":  # python -m bench.flying.scenarios REPEATS
    flown, asked = require_same_logs(int(sys.argv[1])), sys.argv[1]
    print(f"{flown} scenarios {asked} times: none failed, and each left the same logs every time")
