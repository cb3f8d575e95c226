"""Places, heights and headings a client sends the vehicle to: DO_REPOSITION, guided mission items.

In: commands and items. Out: a position to hold, in mode Hold or Guided as the dialect has it. Guided items are
ArduPilot's and known in its dialect only.
"""

from collections.abc import Mapping
from math import nan
from typing import Any

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.client_requests import GoTo
from autopilot.interface.vehicle_state import Mode, Reply, Severity, Verdict
from autopilot.mavlink.channel import Endpoint, Sender
from autopilot.mavlink.service import Command, CommandHandler, Service, denied
from autopilot.mavlink.wire.altitude_frames import command_alt_amsl_m
from autopilot.mavlink.wire.convert import is_position, whole
from autopilot.mavlink.wire.item_messages import item_from_fields
from autopilot.mavlink.wire.number_bounds import PARAMETER_MAX, is_within

GUIDED_GOTO, GUIDED_ALTITUDE = 2, 3  # MISSION_ITEM.current of an item that is no part of a mission
_RESULTS = {Verdict.ACCEPTED: mavlink.MAV_MISSION_ACCEPTED, Verdict.UNSUPPORTED: mavlink.MAV_MISSION_UNSUPPORTED}


class GotoService(Service):
    """Sends the vehicle to places."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self._is_guided = endpoint.dialect.goto_mode is Mode.GUIDED

    def commands(self) -> Mapping[int, CommandHandler]:
        return {mavlink.MAV_CMD_DO_REPOSITION: self._reposition}

    def _reposition(self, command: Command) -> Reply:
        """Goes to a position, height or heading and holds there.

        Params: p1 ground speed [m/s], -1: as it is; p2 bit 1 allows the change of mode; p4 heading [rad], NaN: towards
        the position; p5, p6 place, NaN: where it is; p7 altitude, NaN: as it is. All NaN: stops here.
        Refused: TEMPORARILY_REJECTED on the ground or without a position; DENIED for a position that is out of reach or
        below the ground, or if the mode may not be changed.
        """
        state = self._endpoint.vehicle.state
        goto_mode = self._endpoint.dialect.goto_mode
        may_change_mode = whole(command.p2, 0) & mavlink.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE
        if not may_change_mode and state.mode != goto_mode:
            return denied(f"needs mode {goto_mode.name.capitalize()}, or the flag that changes to it")
        if not is_position(command.x, command.y):
            return denied("there is no such latitude and longitude")
        alt_amsl_m, reply = command_alt_amsl_m(state, command)
        speed_m_s = command.p1 if command.p1 > 0.0 else nan
        target = GoTo(command.x, command.y, alt_amsl_m, command.p4, speed_m_s, mode=goto_mode)
        return reply or self._endpoint.vehicle.request(target)

    def takes_item(self, fields: Any) -> bool:
        """Whether a MISSION_ITEM is an order of its own rather than a part of an upload."""
        return self._is_guided and fields.current in (GUIDED_GOTO, GUIDED_ALTITUDE)

    def item_received(self, sender: Sender, fields: Any) -> int:
        """Goes to the position or the height of an item; returns the MAV_MISSION_RESULT."""
        item = item_from_fields(fields)
        vehicle = self._endpoint.vehicle
        position = Command(item.command, item.frame, 0.0, 0.0, 0.0, nan, item.x, item.y, item.z, sender)
        alt_amsl_m, reply = command_alt_amsl_m(vehicle.state, position)
        if vehicle.state.mode is not Mode.GUIDED:
            reply = Reply(Verdict.TEMPORARILY_REJECTED, "needs mode Guided")
        elif item.command != mavlink.MAV_CMD_NAV_WAYPOINT:
            reply = Reply(Verdict.UNSUPPORTED, "only a waypoint can be a guided item")
        elif not is_within(PARAMETER_MAX, item.x, item.y, item.z) or not is_position(item.x, item.y):
            reply = denied("there is no such place")
        elif reply is None and fields.current == GUIDED_ALTITUDE:
            reply = vehicle.request(GoTo(alt_amsl_m=alt_amsl_m, mode=Mode.GUIDED))
        elif reply is None:
            reply = vehicle.request(GoTo(item.x, item.y, alt_amsl_m, mode=Mode.GUIDED))
        if reply.verdict is not Verdict.ACCEPTED:
            self._endpoint.text_once(Severity.WARNING, f"Goto: {reply.reason}")
        return int(_RESULTS.get(reply.verdict, mavlink.MAV_MISSION_DENIED))
