"""A running flight on the channels of one sink: its states, its texts, its scene and its camera."""

from collections.abc import Sequence
from typing import Any

from foxglove import Context

from mission.flight_base import FlightBase
from mission.foxglove.flight_state import FlightStates
from mission.foxglove.publisher import Publisher


class FlightExport:
    """Tells one sink of a flight.

    Args:
        flight: which.
        context: of the sink.
        path_ned: [m] (n, 3) of its plan.
    """

    def __init__(self, flight: FlightBase, context: Context, path_ned: Sequence[Any] = ()) -> None:
        self._flight = flight
        self._states = FlightStates(flight)
        self._publisher = Publisher(context)
        self._text_count = 0

    def frame(self) -> None:
        """After each frame of the flight."""
        flight, publisher = self._flight, self._publisher
        publisher.publish(self._states.now(), [])
        for text in flight.texts.since(self._text_count):
            publisher.text(text.time_us, text.severity, text.text, flight.time_us)
        self._text_count = flight.texts.count
