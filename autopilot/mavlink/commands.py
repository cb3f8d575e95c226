"""The command protocol: COMMAND_LONG and COMMAND_INT in, one COMMAND_ACK out, and a text with the reason of a refusal.

A table maps each command to its handler; a command that is not in it is answered UNSUPPORTED at once. Requests for
information are refused without a text: asking is how clients find out what there is. In a command NaN means default and
0 is a value.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isfinite, isinf, isnan, nan, radians
from typing import Any

from pymavlink.dialects.v20 import all as mavlink

from autopilot.mavlink.altitude import command_alt_amsl_m
from autopilot.mavlink.channel import AUTOPILOT_COMPONENT, Endpoint, Sender
from autopilot.mavlink.codec import MessageType, known_type
from autopilot.mavlink.component import Component
from autopilot.mavlink.convert import (
    INT32_MAX,
    LATLON_FRAMES,
    bounded_int,
    degrees_from_e7,
    is_position,
    whole,
)
from autopilot.mavlink.dialects import UnknownModeError
from autopilot.mavlink.home_item import in_clients_numbers
from autopilot.mavlink.service import Command, CommandHandler, Handler, RequestHandler, Service, denied
from autopilot.vehicle import ACCEPTED, Mode, Reply, Severity, Verdict

FORCE = 21196  # param2 of COMPONENT_ARM_DISARM
REBOOT = 1  # param1 of PREFLIGHT_REBOOT_SHUTDOWN

_COMMAND_ACK = known_type("COMMAND_ACK")
_MESSAGE_INTERVAL = known_type("MESSAGE_INTERVAL")
_HEARTBEAT_ID = known_type("HEARTBEAT").msg_id
_HOME_POSITION_ID = known_type("HOME_POSITION").msg_id
_AUTOPILOT_VERSION_ID = known_type("AUTOPILOT_VERSION").msg_id

_SHORT_NAMES = {
    mavlink.MAV_CMD_COMPONENT_ARM_DISARM: "Arm",
    mavlink.MAV_CMD_NAV_TAKEOFF: "Takeoff",
    mavlink.MAV_CMD_NAV_LAND: "Land",
    mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: "Return",
    mavlink.MAV_CMD_DO_SET_MODE: "Mode",
    mavlink.MAV_CMD_DO_REPOSITION: "Goto",
    mavlink.MAV_CMD_DO_CHANGE_SPEED: "Speed",
    mavlink.MAV_CMD_DO_SET_HOME: "Home",
    mavlink.MAV_CMD_MISSION_START: "Mission",
    mavlink.MAV_CMD_DO_SET_MISSION_CURRENT: "Mission",
    mavlink.MAV_CMD_DO_PAUSE_CONTINUE: "Pause",
    mavlink.MAV_CMD_DO_LAND_START: "Landing",
    mavlink.MAV_CMD_DO_RETURN_PATH_START: "Return",
    mavlink.MAV_CMD_DO_GO_AROUND: "Abort landing",
    mavlink.MAV_CMD_CONDITION_YAW: "Heading",
    mavlink.MAV_CMD_NAV_ROI: "Region of interest",
    mavlink.MAV_CMD_DO_SET_ROI: "Region of interest",
    mavlink.MAV_CMD_DO_SET_ROI_LOCATION: "Region of interest",
    mavlink.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET: "Region of interest",
    mavlink.MAV_CMD_DO_SET_ROI_NONE: "Region of interest",
    mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: "Reboot",
    mavlink.MAV_CMD_DO_FLIGHTTERMINATION: "Termination",
    mavlink.MAV_CMD_INJECT_FAILURE: "Failure injection",
    mavlink.MAV_CMD_PREFLIGHT_CALIBRATION: "Calibration",
}
# Requests for information: REQUEST_MESSAGE and its many forerunners. Ground stations send them by the dozen when they
# connect, to find out what the vehicle has, and again and again after that.
_PROBES = {
    number
    for number, entry in mavlink.enums["MAV_CMD"].items()
    if entry.name.startswith(("MAV_CMD_REQUEST_", "MAV_CMD_GET_"))
} | {mavlink.MAV_CMD_SET_MESSAGE_INTERVAL}

_ABOUT_MESSAGES = (
    mavlink.MAV_CMD_REQUEST_MESSAGE,
    mavlink.MAV_CMD_SET_MESSAGE_INTERVAL,
    mavlink.MAV_CMD_GET_MESSAGE_INTERVAL,
)


class CommandService(Service):
    """Carries commands out by asking the vehicle, or the service that knows the command."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self.delegated: set[int] = set()  # commands to all that are left to the component that knows them
        self.components: Sequence[Component] = ()  # those behind the same links; they acknowledge for themselves
        self._requests: dict[int, tuple[MessageType, RequestHandler]] = {
            _MESSAGE_INTERVAL.msg_id: (_MESSAGE_INTERVAL, self._interval_requested)
        }
        self.handlers: dict[int, CommandHandler] = {
            mavlink.MAV_CMD_COMPONENT_ARM_DISARM: self._arm_disarm,
            mavlink.MAV_CMD_NAV_TAKEOFF: self._takeoff,
            mavlink.MAV_CMD_NAV_LAND: self._land,
            mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: self._return,
            mavlink.MAV_CMD_DO_SET_MODE: self._set_mode,
            mavlink.MAV_CMD_DO_SET_HOME: self._set_home,
            mavlink.MAV_CMD_GET_HOME_POSITION: self._get_home,
            mavlink.MAV_CMD_SET_MESSAGE_INTERVAL: self._set_message_interval,
            mavlink.MAV_CMD_GET_MESSAGE_INTERVAL: self._get_message_interval,
            mavlink.MAV_CMD_REQUEST_MESSAGE: self._request_message,
            mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: self._request_capabilities,
            mavlink.MAV_CMD_RUN_PREARM_CHECKS: self._run_prearm_checks,
            mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: self._reboot,
        }

    def messages(self) -> Mapping[str, Handler]:
        return {
            "COMMAND_LONG": self.long_received,
            "COMMAND_INT": self.int_received,
            "SET_MODE": self.set_mode_received,
        }

    def add(self, handlers: Mapping[int, CommandHandler]) -> None:
        """Adds the commands of another service.

        Raises:
            ValueError: a command has a handler already.
        """
        for number, handler in handlers.items():
            if number in self.handlers:
                raise ValueError(f"command {number} has two handlers")
            self.handlers[number] = handler

    def add_requests(self, handlers: Mapping[str, RequestHandler]) -> None:
        """Adds what another service sends on request."""
        for name, handler in handlers.items():
            kind = known_type(name)
            self._requests[kind.msg_id] = (kind, handler)

    def long_received(self, sender: Sender, f: Any) -> None:
        """Carries a command out; an altitude in parameter 7 is above sea level unless the dialect knows better."""
        frame = self._endpoint.dialect.long_frames.get(f.command, 0)
        command = Command(
            f.command, frame, f.param1, f.param2, f.param3, f.param4, f.param5, f.param6, f.param7, sender
        )
        self._dispatch(command, f.target_component)

    def int_received(self, sender: Sender, f: Any) -> None:
        """Carries a command out; latitude and longitude as 1e7 integers, the altitude in the frame given."""
        is_global = f.frame in LATLON_FRAMES
        x = degrees_from_e7(f.x) if is_global else float(f.x)
        y = degrees_from_e7(f.y) if is_global else float(f.y)
        command = Command(f.command, f.frame, f.param1, f.param2, f.param3, f.param4, x, y, f.z, sender)
        self._dispatch(command, f.target_component)

    def set_mode_received(self, _: Sender, fields: Any) -> None:
        """Changes the flight mode; there is no acknowledgement, the heartbeat is the answer."""
        try:
            mode = self._endpoint.dialect.mode_from_custom(fields.custom_mode)
        except UnknownModeError as unknown:
            self._endpoint.text_once(Severity.WARNING, f"Mode: {unknown}")
            return
        reply = self._endpoint.vehicle.set_mode(mode)
        if reply.verdict != Verdict.ACCEPTED:
            self._endpoint.text(Severity.WARNING, f"Mode: {reply.reason}")

    def _dispatch(self, command: Command, target: int) -> None:
        """Hands a command to the component it names; one to all (0) to each that knows it, and each answers."""
        is_taken = False
        for component in self.components:
            if target in (0, component.compid):
                is_taken |= component.execute(command, is_addressed=target != 0)
        if target == AUTOPILOT_COMPONENT or (target == 0 and not (is_taken and self._is_foreign(command))):
            self._execute(command)

    def _is_foreign(self, command: Command) -> bool:
        """Whether the autopilot would answer a command to all that it is not supported."""
        if command.command in _ABOUT_MESSAGES:
            return whole(command.p1, -1) not in self._endpoint.telemetry.builders
        return command.command not in self.handlers or command.command in self.delegated

    def _execute(self, command: Command) -> None:
        handler = self.handlers.get(command.command)
        if handler is None:
            self._ack(command, Verdict.UNSUPPORTED)
            if command.command not in _PROBES:
                self._endpoint.text_once(Severity.NOTICE, f"{_name(command.command)} is not supported")
            return
        if any(isinf(p) for p in (command.p1, command.p2, command.p3, command.p4, command.x, command.y, command.z)):
            reply: Reply | None = denied("a parameter is infinite")
        else:
            reply = handler(command)
        if reply is None:
            return
        self._ack(command, reply.verdict)
        if reply.verdict not in (Verdict.ACCEPTED, Verdict.IN_PROGRESS):
            self._tell(command, reply)

    def _ack(self, command: Command, verdict: Verdict) -> None:
        payload = _COMMAND_ACK.pack(command.command, verdict, 0, 0, command.sender.sysid, command.sender.compid)
        self._endpoint.reply(command.sender, _COMMAND_ACK, payload)

    def _tell(self, command: Command, reply: Reply) -> None:
        """Shows the reason of a refusal; to a probe the acknowledgement says all there is to know."""
        if command.command in _PROBES and reply.verdict != Verdict.DENIED:
            return
        name = _name(command.command)
        reply = replace(reply, reason=in_clients_numbers(reply.reason, self._endpoint.dialect.first_seq))
        text = f"{name}: {reply.reason or reply.verdict.name.lower().replace('_', ' ')}"
        if command.command in _PROBES:
            self._endpoint.text_once(Severity.NOTICE, text)
        elif command.command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
            self._endpoint.text(Severity.CRITICAL, text if command.p1 else f"Disarm: {reply.reason}")
        else:
            self._endpoint.text(Severity.WARNING, text)

    # Flight

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
        return reply or self._endpoint.vehicle.takeoff(alt_amsl_m, radians(command.p4))

    def _land(self, command: Command) -> Reply:
        """Lands.

        Params: p4 heading [deg], NaN: as it is; p5, p6 place, NaN or 0, 0: here.
        Refused: TEMPORARILY_REJECTED on the ground; DENIED for a place that is not on earth.
        """
        lat_deg, lon_deg = command.x, command.y
        if lat_deg == 0.0 and lon_deg == 0.0:  # what scripts that leave them out send; landing there is never meant
            lat_deg = lon_deg = nan
        if not is_position(lat_deg, lon_deg):
            return denied("there is no such latitude and longitude")
        return self._endpoint.vehicle.land(lat_deg, lon_deg, radians(command.p4))

    def _return(self, _: Command) -> Reply:
        """Returns home, or to where RTL_TYPE says, and lands.

        Refused: TEMPORARILY_REJECTED on the ground, without a position or without home.
        """
        return self._endpoint.vehicle.set_mode(Mode.RETURN)

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
        return self._endpoint.vehicle.set_mode(mode)

    # Home

    def _set_home(self, command: Command) -> Reply:
        """Sets home.

        Params: p1 1: here; otherwise p5, p6 place and p7 altitude.
        Refused: TEMPORARILY_REJECTED without a position; DENIED for a place that is not on earth.
        """
        if command.p1 == 1.0:
            return self._endpoint.vehicle.set_home(nan, nan, nan)
        alt_amsl_m, reply = command_alt_amsl_m(self._endpoint.vehicle.state, command)
        if reply is not None:
            return reply
        if isnan(command.x) or isnan(alt_amsl_m) or not is_position(command.x, command.y):
            return denied("needs latitude, longitude and altitude, or parameter 1 = 1 for here")
        return self._endpoint.vehicle.set_home(command.x, command.y, alt_amsl_m)

    def _get_home(self, command: Command) -> Reply | None:
        """Sends HOME_POSITION.

        Refused: TEMPORARILY_REJECTED while there is no home.
        """
        return self._send_requested(command, _HOME_POSITION_ID)

    # Messages

    def _set_message_interval(self, command: Command) -> Reply:
        """Sets how often a message is sent on this link.

        Params: p1 message id; p2 interval [us], at least 20 ms; 0: the default, -1: never.
        Refused: UNSUPPORTED for a message that is not sent; DENIED for the heartbeat.
        """
        msg_id = whole(command.p1, -1)
        if msg_id not in self._endpoint.telemetry.builders:
            return Reply(Verdict.UNSUPPORTED)
        if not isfinite(command.p2):
            return denied("the interval is not a number")
        if msg_id == _HEARTBEAT_ID and command.p2 != 0.0:
            return denied("the heartbeat is fixed")
        interval_us = bounded_int(command.p2, -1, INT32_MAX)
        command.sender.channel.schedule.set_interval(msg_id, interval_us)
        return ACCEPTED

    def _get_message_interval(self, command: Command) -> Reply | None:
        """Sends MESSAGE_INTERVAL: the interval on this link, -1 for a message that is not streamed.

        Params: p1 message id.
        Refused: UNSUPPORTED for a message that is not sent.
        """
        msg_id = whole(command.p1, -1)
        interval_us = command.sender.channel.schedule.interval_us.get(msg_id)
        if interval_us is None:
            return Reply(Verdict.UNSUPPORTED)
        self._ack(command, Verdict.ACCEPTED)
        payload = _MESSAGE_INTERVAL.pack(msg_id, interval_us or -1)
        self._endpoint.reply(command.sender, _MESSAGE_INTERVAL, payload)
        return None

    def _request_message(self, command: Command) -> Reply | None:
        """Sends a message once.

        Params: p1 message id; p2 which one, where there are several (AVAILABLE_MODES: 0 all; MESSAGE_INTERVAL: of which
        message).
        Refused: UNSUPPORTED for a message there is not; TEMPORARILY_REJECTED while it has nothing to say.
        """
        msg_id = whole(command.p1, -1)
        request = self._requests.get(msg_id)
        if request is None:
            return self._send_requested(command, msg_id)
        kind, handler = request
        payloads = handler(command)
        if isinstance(payloads, Reply):
            return payloads
        self._ack(command, Verdict.ACCEPTED)
        for payload in payloads:
            self._endpoint.reply(command.sender, kind, payload)
        return None

    def _interval_requested(self, command: Command) -> Sequence[bytes] | Reply:
        """MESSAGE_INTERVAL of the message whose id is in p2."""
        msg_id = whole(command.p2, -1)
        interval_us = command.sender.channel.schedule.interval_us.get(msg_id)
        if interval_us is None:
            return Reply(Verdict.UNSUPPORTED)
        return [_MESSAGE_INTERVAL.pack(msg_id, interval_us or -1)]

    def _request_capabilities(self, command: Command) -> Reply | None:
        """Sends AUTOPILOT_VERSION."""
        return self._send_requested(command, _AUTOPILOT_VERSION_ID)

    def _send_requested(self, command: Command, msg_id: int) -> Reply | None:
        """Acknowledges, then sends the message: clients wait for both, in this order."""
        telemetry = self._endpoint.telemetry
        build = telemetry.builders.get(msg_id)
        if build is None:
            return Reply(Verdict.UNSUPPORTED)
        payload = build(self._endpoint.vehicle.state)
        if payload is None:
            return Reply(Verdict.TEMPORARILY_REJECTED)
        self._ack(command, Verdict.ACCEPTED)
        self._endpoint.reply(command.sender, telemetry.types[msg_id], payload)
        if msg_id in self._endpoint.on_request:
            self._endpoint.on_request[msg_id](command.sender)
        return None

    # The rest

    def _run_prearm_checks(self, _: Command) -> Reply:
        """Checks whether the vehicle may be armed, and names each reason against it in a text.

        Refused: TEMPORARILY_REJECTED while armed.
        """
        vehicle = self._endpoint.vehicle
        if vehicle.state.is_armed:
            return Reply(Verdict.TEMPORARILY_REJECTED, "the vehicle is armed")
        for reason in vehicle.check_arming():
            self._endpoint.text(Severity.CRITICAL, f"PreArm: {reason}")
        return ACCEPTED

    def _reboot(self, command: Command) -> Reply:
        """Restarts the flight controller.

        Params: p1 1: restart.
        Refused: TEMPORARILY_REJECTED while armed; UNSUPPORTED for anything else than a restart.
        """
        if command.p1 != REBOOT:
            return Reply(Verdict.UNSUPPORTED, "only a reboot of the autopilot is supported")
        return self._endpoint.vehicle.reboot()


def _name(command_id: int) -> str:
    """What a command is called in texts."""
    if command_id in _SHORT_NAMES:
        return _SHORT_NAMES[command_id]
    entry = mavlink.enums["MAV_CMD"].get(command_id)
    return entry.name.removeprefix("MAV_CMD_") if entry else f"Command {command_id}"
