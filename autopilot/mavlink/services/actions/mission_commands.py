"""Commands about the mission, the speed of the flight and where the vehicle looks.

In: COMMAND_LONG, COMMAND_INT. Out: requests to the vehicle's guidance, acknowledged like every command.
"""

from collections.abc import Mapping
from math import isfinite, isnan, nan

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.client_requests import ChangeSpeed, SetCurrentItem, StartMission
from autopilot.interface.vehicle_state import ACCEPTED, Reply
from autopilot.mavlink.channel import Endpoint
from autopilot.mavlink.service import Command, CommandHandler, Service, denied
from autopilot.mavlink.wire.altitude_frames import command_alt_amsl_m
from autopilot.mavlink.wire.convert import whole

UNCHANGED = -1.0
BY_DEFAULT = -2.0
_LOCATION = (mavlink.MAV_ROI_NONE, mavlink.MAV_ROI_LOCATION)  # ArduPilot's clients send 0 with a position


class MissionCommands(Service):
    """Mission, speed and heading."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint

    def commands(self) -> Mapping[int, CommandHandler]:
        return {
            mavlink.MAV_CMD_DO_CHANGE_SPEED: self._change_speed,
            mavlink.MAV_CMD_DO_PAUSE_CONTINUE: self._pause_continue,
            mavlink.MAV_CMD_MISSION_START: self._mission_start,
            mavlink.MAV_CMD_DO_SET_MISSION_CURRENT: self._set_current_item,
            mavlink.MAV_CMD_DO_LAND_START: self._land_start,
            mavlink.MAV_CMD_DO_RETURN_PATH_START: self._return_path_start,
            mavlink.MAV_CMD_DO_GO_AROUND: self._go_around,
            mavlink.MAV_CMD_CONDITION_YAW: self._turn,
            mavlink.MAV_CMD_NAV_ROI: self._roi,
            mavlink.MAV_CMD_DO_SET_ROI: self._roi,
            mavlink.MAV_CMD_DO_SET_ROI_LOCATION: self._roi_location,
            mavlink.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET: self._roi_next,
            mavlink.MAV_CMD_DO_SET_ROI_NONE: self._roi_none,
        }

    # Speed

    def _change_speed(self, command: Command) -> Reply:
        """Changes a speed of what is being flown, until the mode changes.

        Params: p1 0 or 1: ground speed, 2: climb, 3: descent; p2 speed [m/s], -1: no change, -2: the default.
        Refused: DENIED for another kind of speed or a negative one.
        """
        kind = whole(command.p1, -1)
        if kind not in (0, 1, 2, 3):
            return denied("parameter 1 must be 0 or 1 (ground speed), 2 (climb) or 3 (descent)")
        if command.p2 == UNCHANGED or isnan(command.p2):
            return ACCEPTED
        if command.p2 == BY_DEFAULT:
            return self._endpoint.vehicle.request(ChangeSpeed(nan, kind))
        if command.p2 < 0.0:
            return denied("a speed cannot be negative")
        return self._endpoint.vehicle.request(ChangeSpeed(command.p2, kind))

    # Mission

    def _pause_continue(self, command: Command) -> Reply:
        """Pauses the mission or a client's setpoints (Offboard, Guided), or goes on with what was paused.

        Params: p1 0 pauses, 1 continues.
        Refused: TEMPORARILY_REJECTED without a mission to pause or to continue.
        """
        if command.p1 == 0.0:
            return self._endpoint.vehicle.guidance.pause()
        if command.p1 == 1.0:
            return self._endpoint.vehicle.guidance.resume()
        return denied("parameter 1 must be 0 (pause) or 1 (continue)")

    def _mission_start(self, command: Command) -> Reply:
        """Flies the mission.

        Params: p1 first item, -1: where it stands; p2 last item, counts if it is not before the first and not 0.
        Refused: TEMPORARILY_REJECTED without a mission, position or home; DENIED for an item there is not.
        """
        offset = self._endpoint.dialect.first_seq
        first, last = whole(command.p1, -1), whole(command.p2, -1)
        last = last - offset if last >= max(first, 1) else -1
        return self._endpoint.vehicle.request(StartMission(first - offset, last))

    def _set_current_item(self, command: Command) -> Reply:
        """Makes a mission item the current one; in mode Mission the vehicle flies to it at once.

        Params: p1 the item's number, -1: the present one; p2 1: every jump counts from the beginning again.
        Refused: DENIED for an item there is not.
        """
        seq = whole(command.p1, -1)
        vehicle = self._endpoint.vehicle
        is_reset = command.p2 == 1.0
        if seq == -1 and is_reset:
            return vehicle.request(SetCurrentItem(vehicle.state.mission_current, is_reset=True))
        if seq < 0:
            return denied("parameter 1 must be an item's number")
        seq = max(seq - self._endpoint.dialect.first_seq, 0)
        return vehicle.request(SetCurrentItem(seq, is_reset=is_reset))

    def _land_start(self, _: Command) -> Reply:
        """Goes on with the mission at its nearest DO_LAND_START.

        Refused: TEMPORARILY_REJECTED on the ground or if the mission cannot be flown; FAILED without such an item.
        """
        return self._endpoint.vehicle.guidance.fly_landing_sequence()

    def _return_path_start(self, _: Command) -> Reply:
        """Joins the mission at the nearest of its legs after DO_RETURN_PATH_START.

        Refused: TEMPORARILY_REJECTED on the ground or if the mission cannot be flown; FAILED without such an item.
        """
        return self._endpoint.vehicle.guidance.fly_return_path()

    def _go_around(self, command: Command) -> Reply:
        """Climbs away from a landing and holds; a plane goes round: it circles the touchdown until it is asked to land.

        Params: p1 height above home [m], at least MIS_TAKEOFF_ALT; 0 or NaN: that. Of a plane above the touchdown, at
        least MIS_LND_ABRT_ALT.
        Refused: TEMPORARILY_REJECTED unless the vehicle is on its last descent, or without a position.
        """
        return self._endpoint.vehicle.guidance.abort_landing(command.p1)

    # Heading

    def _turn(self, command: Command) -> Reply:
        """Turns to a heading, or by an angle, and keeps it until the next position, mission leg or mode.

        Params: p1 heading or angle [deg]; p2 rate [deg/s], 0: the fastest; p3 1 clockwise, -1 counter-clockwise,
        0 the short way; p4 1: p1 is an angle to turn by.
        Refused: TEMPORARILY_REJECTED on the ground; DENIED for an angle or rate out of range.
        """
        return self._endpoint.vehicle.guidance.turn(command.p1, command.p2, command.p3, is_relative=command.p4 == 1.0)

    def _roi(self, command: Command) -> Reply:
        """Points the vehicle, and a gimbal, at a position, or as the mode has it; the older form.

        Params: p1 0 or 3: the position in p5, p6, p7 (0 without a position: none), 1: the next waypoint.
        Refused: DENIED for another kind of region.
        """
        kind = whole(command.p1, mavlink.MAV_ROI_LOCATION)
        has_position = isfinite(command.x) and isfinite(command.y) and (command.x != 0.0 or command.y != 0.0)
        if kind in _LOCATION and has_position:
            return self._roi_location(command)
        if kind in (mavlink.MAV_ROI_NONE, mavlink.MAV_ROI_WPNEXT):
            return self._endpoint.vehicle.guidance.look_ahead(command.command, 0.0)
        return denied("only a place or the next waypoint can be a region of interest")

    def _roi_location(self, command: Command) -> Reply:
        """Points the vehicle, and a gimbal, at a position from now on, in every mode that flies itself.

        Params: p5, p6 place; p7 altitude, above sea level in any frame in PX4's dialect; NaN: that of home.
        Refused: DENIED for a position that is not on earth.
        """
        if isnan(command.z):
            alt_amsl_m: float = nan
        else:
            alt_amsl_m, reply = command_alt_amsl_m(self._endpoint.vehicle.state, command)
            if reply is not None:
                return reply
        return self._endpoint.vehicle.guidance.look_at(command.command, command.x, command.y, alt_amsl_m)

    def _roi_next(self, command: Command) -> Reply:
        """Points the vehicle along its mission legs, turned by an offset.

        Params: p7 offset of the heading [deg].
        """
        return self._endpoint.vehicle.guidance.look_ahead(command.command, command.z)

    def _roi_none(self, command: Command) -> Reply:
        """Ends a region of interest."""
        return self._endpoint.vehicle.guidance.look_ahead(command.command, 0.0)
