"""Which of ArduPilot's vehicles a class of vehicles is to ArduPilot's clients."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ArduPilotVehicle:
    """One of ArduPilot's vehicles."""

    name: str
    """As ArduPilot's releases have it: Copter, Rover; MAVLink names its modes in the enumeration of that name."""
    version: tuple[int, int, int]
    """Of ArduPilot's release that clients shall take it for."""
