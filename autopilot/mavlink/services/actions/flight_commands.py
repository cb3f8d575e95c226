"""Commands about the flight itself: arming, take-off, landing, modes, home, restart.

In a command NaN means default and 0 is a value.
"""

from collections.abc import Mapping
from math import isnan, nan, radians
from typing import Any

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.client_requests import ChangeMode, LandAt, SetHome, TakeOff
from autopilot.interface.vehicle_state import ACCEPTED, Mode, Reply, Severity, Verdict
from autopilot.mavlink.channel import Endpoint, Sender
from autopilot.mavlink.dialects import UnknownModeError
from autopilot.mavlink.service import COMMAND_ACK, Command, CommandHandler, Handler, Service, denied
from autopilot.mavlink.services.events import EventService
from autopilot.mavlink.services.identity import banner
from autopilot.mavlink.wire.altitude_frames import command_alt_amsl_m
from autopilot.mavlink.wire.convert import is_position, whole

FORCE = 21196  # param2 of COMPONENT_ARM_DISARM
REBOOT = 1  # param1 of PREFLIGHT_REBOOT_SHUTDOWN


class FlightCommands(Service):
    """Passes them on to the vehicle, whose reply is the answer."""

    def __init__(self, endpoint: Endpoint, events: EventService) -> None:
        self._endpoint = endpoint
        self._events = events

    def messages(self) -> Mapping[str, Handler]:
        return {"SET_MODE": self.set_mode_received}

    def commands(self) -> Mapping[int, CommandHandler]:
        return {
            mavlink.MAV_CMD_COMPONENT_ARM_DISARM: self._arm_disarm,
            mavlink.MAV_CMD_NAV_TAKEOFF: self._takeoff,
            mavlink.MAV_CMD_NAV_LAND: self._land,
            mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: self._return,
            mavlink.MAV_CMD_NAV_LOITER_UNLIM: self._hold,
            mavlink.MAV_CMD_DO_SET_MODE: self._set_mode,
            mavlink.MAV_CMD_DO_SET_HOME: self._set_home,
            mavlink.MAV_CMD_RUN_PREARM_CHECKS: self._run_prearm_checks,
            mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: self._reboot,
            mavlink.MAV_CMD_DO_SEND_BANNER: self._send_banner,
        }

    def _arm_disarm(self, command: Command) -> Reply:
        """Arms or disarms.

        Params: p1 1 arms, 0 disarms; p2 21196 forces it: arming without checks, disarming in the air.
        Refused: TEMPORARILY_REJECTED while a check fails (the text names it), or when disarming in the air; DENIED for
        another p1.
        """
        is_forced = command.p2 == FORCE
        if command.p1 == 1.0:
            return self._endpoint.vehicle.arm(force=is_forced)
        if command.p1 == 0.0:
            return self._endpoint.vehicle.disarm(force=is_forced)
        return denied("parameter 1 must be 0 (disarm) or 1 (arm)")

    def _takeoff(self, command: Command) -> Reply:
        """Climbs straight up, then holds.

        Params: p4 heading [deg], NaN: as it is; p7 altitude, NaN: MIS_TAKEOFF_ALT above home. A lower altitude than
        that is raised to it, with a text.
        Refused: TEMPORARILY_REJECTED without a position; DENIED for an altitude out of range.
        """
        alt_amsl_m, reply = command_alt_amsl_m(self._endpoint.vehicle.state, command)
        return reply or self._endpoint.vehicle.request(TakeOff(alt_amsl_m, radians(command.p4)))

    def _land(self, command: Command) -> Reply:
        """Lands.

        Params: p4 heading [deg], NaN: as it is; p5, p6 place, NaN or 0, 0: here.
        Refused: TEMPORARILY_REJECTED on the ground; DENIED for a position that is not on earth.
        """
        lat_deg, lon_deg = command.x, command.y
        if lat_deg == 0.0 and lon_deg == 0.0:  # what scripts that leave them out send; landing there is never meant
            lat_deg = lon_deg = nan
        if not is_position(lat_deg, lon_deg):
            return denied("there is no such latitude and longitude")
        return self._endpoint.vehicle.request(LandAt(lat_deg, lon_deg, radians(command.p4)))

    def _return(self, _: Command) -> Reply:
        """Returns home, or to where RTL_TYPE says, and lands.

        Refused: TEMPORARILY_REJECTED on the ground, without a position or without home.
        """
        return self._endpoint.vehicle.request(ChangeMode(Mode.RETURN))

    def _hold(self, _: Command) -> Reply:
        """Holds here, in mode Hold (ArduPilot: Loiter).

        Refused: TEMPORARILY_REJECTED in the air without a position.
        """
        return self._endpoint.vehicle.request(ChangeMode(Mode.HOLD))

    def _set_mode(self, command: Command) -> Reply:
        """Changes the flight mode.

        Params: p1 must have the bit CUSTOM_MODE_ENABLED (1); p2, p3 the mode in the dialect's numbers.
        Refused: DENIED for a mode there is not; TEMPORARILY_REJECTED for one that cannot be flown now.
        """
        if not whole(command.p1, 0) & mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
            return denied("parameter 1 must have the custom mode flag")
        try:
            mode = self._endpoint.dialect.mode_from_command(whole(command.p2, -1), whole(command.p3, 0))
        except UnknownModeError as unknown:
            return denied(str(unknown))
        return self._endpoint.vehicle.request(ChangeMode(mode))

    def _set_home(self, command: Command) -> Reply:
        """Sets home.

        Params: p1 1: here; otherwise p5, p6 place and p7 altitude; above sea level in any frame in PX4's dialect.
        Refused: TEMPORARILY_REJECTED without a position; DENIED for a position not on earth, more than 50 km from
        where the vehicle was switched on, or more than 10 km higher or lower.
        """
        if command.p1 == 1.0:
            return self._endpoint.vehicle.request(SetHome())
        alt_amsl_m, reply = command_alt_amsl_m(self._endpoint.vehicle.state, command)
        if reply is not None:
            return reply
        if isnan(command.x) or isnan(alt_amsl_m) or not is_position(command.x, command.y):
            return denied("needs latitude, longitude and altitude, or parameter 1 = 1 for here")
        return self._endpoint.vehicle.request(SetHome(command.x, command.y, alt_amsl_m))

    def _run_prearm_checks(self, _: Command) -> Reply:
        """Checks whether the vehicle may be armed, and names each reason against it in a text; as events, too.

        Refused: TEMPORARILY_REJECTED while armed.
        """
        vehicle = self._endpoint.vehicle
        self._events.report()
        if vehicle.state.is_armed:
            return Reply(Verdict.TEMPORARILY_REJECTED, "the vehicle is armed")
        for reason in vehicle.check_arming():
            self._endpoint.text(Severity.CRITICAL, f"PreArm: {reason}")
        return ACCEPTED

    def _send_banner(self, command: Command) -> Reply:
        """Sends the text that greets a client, once more."""
        self._endpoint.text(Severity.INFO, banner(self._endpoint.dialect), to=command.sender)
        return ACCEPTED

    def _reboot(self, command: Command) -> Reply:
        """Restarts the flight controller.

        Params: p1 1: restart.
        Refused: TEMPORARILY_REJECTED while armed; UNSUPPORTED for anything else than a restart.
        """
        if command.p1 != REBOOT:
            return Reply(Verdict.UNSUPPORTED, "only a reboot of the autopilot is supported")
        return self._endpoint.vehicle.reboot()

    def set_mode_received(self, sender: Sender, fields: Any) -> None:
        """Changes the flight mode; the heartbeat is the answer, in ArduPilot's dialect after COMMAND_ACK number 11."""
        try:
            mode = self._endpoint.dialect.mode_from_custom(fields.custom_mode)
        except UnknownModeError as unknown:
            self._endpoint.text_once(Severity.WARNING, f"Mode: {unknown}")
            self._acknowledge_set_mode(sender, Verdict.DENIED)
            return
        reply = self._endpoint.vehicle.request(ChangeMode(mode))
        if reply.verdict != Verdict.ACCEPTED:
            self._endpoint.text(Severity.WARNING, f"Mode: {reply.reason}")
        self._acknowledge_set_mode(sender, reply.verdict)

    def _acknowledge_set_mode(self, sender: Sender, verdict: Verdict) -> None:
        if self._endpoint.dialect.acknowledges_set_mode:
            payload = COMMAND_ACK.pack(mavlink.MAVLINK_MSG_ID_SET_MODE, verdict, 0, 0, sender.sysid, sender.compid)
            self._endpoint.reply(sender, COMMAND_ACK, payload)
