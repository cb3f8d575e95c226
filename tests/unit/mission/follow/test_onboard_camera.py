"""The onboard camera: it takes pictures for those who get them, and the pictures do not depend on who does."""

import numpy as np

from common.image_stream import ImageFrame
from mission.flight import Flight, FlightConfig
from mission.flight_config import OwnerConfig

JOINED_US = 1_000_000
LATE = {"image_lag_s": 0.1, "image_jitter_s": 0.2, "image_loss": 0.2, "bystanders": 3.0}


def pictures_of(joined_us: int) -> list[tuple[int, ImageFrame]]:
    """What somebody who joins at a time gets: when each picture came, and the picture."""
    config, found = FlightConfig(owner=OwnerConfig(numbers=LATE), seed=3), []
    flight = Flight(config)
    try:
        flight.run(lambda _: flight.time_us >= joined_us)
        flight.onboard.add_sink(lambda frame: found.append((flight.time_us, frame)))
        flight.run(lambda _: flight.time_us >= 2 * JOINED_US)
    finally:
        flight.close()
    return found


def test_who_joins_later_gets_the_same_pictures_at_the_same_times() -> None:
    whole = [(come_us, frame) for come_us, frame in pictures_of(0) if frame.time_us > JOINED_US]
    later = pictures_of(JOINED_US)
    assert len(later) > 3
    for (come_us, frame), (later_us, other) in zip(whole, later, strict=True):
        assert (come_us, frame.time_us, frame.sequence) == (later_us, other.time_us, other.sequence)
        assert np.array_equal(frame.pixels, other.pixels)
