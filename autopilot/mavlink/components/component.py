"""A second device of ours behind the same links: a camera or a gimbal with an id and a heartbeat of its own.

In: commands and messages addressed to it or to all, handed over by the server. Out: answers, its heartbeat at 1 Hz,
and the messages clients have asked to be sent at intervals. It works when something is due, not in every frame.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import isfinite

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.vehicle_state import ACCEPTED, Reply, Severity, Verdict
from autopilot.mavlink.channel import Channel, Endpoint, Sender
from autopilot.mavlink.service import (
    COMMAND_ACK,
    Command,
    CommandHandler,
    Handler,
    acknowledgement,
    denied,
    out_of_range,
)
from autopilot.mavlink.wire.codec import MessageType, known_type, message_type
from autopilot.mavlink.wire.convert import INT32_MAX, bounded_int, whole
from common.kernels import FRAME_US

NEVER_US = 1 << 62
_PROBES = frozenset(
    number for number, entry in mavlink.enums["MAV_CMD"].items() if entry.name.startswith("MAV_CMD_REQUEST_")
)  # asked by the dozen when a ground station connects: a refusal needs no text

_HEARTBEAT = known_type("HEARTBEAT")
_MESSAGE_INTERVAL = known_type("MESSAGE_INTERVAL")

Payload = Callable[[], bytes | None]


@dataclass(slots=True)
class _Interval:
    channel: Channel
    msg_id: int
    interval_us: int
    due_us: int


class Component:
    """One component besides the autopilot.

    Args:
        endpoint: the vehicle's links.
        compid: MAV_COMPONENT.
        mav_type: MAV_TYPE of its heartbeat.
        title: what it is called in texts.
    """

    def __init__(self, endpoint: Endpoint, compid: int, mav_type: int, title: str) -> None:
        self.endpoint = endpoint
        self.compid = compid
        self.title = title
        self._intervals: list[_Interval] = []
        self._due_us = 0
        self._heartbeat = _HEARTBEAT.pack(mav_type, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, mavlink.MAV_STATE_ACTIVE, 3)
        self._payloads = {known_type(name).msg_id: payload for name, payload in self.payloads().items()}
        self.handlers: dict[int, Handler] = {
            known_type(name).msg_id: handler for name, handler in self.messages().items()
        }
        self.known: dict[int, CommandHandler] = {  # by MAV_CMD
            mavlink.MAV_CMD_REQUEST_MESSAGE: self._request_message,
            mavlink.MAV_CMD_SET_MESSAGE_INTERVAL: self._set_message_interval,
            mavlink.MAV_CMD_GET_MESSAGE_INTERVAL: self._get_message_interval,
            **self.commands(),
        }

    # What a component says of itself

    def messages(self) -> Mapping[str, Handler]:
        """Handlers of messages, by name."""
        return {}

    def commands(self) -> Mapping[int, CommandHandler]:
        """Handlers of commands, by MAV_CMD."""
        return {}

    def payloads(self) -> Mapping[str, Payload]:
        """The messages it can be asked for, by name."""
        return {}

    def default_interval_us(self, _: int) -> int:
        """How often a message is sent to who asks for its default interval; 0: not at all."""
        return 0

    def work(self) -> int:
        """Does what is due, and returns when it wants to be called next [us]; not called before `wake`."""
        return NEVER_US

    # Sending

    def reply(self, sender: Sender, kind: MessageType, payload: bytes) -> None:
        self.endpoint.reply(sender, kind, payload, self.compid)

    def broadcast(self, kind: MessageType, payload: bytes) -> None:
        self.endpoint.broadcast(kind, payload, self.compid)

    def ack(self, command: Command, verdict: Verdict) -> None:
        self.reply(command.sender, COMMAND_ACK, acknowledgement(command, verdict))

    # Being asked

    def execute(self, command: Command, *, is_addressed: bool) -> bool:
        """Carries out a command and acknowledges it; returns whether it is one of ours.

        Args:
            command: what is asked.
            is_addressed: it names this component; one to all is left to others where we do not know it.
        """
        handler = self.known.get(command.command)
        if not is_addressed and (handler is None or not self._concerns(command)):
            return False
        reply: Reply | None
        if handler is None:
            reply = Reply(Verdict.UNSUPPORTED, f"command {command.command} is not supported")
        else:
            reply = out_of_range(command) or handler(command)
        if reply is not None:
            self.ack(command, reply.verdict)
            is_refusal = reply.verdict not in (Verdict.ACCEPTED, Verdict.IN_PROGRESS)
            if is_refusal and reply.reason and command.command not in _PROBES:
                self.endpoint.text_once(Severity.NOTICE, f"{self.title}: {reply.reason}")
        return True

    def _concerns(self, command: Command) -> bool:
        """Whether a request to all for a message is for one that we have."""
        if command.command in (
            mavlink.MAV_CMD_REQUEST_MESSAGE,
            mavlink.MAV_CMD_SET_MESSAGE_INTERVAL,
            mavlink.MAV_CMD_GET_MESSAGE_INTERVAL,
        ):
            return whole(command.p1, -1) in self._payloads
        return True

    def send_requested(self, command: Command, name: str) -> Reply | None:
        """Acknowledges, then sends the message: clients wait for both, in this order."""
        return self._send(command, known_type(name).msg_id)

    def _send(self, command: Command, msg_id: int) -> Reply | None:
        kind, build = message_type(msg_id), self._payloads.get(msg_id)
        if build is None or kind is None:
            return Reply(Verdict.UNSUPPORTED)
        payload = build()
        if payload is None:
            return Reply(Verdict.TEMPORARILY_REJECTED)
        self.ack(command, Verdict.ACCEPTED)
        self.reply(command.sender, kind, payload)
        return None

    def _request_message(self, command: Command) -> Reply | None:
        """Sends one message of this component.

        Params: p1 message id.
        Refused: UNSUPPORTED: the component has no such message.
        """
        return self._send(command, whole(command.p1, -1))

    def _set_message_interval(self, command: Command) -> Reply | None:
        """Sends a message of this component at an interval to the channel that asks.

        Params: p1 message id; p2 interval [us], 0 default, -1 never.
        Refused: UNSUPPORTED: the component has no such message; DENIED: the interval is not a number or below 20 ms.
        """
        msg_id = whole(command.p1, -1)
        if msg_id not in self._payloads:
            return Reply(Verdict.UNSUPPORTED)
        if not isfinite(command.p2):
            return denied("the interval is not a number")
        interval_us = bounded_int(command.p2, -1, INT32_MAX)
        if 0 < interval_us < FRAME_US:
            return denied("at most 50 Hz")
        self.set_interval(command.sender.channel, msg_id, interval_us or self.default_interval_us(msg_id))
        return ACCEPTED

    def set_interval(self, channel: Channel, msg_id: int, interval_us: int) -> None:
        """Sends a message at an interval on one channel; 0 or less: never."""
        self._intervals = [item for item in self._intervals if not (item.channel is channel and item.msg_id == msg_id)]
        if interval_us > 0:
            item = _Interval(channel, msg_id, max(interval_us, FRAME_US), self.endpoint.time_us)
            self._intervals.append(item)
        self.wake()

    def interval_us(self, channel: Channel, msg_id: int) -> int:
        """The interval of a message on one channel; -1: not sent."""
        for item in self._intervals:
            if item.channel is channel and item.msg_id == msg_id:
                return item.interval_us
        return -1

    def _get_message_interval(self, command: Command) -> Reply | None:
        """Answers with MESSAGE_INTERVAL.

        Params: p1 message id.
        Refused: UNSUPPORTED: the component has no such message.
        """
        msg_id = whole(command.p1, -1)
        if msg_id not in self._payloads:
            return Reply(Verdict.UNSUPPORTED)
        self.ack(command, Verdict.ACCEPTED)
        payload = _MESSAGE_INTERVAL.pack(msg_id, self.interval_us(command.sender.channel, msg_id))
        self.reply(command.sender, _MESSAGE_INTERVAL, payload)
        return None

    # Time

    def send_heartbeat(self) -> None:
        """The server says when."""
        self.broadcast(_HEARTBEAT, self._heartbeat)

    def wake(self) -> None:
        """Something has changed: look in the next frame what is due."""
        self._due_us = 0

    def frame(self) -> None:
        """Messages at intervals, and the component's own work, when due."""
        now_us = self.endpoint.time_us
        if now_us < self._due_us:
            return
        due_us = self.work()
        if self._intervals:
            self._intervals = [item for item in self._intervals if item.channel.is_open]  # clients come and go
        for item in self._intervals:
            if now_us >= item.due_us:
                item.due_us = max(item.due_us + item.interval_us, now_us + FRAME_US)
                self._send_at_interval(item)
            due_us = min(due_us, item.due_us)
        self._due_us = due_us

    def _send_at_interval(self, item: _Interval) -> None:
        kind, payload = message_type(item.msg_id), self._payloads[item.msg_id]()
        if kind is not None and payload is not None:
            self.reply(Sender(item.channel, 0, 0), kind, payload)
