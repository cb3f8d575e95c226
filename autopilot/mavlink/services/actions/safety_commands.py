"""Commands for when things go wrong, or shall: the end of a flight, and failures on request."""

from collections.abc import Mapping

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.failure_requests import Failure, Unit, failure_request, injection_refusal
from autopilot.interface.vehicle_state import ACCEPTED, Reply, Verdict
from autopilot.mavlink.channel import Endpoint
from autopilot.mavlink.service import Command, CommandHandler, Service, denied
from autopilot.mavlink.wire.convert import whole


class SafetyService(Service):
    """Carries out DO_FLIGHTTERMINATION and INJECT_FAILURE."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self._is_mute_due = False

    def commands(self) -> Mapping[int, CommandHandler]:
        return {
            mavlink.MAV_CMD_DO_FLIGHTTERMINATION: self._terminate,
            mavlink.MAV_CMD_INJECT_FAILURE: self._inject_failure,
        }

    def _terminate(self, command: Command) -> Reply:
        """Stops the motors in the air, for good; the vehicle is disarmed once it lies on the ground. Ends motor tests.

        Params: p1 above 0.5 terminates (1 as in PX4).
        Refused: DENIED: p1 up to 0.5 or NaN, a termination cannot be taken back; TEMPORARILY_REJECTED: not armed.
        """
        if not command.p1 > 0.5:
            return denied("parameter 1 must be 1; a termination cannot be taken back")
        return self._endpoint.vehicle.terminate()

    def _inject_failure(self, command: Command) -> Reply:
        """Breaks or repairs a sensor, the battery, a motor or the MAVLink signal, if SYS_FAILURE_EN is 1.

        Params: p1 FAILURE_UNIT; p2 FAILURE_TYPE, 0 repairs; p3 instance from 1, 0 or NaN: all.
        Refused: DENIED: SYS_FAILURE_EN is 0, the vehicle is not armed (repairs are always taken), or there is no such
        unit, type or instance; UNSUPPORTED: this unit cannot fail like that here.
        """
        unit, failure, instance = whole(command.p1, -1), whole(command.p2, -1), whole(command.p3, 0)
        if unit in (Unit.MAVLINK_SIGNAL, Unit.RC_SIGNAL):
            return self._inject_link(command, Unit(unit), failure)
        return self._endpoint.vehicle.inject_failure(unit, failure, instance)

    def _inject_link(self, command: Command, unit: Unit, failure: int) -> Reply:
        """Cuts the sticks or all links off, or gives them back.

        On a cut link nothing goes out; what comes in is still heard, but keeps no link alive.
        """
        vehicle = self._endpoint.vehicle
        request = failure_request(unit, failure)
        if request is None:
            return denied(f"there is no failure {failure}")
        reply = injection_refusal(vehicle.params, vehicle.state, request[1])
        if reply is not None:
            return reply
        if request[1] not in (Failure.OK, Failure.OFF):
            return Reply(Verdict.UNSUPPORTED, "a signal can be off or on")
        is_off = request[1] is Failure.OFF
        if unit is Unit.RC_SIGNAL:
            vehicle.sticks.is_cut = is_off
            return ACCEPTED
        for channel in self._endpoint.channels:
            channel.is_mute = is_off and channel is not command.sender.channel  # that one after the acknowledgement
        self._is_mute_due = is_off
        return ACCEPTED

    def frame(self) -> None:
        """Mutes the link of the client that asked for it, once its acknowledgement is out."""
        if self._is_mute_due:
            self._is_mute_due = False
            for channel in self._endpoint.channels:
                channel.is_mute = True
