"""The winch as a component of its own: its heartbeat, DO_WINCH, WINCH_STATUS."""

from collections.abc import Mapping

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.vehicle_state import Reply
from autopilot.mavlink.channel import Endpoint
from autopilot.mavlink.components.component import Component, Payload
from autopilot.mavlink.service import Command, CommandHandler
from autopilot.mavlink.telemetry.status import winch_status
from autopilot.mavlink.wire.codec import known_type

_WINCH_STATUS = known_type("WINCH_STATUS")
STATUS_US = 1_000_000


class WinchComponent(Component):
    """Component 169; made only where there is a winch."""

    def __init__(self, endpoint: Endpoint) -> None:
        super().__init__(endpoint, mavlink.MAV_COMP_ID_WINCH, mavlink.MAV_TYPE_WINCH, "Winch")
        self._next_us = 0

    def commands(self) -> Mapping[int, CommandHandler]:
        return {mavlink.MAV_CMD_DO_WINCH: self._winch}

    def payloads(self) -> Mapping[str, Payload]:
        return {"WINCH_STATUS": self._status}

    def work(self) -> int:
        """Tells everybody once a second."""
        if self.endpoint.time_us >= self._next_us:
            self._next_us = self.endpoint.time_us + STATUS_US
            payload = self._status()
            if payload is not None:
                self.broadcast(_WINCH_STATUS, payload)
        return self._next_us

    def _status(self) -> bytes | None:
        """Line out, speed, tension and state of the winch."""
        return winch_status(self.endpoint.vehicle.state)

    def _winch(self, command: Command) -> Reply:
        """Moves the line of the winch; WINCH_STATUS tells how it goes on.

        Params: p1 winch, 0 or 1; p2 WINCH_ACTIONS; p3 line to let out [m]; p4 rate [m/s], positive lets line out.
        Refused: DENIED for a length, rate or action out of range; FAILED without a line.
        """
        params = (command.p1, command.p2, command.p3, command.p4)
        return self.endpoint.vehicle.payload.run(command.command, params, command.x, command.y, command.z)
