"""What differs between the autopilots that ground stations know; everything else is shared."""

from typing import Protocol

from autopilot.vehicle import Mode
from common.params import Parameter


class UnknownModeError(Exception):
    """A mode this vehicle does not have; the text is the reason shown to the pilot."""


class Dialect(Protocol):
    """One autopilot's numbers."""

    name: str
    autopilot: int  # MAV_AUTOPILOT
    vehicle_type: int  # MAV_TYPE
    capabilities: int  # MAV_PROTOCOL_CAPABILITY bits that only this dialect sets
    flight_sw_version: int  # of the autopilot this dialect is compatible with

    def custom_mode(self, mode: Mode) -> int:
        """HEARTBEAT.custom_mode of a mode."""
        ...

    def mode_from_custom(self, custom_mode: int) -> Mode:
        """The mode a SET_MODE message asks for.

        Raises:
            UnknownModeError: the vehicle has no such mode.
        """
        ...

    def mode_from_command(self, main_mode: int, sub_mode: int) -> Mode:
        """The mode that parameters 2 and 3 of DO_SET_MODE ask for.

        Raises:
            UnknownModeError: the vehicle has no such mode.
        """
        ...

    def custom_version(self, text: str) -> bytes:
        """The 8 bytes of AUTOPILOT_VERSION.flight_custom_version for 8 characters."""
        ...

    def parameter_type(self, declaration: Parameter) -> int:
        """MAV_PARAM_TYPE of a parameter."""
        ...

    def parameter_bits(self, declaration: Parameter, value: float) -> int:
        """The value field of PARAM_VALUE, as its 32 bits."""
        ...

    def parameter_value(self, declaration: Parameter, bits: int, param_type: int) -> float | None:
        """The value a PARAM_SET carries in its 32 bits; None if it is of the wrong type."""
        ...
