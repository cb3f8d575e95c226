"""Calibration commands; the progress is told in texts "[cal] ..." that ground stations parse."""

from collections.abc import Mapping
from math import isfinite

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.client_requests import CalibrationKind
from autopilot.interface.vehicle_state import ACCEPTED, Reply, Verdict
from autopilot.mavlink.channel import Endpoint
from autopilot.mavlink.service import Command, CommandHandler, Service, denied
from autopilot.mavlink.wire.convert import whole

_ACCEL_KINDS = {1: CalibrationKind.ACCEL, 2: CalibrationKind.LEVEL, 4: CalibrationKind.ACCEL_SIMPLE}
_OFFSET_SENSORS = {0: "GYRO", 1: "ACC", 2: "MAG"}


LOAD, SAVE, RESET, RESET_CALIBRATION = 0, 1, 2, 3  # PREFLIGHT_STORAGE_PARAMETER_ACTION


class CalibrationService(Service):
    """Starts and cancels calibrations, takes offsets that a client knows, and sets parameters back."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint

    def commands(self) -> Mapping[int, CommandHandler]:
        return {
            mavlink.MAV_CMD_PREFLIGHT_CALIBRATION: self._calibrate,
            mavlink.MAV_CMD_PREFLIGHT_SET_SENSOR_OFFSETS: self._set_offsets,
            mavlink.MAV_CMD_PREFLIGHT_STORAGE: self._store,
        }

    def _calibrate(self, command: Command) -> Reply:
        """Starts a calibration, or cancels the running one; what follows is told in texts "[cal] ...".

        Params: p1 = 1 gyroscope; p2 = 1 magnetometer; p3 = 1 barometer, which the estimator levels by itself: nothing
        is left to do; p5 = 1 accelerometer on six sides, 2 level horizon, 4
        accelerometer where it stands; all 0: cancel.
        Refused: TEMPORARILY_REJECTED: armed, or another calibration is running; UNSUPPORTED: radio, airspeed and motors
        need none here.
        """
        calibration = self._endpoint.vehicle.calibration
        wanted = [whole(value, 0) for value in (command.p1, command.p2, command.p3, command.p4, command.x, command.y)]
        wanted.append(whole(command.z, 0))
        if not any(wanted):
            return calibration.cancel()
        if wanted[0] == 1:
            return calibration.start(CalibrationKind.GYRO)
        if wanted[1] == 1:
            return calibration.start(CalibrationKind.MAG)
        if wanted[2] == 1:
            return calibration.start(CalibrationKind.BARO)
        kind = _ACCEL_KINDS.get(wanted[4])
        if kind is not None:
            return calibration.start(kind)
        return Reply(
            Verdict.UNSUPPORTED, "gyroscope, magnetometer, barometer, accelerometer and level can be calibrated"
        )

    def _set_offsets(self, command: Command) -> Reply:
        """Sets a sensor's offsets, as CAL_* parameters.

        Params: p1 sensor: 0 gyroscope, 1 accelerometer, 2 magnetometer; p2 to p4 offsets along x, y, z in rad/s, m/s^2
        or gauss.
        Refused: TEMPORARILY_REJECTED: armed; DENIED: an offset is missing; UNSUPPORTED: another sensor.
        """
        vehicle = self._endpoint.vehicle
        sensor = _OFFSET_SENSORS.get(whole(command.p1, -1))
        if sensor is None:
            return Reply(Verdict.UNSUPPORTED, "only gyroscope, accelerometer and magnetometer have offsets")
        if vehicle.state.is_armed:
            return Reply(Verdict.TEMPORARILY_REJECTED, "the vehicle is armed")
        offsets = (command.p2, command.p3, command.p4)
        if not all(map(isfinite, offsets)):
            return denied("needs three offsets")
        vehicle.calibration.set_offsets(sensor, offsets)
        return ACCEPTED

    def _store(self, command: Command) -> Reply:
        """Sets parameters back to their defaults; there is nothing to save, each change is kept as it is made.

        Params: p1: 2 sets all parameters back, 3 only those of the calibration; 1 (save) and 0 (load) have nothing left
        to do where the vehicle has a memory.
        Refused: TEMPORARILY_REJECTED: armed; UNSUPPORTED: p1 is 0 or 1 and nothing outlives a restart, or p1 is another
        number; DENIED: p2 is 2, missions are cleared by MISSION_CLEAR_ALL.
        """
        vehicle = self._endpoint.vehicle
        action = whole(command.p1, -1)
        if vehicle.state.is_armed:
            return Reply(Verdict.TEMPORARILY_REJECTED, "the vehicle is armed")
        if command.p2 == RESET:
            return denied("missions are cleared by MISSION_CLEAR_ALL")
        if action in (LOAD, SAVE):
            if vehicle.host.storage is None:
                return Reply(Verdict.UNSUPPORTED, "nothing outlives a restart of this vehicle")
            return ACCEPTED
        if action not in (RESET, RESET_CALIBRATION):
            return Reply(Verdict.UNSUPPORTED, "parameter 1 must be 0 to 3")
        params = vehicle.params
        for name in params.names:
            if action == RESET or name.startswith(("CAL_", "SENS_BOARD_")):
                params.set(name, params.declarations[name].default)
        return ACCEPTED
