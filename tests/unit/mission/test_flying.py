"""What `honeyguide fly` does round a flight."""

import gc

import pytest
from rich.console import Console

from mission.flight import Flight, FlightConfig
from mission.flying import advance
from mission.progress import Progress

OBJECTS_MAX = 50_000  # a full collection of so many takes a few milliseconds; a program that is loaded has 350,000


@pytest.fixture
def unfrozen():
    yield
    gc.unfreeze()


@pytest.mark.usefixtures("unfrozen")
def test_no_frame_waits_for_the_garbage_of_all_that_was_loaded():
    flight, counts = Flight(FlightConfig()), []
    watch = [lambda: counts.append(len(gc.get_objects()))]
    advance(flight, lambda _: flight.time_us >= 200_000, None, watch, Progress(flight, None), Console(quiet=True))
    assert 0 < max(counts) < OBJECTS_MAX
