"""What stays of a benchmark's flight besides its outcome: nothing, or its logs with each decision, to learn from."""

from dataclasses import dataclass, field
from pathlib import Path

from mission.dataset.companion_log import DecisionRecording
from mission.dataset.recording import record_flight
from mission.flight_base import FlightBase
from mission.view.replay_file import keep_for_replay
from policies.companion.companion import Companion


@dataclass(slots=True)
class KeptFlight:
    """Of one flight; without a folder it keeps nothing."""

    folder: Path | None = None
    """Of the flight's logs."""
    pilot: str = ""
    """Who decides, for the log."""
    _recordings: list[DecisionRecording] = field(default_factory=list)

    def begin(self, flight: FlightBase, companion: Companion) -> None:
        """Keeps what a dataset is built of, from a flight that has not begun."""
        if self.folder is not None:
            keep_for_replay(flight)
            self._recordings.append(record_flight(flight, companion, self.folder, self.pilot))

    def close(self) -> None:
        """Completes what the flight itself does not, after it."""
        for recording in self._recordings:
            recording.close()
