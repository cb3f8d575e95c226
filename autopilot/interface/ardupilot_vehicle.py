"""Which of ArduPilot's vehicles a class of vehicles is to ArduPilot's clients, and the names that they look for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

INT8, INT16, INT32, REAL32 = 2, 4, 6, 9  # MAV_PARAM_TYPE
CM = 100.0  # per metre


@dataclass(frozen=True, slots=True)
class Alias:
    """A parameter of ours under the name and in the unit of another autopilot."""

    name: str
    of: str  # our name
    param_type: int  # MAV_PARAM_TYPE
    scale: float = 1.0  # our unit to theirs
    numbers: Mapping[int, int] | None = None  # where the meaning is a number: ours to theirs

    def shown(self, value: float) -> float:
        """Our value as clients see it; a number of ours that they do not have becomes their lowest."""
        if self.numbers is not None:
            return self.numbers.get(round(value), min(self.numbers.values()))
        return value * self.scale

    def ours(self, shown: float) -> float | None:
        """A client's value as we keep it; None: there is nothing of ours that means this."""
        if self.numbers is None:
            return shown / self.scale
        return next((ours for ours, theirs in self.numbers.items() if theirs == shown), None)


@dataclass(frozen=True, slots=True)
class Constant:
    """A name that clients look for and that has no meaning here: it can be read, and setting it changes nothing."""

    name: str
    value: int | float
    param_type: int  # MAV_PARAM_TYPE
    meaning: str


@dataclass(frozen=True, slots=True)
class ArduPilotVehicle:
    """One of ArduPilot's vehicles."""

    name: str
    """As ArduPilot's releases have it: Copter, Rover; MAVLink names its modes in the enumeration of that name."""
    version: tuple[int, int, int]
    """Of ArduPilot's release that clients shall take it for."""
    switch_prefix: str = "FLTMODE"
    """Of the parameters that name the modes of a switch."""
    aliases: Sequence[Alias] = ()
    """Its parameters under ArduPilot's names, besides those of all vehicles."""
    constants: Sequence[Constant] = ()
