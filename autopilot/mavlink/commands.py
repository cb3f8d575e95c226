"""The command protocol: COMMAND_LONG and COMMAND_INT in, one COMMAND_ACK out, and a text with the reason of a refusal.

A table maps each command to its handler; a command that is not in it is answered UNSUPPORTED at once. Requests for
information are refused without a text: asking is how clients find out what there is. In a command NaN means default and
0 is a value.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.vehicle_state import Reply, Severity, Verdict
from autopilot.mavlink.channel import AUTOPILOT_COMPONENT, Endpoint, Sender
from autopilot.mavlink.components.component import Component
from autopilot.mavlink.service import (
    COMMAND_ACK,
    Command,
    CommandHandler,
    Handler,
    Service,
    acknowledgement,
    out_of_range,
)
from autopilot.mavlink.wire.convert import (
    LATLON_FRAMES,
    RELATIVE_FRAMES,
    degrees_from_e7,
    whole,
)

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
    """Hands each command to who knows it: a component, or a service of the autopilot."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self.delegated: set[int] = set()  # commands to all that are left to the component that knows them
        self.components: Sequence[Component] = ()  # those behind the same links; they acknowledge for themselves
        self.handlers: dict[int, CommandHandler] = {}

    def messages(self) -> Mapping[str, Handler]:
        return {
            "COMMAND_LONG": self.long_received,
            "COMMAND_INT": self.int_received,
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
        is_amsl = f.command in self._endpoint.dialect.amsl_commands and f.frame in RELATIVE_FRAMES
        frame = mavlink.MAV_FRAME_GLOBAL if is_amsl else f.frame
        command = Command(f.command, frame, f.param1, f.param2, f.param3, f.param4, x, y, f.z, sender)
        self._dispatch(command, f.target_component)

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
        reply = out_of_range(command) or handler(command)
        if reply is None:
            return
        self._ack(command, reply.verdict)
        if reply.verdict not in (Verdict.ACCEPTED, Verdict.IN_PROGRESS):
            self._tell(command, reply)

    def _ack(self, command: Command, verdict: Verdict) -> None:
        self._endpoint.reply(command.sender, COMMAND_ACK, acknowledgement(command, verdict))

    def _tell(self, command: Command, reply: Reply) -> None:
        """Shows the reason of a refusal; to a probe the acknowledgement says all there is to know."""
        if command.command in _PROBES and reply.verdict != Verdict.DENIED:
            return
        name = _name(command.command)
        text = f"{name}: {reply.reason or reply.verdict.name.lower().replace('_', ' ')}"
        if command.command in _PROBES:
            self._endpoint.text_once(Severity.NOTICE, text)
        elif command.command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
            self._endpoint.text(Severity.CRITICAL, text if command.p1 else f"Disarm: {reply.reason}")
        else:
            self._endpoint.text(Severity.WARNING, text)


def _name(command_id: int) -> str:
    """What a command is called in texts."""
    if command_id in _SHORT_NAMES:
        return _SHORT_NAMES[command_id]
    entry = mavlink.enums["MAV_CMD"].get(command_id)
    return entry.name.removeprefix("MAV_CMD_") if entry else f"Command {command_id}"
