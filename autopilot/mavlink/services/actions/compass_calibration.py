"""Calibration of the magnetometer as ArduPilot's clients ask for it and follow it.

In: DO_START_MAG_CAL and its like, the calibration's texts. Out: MAG_CAL_PROGRESS and MAG_CAL_REPORT to everyone. The
calibration is the one that PREFLIGHT_CALIBRATION starts.
"""

import re
from collections.abc import Mapping

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.client_requests import CalibrationKind
from autopilot.interface.vehicle_state import ACCEPTED, Reply, Verdict
from autopilot.mavlink.channel import Endpoint
from autopilot.mavlink.service import Command, CommandHandler, Service, denied
from autopilot.mavlink.wire.codec import known_type
from autopilot.mavlink.wire.convert import whole

COMPASS = 1  # the only one, as a mask
_GAUSS_TO_MILLIGAUSS = 1000.0
_PROGRESS = re.compile(r"progress <(\d+)>")

_MAG_CAL_PROGRESS = known_type("MAG_CAL_PROGRESS")
_MAG_CAL_REPORT = known_type("MAG_CAL_REPORT")


class CompassService(Service):
    """Starts, follows and ends it."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self._is_running = False
        self._is_done = False

    def commands(self) -> Mapping[int, CommandHandler]:
        return {
            mavlink.MAV_CMD_DO_START_MAG_CAL: self._start,
            mavlink.MAV_CMD_DO_ACCEPT_MAG_CAL: self._accept,
            mavlink.MAV_CMD_DO_CANCEL_MAG_CAL: self._cancel,
        }

    def _start(self, command: Command) -> Reply:
        """Calibrates the magnetometer; MAG_CAL_PROGRESS and MAG_CAL_REPORT follow. The result is kept at once.

        Params: p1 which, as a mask, 0: all.
        Refused: TEMPORARILY_REJECTED: armed, or another calibration is running; DENIED: there is no such magnetometer.
        """
        mask = whole(command.p1, 0)
        if mask and not mask & COMPASS:
            return denied("there is one magnetometer")
        self._is_running = True  # its first texts come before it returns, or with the next frame
        self._is_done = False
        reply = self._endpoint.vehicle.calibration.start(CalibrationKind.MAG)
        self._is_running = reply.verdict is Verdict.ACCEPTED
        return reply

    def _accept(self, _: Command) -> Reply:
        """Keeps the result, which is kept already.

        Refused: TEMPORARILY_REJECTED: no calibration has come to its end.
        """
        return ACCEPTED if self._is_done else Reply(Verdict.TEMPORARILY_REJECTED, "no calibration has been finished")

    def _cancel(self, _: Command) -> Reply:
        """Ends the calibration that was started so; without one there is nothing to do."""
        return self._endpoint.vehicle.calibration.cancel() if self._is_running else ACCEPTED

    def reported_text(self, text: str) -> None:
        """A text of the vehicle to everyone: the calibration's are its progress."""
        if not self._is_running or not text.startswith("[cal] "):
            return
        progress = _PROGRESS.search(text)
        if progress is not None:
            self._tell_progress(int(progress[1]))
        elif "calibration done" in text:
            self._end(mavlink.MAG_CAL_SUCCESS)
        elif "calibration failed" in text:
            self._end(mavlink.MAG_CAL_FAILED)
        elif "calibration cancelled" in text:
            self._is_running = False

    def _tell_progress(self, percent: int) -> None:
        status = mavlink.MAG_CAL_RUNNING_STEP_ONE
        payload = _MAG_CAL_PROGRESS.pack(
            cal_mask=COMPASS, cal_status=status, attempt=1, completion_pct=percent, completion_mask=(0,) * 10
        )
        self._endpoint.broadcast(_MAG_CAL_PROGRESS, payload)

    def _end(self, status: int) -> None:
        """Tells how it went; ArduPilot's offsets are added, ours are what is read too much."""
        self._is_running = False
        self._is_done = status == mavlink.MAG_CAL_SUCCESS
        params = self._endpoint.vehicle.params
        x, y, z = (-_GAUSS_TO_MILLIGAUSS * float(params[f"CAL_MAG0_{axis}OFF"]) for axis in "XYZ")
        payload = _MAG_CAL_REPORT.pack(
            cal_mask=COMPASS, cal_status=status, autosaved=1, ofs_x=x, ofs_y=y, ofs_z=z,
            diag_x=1.0, diag_y=1.0, diag_z=1.0, scale_factor=1.0,
        )  # fmt: skip
        self._endpoint.broadcast(_MAG_CAL_REPORT, payload)
