"""What every vehicle of a batch did, frame by frame, as the recorder of a flight keeps it for its checks."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from autopilot.ports import AIRSPEED_VALID
from mission.campaign.batch.batch_flight import BatchFlight
from mission.log.flight_recorder import HISTORY, History
from mission.log.kept_frames import FrameChoice
from sim.rig import Rig

CHUNK_FRAMES = 500


class BatchHistory:
    """Frames of a batch.

    Args:
        rig: of all.
        flights: of each row.
    """

    def __init__(self, rig: Rig, flights: Sequence[BatchFlight]) -> None:
        self._rig, self._states = rig, [flight.controller.state for flight in flights]
        self._now = np.zeros(len(flights), HISTORY)  # what flight controllers said last
        self._chunks: list[np.ndarray[Any, Any]] = []
        self._frames = 0

    def note(self, time_us: int, seen: Sequence[int]) -> None:
        """Notes the frame that is ending.

        Args:
            time_us: of its end.
            seen: the rows whose flight controller has run in it.
        """
        if self._frames % CHUNK_FRAMES == 0:
            self._chunks.append(np.empty((CHUNK_FRAMES, len(self._states)), HISTORY))
        row = self._chunks[-1][self._frames % CHUNK_FRAMES]
        self._frames += 1
        truth, estimate = self._rig.rows["truth"], self._rig.rows["autopilot.ekf.rows"]["estimate"]
        row["time_us"] = time_us
        row["pos_ned_true"], row["vel_ned_true"], row["q_true"] = (
            truth["pos_ned"],
            truth["vel_ned"],
            truth["q_ned_from_frd"],
        )
        row["pos_ned_est"], row["vel_ned_est"] = estimate["pos_ned"], estimate["vel_ned"]
        row["q_est"] = estimate["q_ned_from_frd"]
        row["airspeed"] = np.where(estimate["flags"] & int(AIRSPEED_VALID), estimate["airspeed"], np.nan)
        now = self._now
        for i in seen:
            state = self._states[i]
            now["is_armed"][i], now["mode"][i] = state.is_armed, state.mode
            now["mission_seq"][i], now["battery_remaining"][i] = state.mission_current, state.battery_remaining
        for name in ("is_armed", "mode", "mission_seq", "battery_remaining"):
            row[name] = now[name]

    def of(self, i_vehicle: int, end_us: int) -> History:
        """Of one vehicle until its end."""
        rows = np.concatenate([chunk[:, i_vehicle] for chunk in self._chunks])[: self._frames]
        rows = rows[rows["time_us"] <= end_us]
        choice = FrameChoice()
        pairs = zip(rows["time_us"].tolist(), rows["is_armed"].tolist(), strict=True)
        is_kept = np.array([choice.keeps(time_us, is_armed=armed) for time_us, armed in pairs])
        is_kept[-1] = True
        kept = rows[is_kept]
        return History(*(kept[name] for name in HISTORY.names or ()))
