"""Segments of logged flights, each 4 ms a row: where the kernels begin, what they follow and where they should end.

In a segment the attitude is always the log's. For `LEAD_TICKS` velocity and rates are, too, while the rotors come to
the speeds that their commands ask for. Then the velocity is predicted until the end, and the rates in windows of
`WINDOW_TICKS`, each of which begins at the log's rates: an error of a torque would turn a vehicle over within a second.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from common.kernels import TICK_S

LEAD_TICKS, WINDOW_TICKS, WINDOWS = 50, 50, 5
FLIGHT_TICKS = WINDOW_TICKS * WINDOWS
ROWS = LEAD_TICKS + FLIGHT_TICKS + 1
SEGMENT_S, WINDOW_S = FLIGHT_TICKS * TICK_S, WINDOW_TICKS * TICK_S


@dataclass(frozen=True, slots=True, eq=False)
class Segments:
    """Segments of one flight or of several; arrays of float32, but where another type is named."""

    log: NDArray[np.int32]  # (segments,) which flight
    command: NDArray[Any]  # (segments, ROWS, 8) of each motor, 0 to 1
    voltage: NDArray[Any]  # (segments, ROWS) of the battery, of that of a full one
    density_ratio: NDArray[Any]  # (segments,) of the air, over that at sea level
    vel_ned: NDArray[Any]  # (segments, ROWS, 3) [m/s]
    q_ned_from_frd: NDArray[Any]  # (segments, ROWS, 4) x, y, z, w
    omega_frd: NDArray[Any]  # (segments, ROWS, 3) [rad/s]
    log_count: int = 1  # flights, those without a segment too

    def __len__(self) -> int:
        return len(self.log)

    def only(self, chosen: NDArray[np.bool_]) -> "Segments":
        """Some of the segments; the numbers of flights stay."""
        arrays = {name: getattr(self, name)[chosen] for name in _ARRAYS}
        return Segments(**arrays, log_count=self.log_count)

    @property
    def flown(self) -> tuple[NDArray[Any], NDArray[Any]]:
        """Velocities at the end [m/s], (segments, 3); rates at the windows' ends [rad/s], (segments, WINDOWS, 3)."""
        ends = LEAD_TICKS + WINDOW_TICKS * np.arange(1, WINDOWS + 1)
        return self.vel_ned[:, -1], self.omega_frd[:, ends]

    @property
    def begun(self) -> tuple[NDArray[Any], NDArray[Any]]:
        """The same where segment and windows begin: what predicts that nothing changes."""
        begins = LEAD_TICKS + WINDOW_TICKS * np.arange(WINDOWS)
        return self.vel_ned[:, LEAD_TICKS], self.omega_frd[:, begins]


_ARRAYS = tuple(each.name for each in fields(Segments) if each.name != "log_count")


def joined(parts: Sequence[Segments]) -> Segments:
    """The segments of several flights, one after the other."""
    arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _ARRAYS}
    arrays["log"] = np.repeat(np.arange(len(parts), dtype=np.int32), [len(part) for part in parts])
    return Segments(**arrays, log_count=len(parts))
