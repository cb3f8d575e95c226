"""Commands for what drives: backwards, and a heading with a speed.

In: COMMAND_LONG, COMMAND_INT. Out: requests to the vehicle. An aircraft does not know them.
"""

from collections.abc import Mapping
from math import cos, isfinite, radians, sin

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.client_requests import OffboardSetpoint, SetReverse
from autopilot.interface.vehicle_state import Mode, Reply, Verdict
from autopilot.mavlink.channel import Endpoint
from autopilot.mavlink.service import Command, CommandHandler, Service, denied
from autopilot.ports import SETPOINT_ATTITUDE


class DriveCommands(Service):
    """Of vehicles that never leave the ground."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint

    def commands(self) -> Mapping[int, CommandHandler]:
        if self._endpoint.vehicle.leaves_ground:
            return {}
        return {
            mavlink.MAV_CMD_DO_SET_REVERSE: self._set_reverse,
            mavlink.MAV_CMD_NAV_SET_YAW_SPEED: self._set_yaw_speed,
        }

    def _set_reverse(self, command: Command) -> Reply:
        """Drives its ways backwards from now on, until the mode changes.

        Params: p1 0 forwards, 1 backwards.
        Refused: DENIED for another number.
        """
        if command.p1 not in (0.0, 1.0):
            return denied("parameter 1 must be 0 (forwards) or 1 (backwards)")
        return self._endpoint.vehicle.request(SetReverse(command.p1 == 1.0))

    def _set_yaw_speed(self, command: Command) -> Reply:
        """Drives with a heading and a part of its greatest speed, in ArduPilot's mode Guided; to be renewed in time.

        Params: p1 heading [deg]; p2 speed, -1..1; p3 1: the heading counts from the present one.
        Refused: TEMPORARILY_REJECTED in another mode; DENIED for what is no number or too fast.
        """
        if not isfinite(command.p1) or not -1.0 <= command.p2 <= 1.0:
            return denied("needs a heading and a speed of -1 to 1")
        vehicle = self._endpoint.vehicle
        if vehicle.state.mode is not Mode.GUIDED:
            return Reply(Verdict.TEMPORARILY_REJECTED, "needs mode Guided")
        yaw = radians(command.p1) + (vehicle.state.yaw_rad if command.p3 == 1.0 else 0.0)
        q_ned_from_frd = (0.0, 0.0, sin(0.5 * yaw), cos(0.5 * yaw))
        return vehicle.request(
            OffboardSetpoint(
                self._endpoint.time_us, SETPOINT_ATTITUDE, q_ned_from_frd=q_ned_from_frd, thrust=command.p2
            )
        )
