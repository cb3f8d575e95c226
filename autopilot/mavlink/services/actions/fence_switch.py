"""The fence over MAVLink: its switch. Its shapes come by the mission protocol, its state goes out as FENCE_STATUS."""

from collections.abc import Mapping
from math import isfinite

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.vehicle_state import FenceLimit, Reply
from autopilot.mavlink.channel import Endpoint
from autopilot.mavlink.service import Command, CommandHandler, Service, denied

_ALL = sum(FenceLimit)


class FenceService(Service):
    """Carries out DO_FENCE_ENABLE."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint

    def commands(self) -> Mapping[int, CommandHandler]:
        return {mavlink.MAV_CMD_DO_FENCE_ENABLE: self._enable}

    def _enable(self, command: Command) -> Reply:
        """Switches the fence on or off, until the next boot; what is not set up stays without effect.

        Params: p1 0 off, 1 on, 2 floor off; p2 which limits, as bits: 1 ceiling, 2 radius around home, 4 uploaded
        shapes, 8 floor; 0 or NaN: all.
        Refused: DENIED: another p1, or unknown bits in p2.
        """
        limits = int(command.p2) if isfinite(command.p2) and command.p2 > 0.0 else _ALL
        if limits & ~_ALL:
            return denied(f"parameter 2 must be a sum of 1, 2, 4 and 8, not {command.p2:g}")
        fence = self._endpoint.vehicle.fence
        if command.p1 == 0.0:
            return fence.disable(limits)
        if command.p1 == 1.0:
            return fence.enable(limits)
        if command.p1 == 2.0:
            return fence.disable(FenceLimit.FLOOR)
        return denied("parameter 1 must be 0, 1 or 2")
