"""Messages on request: once, or at an interval of the client's own.

Whatever is streamed may be asked for; other services add messages that answer a request's own parameters.
"""

from collections.abc import Mapping, Sequence
from math import isfinite

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.vehicle_state import ACCEPTED, Reply, Verdict
from autopilot.mavlink.channel import Endpoint
from autopilot.mavlink.service import (
    COMMAND_ACK,
    Command,
    CommandHandler,
    RequestHandler,
    Service,
    acknowledgement,
    denied,
)
from autopilot.mavlink.wire.codec import MessageType, known_type
from autopilot.mavlink.wire.convert import INT32_MAX, bounded_int, whole

_MESSAGE_INTERVAL = known_type("MESSAGE_INTERVAL")
_HEARTBEAT_ID = known_type("HEARTBEAT").msg_id
_HOME_POSITION_ID = known_type("HOME_POSITION").msg_id
_AUTOPILOT_VERSION_ID = known_type("AUTOPILOT_VERSION").msg_id


class MessageRequests(Service):
    """Sends what is asked for, behind the acknowledgement."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self._requests: dict[int, tuple[MessageType, RequestHandler]] = {}

    def commands(self) -> Mapping[int, CommandHandler]:
        return {
            mavlink.MAV_CMD_GET_HOME_POSITION: self._get_home,
            mavlink.MAV_CMD_SET_MESSAGE_INTERVAL: self._set_message_interval,
            mavlink.MAV_CMD_GET_MESSAGE_INTERVAL: self._get_message_interval,
            mavlink.MAV_CMD_REQUEST_MESSAGE: self._request_message,
            mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: self._request_capabilities,
        }

    def requests(self) -> Mapping[str, RequestHandler]:
        return {"MESSAGE_INTERVAL": self._interval_requested}

    def add(self, handlers: Mapping[str, RequestHandler]) -> None:
        """Adds what a service sends on request."""
        for name, handler in handlers.items():
            kind = known_type(name)
            self._requests[kind.msg_id] = (kind, handler)

    def _get_home(self, command: Command) -> Reply | None:
        """Sends HOME_POSITION.

        Refused: TEMPORARILY_REJECTED while there is no home.
        """
        return self._send_requested(command, _HOME_POSITION_ID)

    def _set_message_interval(self, command: Command) -> Reply:
        """Sets how often a message is sent on this link.

        Params: p1 message id; p2 interval [us], 0: the default, -1: never. At least 20 ms; 4 ms for attitude, position,
        IMU and motors.
        Refused: UNSUPPORTED for a message that is not sent; DENIED for the heartbeat, and for a shorter interval.
        """
        msg_id = whole(command.p1, -1)
        if msg_id not in self._endpoint.telemetry.builders:
            return Reply(Verdict.UNSUPPORTED)
        if not isfinite(command.p2):
            return denied("the interval is not a number")
        if msg_id == _HEARTBEAT_ID and command.p2 != 0.0:
            return denied("the heartbeat is fixed")
        interval_us = bounded_int(command.p2, -1, INT32_MAX)
        schedule = command.sender.channel.schedule
        refusal = schedule.refusal(msg_id, interval_us)
        if refusal:
            return denied(refusal)
        schedule.set_interval(msg_id, interval_us)
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
        self._accept(command)
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
        self._accept(command)
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
        self._accept(command)
        self._endpoint.reply(command.sender, telemetry.types[msg_id], payload)
        if msg_id in self._endpoint.on_request:
            self._endpoint.on_request[msg_id](command.sender)
        return None

    def _accept(self, command: Command) -> None:
        self._endpoint.reply(command.sender, COMMAND_ACK, acknowledgement(command, Verdict.ACCEPTED))
