"""What `honeyguide fly` does round a flight."""

import gc
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from rich.console import Console

from mission.flight import Flight, FlightConfig
from mission.flight_session import FlightSession
from mission.fly_loop import fly_to_the_end

OBJECTS_MAX = 50_000  # a full collection of so many takes a few milliseconds; a program that is loaded has 350,000


@pytest.fixture
def unfrozen():
    yield
    gc.unfreeze()


@pytest.mark.usefixtures("unfrozen")
def test_no_frame_waits_for_the_garbage_of_all_that_was_loaded(tmp_path):
    flight, counts = Flight(FlightConfig()), []
    watch = [lambda: counts.append(len(gc.get_objects()))]
    session = FlightSession(flight, None, None, tmp_path, Console(quiet=True))
    session.fly(lambda _: flight.time_us >= 200_000, None, watch)
    assert 0 < max(counts) < OBJECTS_MAX


@pytest.mark.usefixtures("unfrozen")
def test_the_logs_are_complete_before_the_flight_is_drawn(tmp_path, monkeypatch):
    found = []
    monkeypatch.setattr(
        "mission.log.flight_plots.plot_flight", lambda *_: found.extend(path.name for path in tmp_path.iterdir())
    )
    options = SimpleNamespace(seconds=0.2, once=False)
    flight = Flight(FlightConfig(), folder=tmp_path)
    assert fly_to_the_end(flight, None, options, None, None, tmp_path, Console(quiet=True)) == 0
    assert {"flight.ulg", "flight.tlog"} <= set(found)


@pytest.mark.slow
def test_a_reader_who_goes_ends_the_flight_with_its_logs_complete(tmp_path):
    honeyguide = Path(sys.executable).with_name("honeyguide")
    command = [honeyguide, "fly", "--idle", "--speed", "max", "--seconds", "100000", "--run-folder", tmp_path]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as flight:
        while b" s  " not in flight.stdout.readline():  # until the vehicle has said something
            pass
        flight.stdout.close()
        assert flight.stderr.read() == b""
        assert flight.wait(60.0) == 0
    assert {"flight.ulg", "flight.tlog", "summary.json"} <= {path.name for path in tmp_path.iterdir()}
