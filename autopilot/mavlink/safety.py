"""Commands for when things go wrong: the end of a flight."""

from collections.abc import Mapping

from pymavlink.dialects.v20 import all as mavlink

from autopilot.mavlink.channel import Endpoint
from autopilot.mavlink.service import Command, CommandHandler, Service, denied
from autopilot.vehicle import Reply


class SafetyService(Service):
    """Carries out DO_FLIGHTTERMINATION."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint

    def commands(self) -> Mapping[int, CommandHandler]:
        return {mavlink.MAV_CMD_DO_FLIGHTTERMINATION: self._terminate}

    def _terminate(self, command: Command) -> Reply:
        """Stops the motors in the air, for good; the vehicle is disarmed once it lies on the ground.

        Params: p1 above 0.5 terminates (1 as in PX4).
        Refused: DENIED: p1 up to 0.5 or NaN, a termination cannot be taken back; TEMPORARILY_REJECTED: not armed.
        """
        if not command.p1 > 0.5:
            return denied("parameter 1 must be 1; a termination cannot be taken back")
        return self._endpoint.vehicle.terminate()
