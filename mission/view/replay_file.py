"""What a run keeps for those who look at it later: a moment of each frame, and what the flight was made from.

Of a vehicle disarmed for long it is a moment each second (`mission.log.kept_frames`).

In: a running flight. Out: `replay.npz` in the run folder, small enough to keep: 0.4 MB a minute. Replays, films,
HTML files and the scorecard are made from it alone.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from common.files import write_whole
from mission.console.name_checks import REPLAY_FILE as FILE
from mission.flight import Flight, FlightConfig
from mission.log.kept_frames import FrameChoice, KeptRows
from mission.view.flight_snapshot import MOMENT, Moment, Row, moment_of

_KEPT, _LEFT_OUT = np.ones(1, bool), np.zeros(1, bool)


class RecordingError(ValueError):
    """A folder without a run that can be shown; the message is one sentence."""


@dataclass(frozen=True, eq=False, slots=True)
class Recording:
    """One flight, as it is shown."""

    config: FlightConfig
    rows: NDArray[Any]  # of MOMENT, (moments,)
    path_ned: NDArray[np.float32]  # [m] (n, 3) of its plan; empty without one

    def __len__(self) -> int:
        return len(self.rows)

    def moment(self, index: int) -> Moment:
        return Moment(self.rows[index])

    @property
    def has_owner(self) -> bool:
        return self.config.owner is not None

    def every(self, frames: int) -> "Recording":
        """The same with fewer moments."""
        return Recording(self.config, self.rows[::frames], self.path_ned)

    def save(self, folder: Path) -> None:
        """Writes it into the folder of its run."""
        stream = BytesIO()
        config = np.array(self.config.model_dump_json())
        np.savez_compressed(stream, rows=self.rows, path_ned=self.path_ned, config=config)
        write_whole(folder / FILE, stream.getvalue())


def load_recording(folder: Path) -> Recording:
    """The recording of a run.

    Raises:
        RecordingError: there is none, or it cannot be read.
    """
    path = folder / FILE
    try:
        with np.load(BytesIO(path.read_bytes())) as data:
            rows, path_ned, text = data["rows"], data["path_ned"], str(data["config"])
        config = FlightConfig.model_validate(json.loads(text))
    except FileNotFoundError:
        raise RecordingError(f"{folder}: holds no run that can be shown: {FILE} is missing") from None
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror or error}") from error
    except (EOFError, KeyError, ValueError, BadZipFile) as error:
        raise RecordingError(f"{path}: cannot be read: damaged, or no recording") from error
    if len(rows) == 0 or rows.dtype != MOMENT:
        raise RecordingError(f"{path}: was written by another version, or holds nothing")
    return Recording(config, rows, path_ned)


class Recorder:
    """Keeps what is shown of a flight.

    Args:
        flight: what is recorded.
        path_ned: [m] (n, 3) of its plan.
        action: what a policy on board chose last.
    """

    def __init__(
        self, flight: Flight, path_ned: Sequence[Any] = (), action: Callable[[], Row | None] = lambda: None
    ) -> None:
        self._flight, self._action = flight, action
        self._path_ned = np.array(path_ned, np.float32).reshape(-1, 3)
        self._choice = FrameChoice()
        self._rows = KeptRows(MOMENT)

    def frame(self) -> None:
        """Notes the frame that is ending."""
        is_kept = self._choice.keeps(self._flight.time_us, is_armed=self._flight.controller.state.is_armed)
        row = moment_of(self._flight, self._action()).row
        self._rows.add(row.reshape(1), _KEPT if is_kept else _LEFT_OUT)

    def recording(self) -> Recording:
        """Everything so far."""
        return Recording(self._flight.config, self._rows.all(), self._path_ned)
