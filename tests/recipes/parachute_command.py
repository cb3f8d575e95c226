"""A MAVLink command that the vehicle does not have, as CONTRIBUTING.md tells to add it: DO_PARACHUTE."""

from collections.abc import Mapping

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.vehicle_state import ACCEPTED, Reply, Verdict
from autopilot.mavlink.channel import Endpoint
from autopilot.mavlink.service import Command, CommandHandler, Service, denied
from autopilot.mavlink.wire.convert import whole


class ParachuteService(Service):
    """Carries out DO_PARACHUTE."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self._is_enabled = False

    def commands(self) -> Mapping[int, CommandHandler]:
        return {mavlink.MAV_CMD_DO_PARACHUTE: self._parachute}

    def _parachute(self, command: Command) -> Reply:
        """Makes the parachute ready or safe, or releases it, which stops the motors.

        Params: p1 0 safe, 1 ready, 2 release.
        Refused: DENIED: another p1. TEMPORARILY_REJECTED: released while it is safe.
        """
        action = whole(command.p1, -1)
        if action not in (0, 1, 2):
            return denied("parameter 1 must be 0, 1 or 2")
        if action < 2:
            self._is_enabled = action == 1
            return ACCEPTED
        if not self._is_enabled:
            return Reply(Verdict.TEMPORARILY_REJECTED, "the parachute is safe")
        return self._endpoint.vehicle.terminate()
