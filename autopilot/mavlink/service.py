"""What every MAVLink service is: the messages and the commands it answers, and its fraction of the frame."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from autopilot.interface.vehicle_state import Reply, Verdict
from autopilot.mavlink.channel import Sender
from autopilot.mavlink.wire.codec import known_type
from autopilot.mavlink.wire.number_bounds import PARAMETER_MAX, first_outside

COMMAND_ACK = known_type("COMMAND_ACK")

Handler = Callable[[Sender, Any], None]


@dataclass(slots=True)
class Command:
    """A command in either form; `x` and `y` are degrees in global frames."""

    command: int
    frame: int  # MAV_FRAME
    p1: float
    p2: float
    p3: float
    p4: float
    x: float  # param5
    y: float  # param6
    z: float  # param7
    sender: Sender


CommandHandler = Callable[[Command], Reply | None]
"""Returns the acknowledgement; None: it has been sent already, or will be."""

RequestHandler = Callable[[Command], Sequence[bytes] | Reply]
"""Answers REQUEST_MESSAGE for a message with parameters of its own: the payloads to send, or a refusal."""


class Service:
    """A part of the MAVLink server; what it does not override it does not do."""

    def messages(self) -> Mapping[str, Handler]:
        """Handlers of messages, by name."""
        return {}

    def commands(self) -> Mapping[int, CommandHandler]:
        """Handlers of COMMAND_LONG and COMMAND_INT, by MAV_CMD."""
        return {}

    def requests(self) -> Mapping[str, RequestHandler]:
        """Messages that are sent on request only, in answer to the request's own parameters, by name."""
        return {}

    def frame(self) -> None:
        """Called once per frame, after the messages that have come in; not at all if it is not overridden."""


def acknowledgement(command: Command, verdict: Verdict) -> bytes:
    """The payload of COMMAND_ACK."""
    return COMMAND_ACK.pack(command.command, verdict, 0, 0, command.sender.sysid, command.sender.compid)


def denied(reason: str) -> Reply:
    return Reply(Verdict.DENIED, reason)


def out_of_range(command: Command) -> Reply | None:
    """The refusal of a command with a parameter that no command can mean."""
    params = (command.p1, command.p2, command.p3, command.p4, command.x, command.y, command.z)
    i = first_outside(PARAMETER_MAX, params)
    return None if i is None else denied(f"parameter {i + 1} is out of range")
