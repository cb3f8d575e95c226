"""What the elements of `Actuators.command` are, as a class of vehicles has them."""

from dataclasses import dataclass
from enum import Enum


class OutputKind(Enum):
    """What a command turns."""

    MOTOR = "motor"
    SERVO = "servo"


@dataclass(frozen=True, slots=True)
class Output:
    """One element of `Actuators.command`."""

    name: str
    kind: OutputKind
    is_signed: bool = False  # [-1..1] rather than [0..1]
