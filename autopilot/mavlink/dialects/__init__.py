"""What differs between the autopilots that ground stations know; everything else is shared."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, Self

from autopilot.interface.ardupilot_vehicle import Alias, ArduPilotVehicle, Constant
from autopilot.interface.mode_spec import DialectMode, ModeSpec, ModeTable
from autopilot.interface.vehicle_state import Mode
from common.params import Parameter


class UnknownModeError(Exception):
    """A mode this vehicle does not have; the text is the reason shown to the pilot."""


@dataclass(frozen=True, slots=True)
class ModeRow:
    """One flight mode as AVAILABLE_MODES lists it."""

    mode: Mode
    name: str  # what the autopilot's own users call it
    standard_mode: int = 0  # MAV_STANDARD_MODE; 0: none
    is_selectable: bool = True  # by a pilot; others are entered by a command
    is_advanced: bool = False


class ModeNumbers:
    """The modes of a vehicle as one dialect numbers and lists them.

    Args:
        table: the vehicle's modes.
        entry: what a mode's row says of this dialect.
    """

    def __init__(self, table: ModeTable, entry: Callable[[ModeSpec], DialectMode | Mode]) -> None:
        self.table = table
        own = {mode: shown for mode, spec in table.items() if isinstance(shown := entry(spec), DialectMode)}
        self._numbers = {mode: shown.number for mode, shown in own.items()}
        self._modes = {number: mode for mode, number in self._numbers.items()}
        for mode, spec in table.items():
            nearest = entry(spec)
            if isinstance(nearest, Mode):
                self._numbers[mode] = own[nearest].number
        self.rows = tuple(
            ModeRow(mode, shown.name, table[mode].standard, shown.is_selectable, table[mode].is_advanced)
            for mode, shown in own.items()
        )

    def number_of(self, mode: Mode) -> int:
        """HEARTBEAT.custom_mode; of the nearest mode if the dialect does not have it."""
        return self._numbers[mode]

    def mode_of(self, number: int) -> Mode | None:
        """The mode that a client asks for by its number."""
        return self._modes.get(number)

    @property
    def numbers(self) -> Sequence[int]:
        """Those that clients may ask for."""
        return list(self._modes)


class Dialect(Protocol):
    """One autopilot's numbers."""

    name: str
    autopilot: int  # MAV_AUTOPILOT
    capabilities: int  # MAV_PROTOCOL_CAPABILITY bits that only this dialect sets
    flight_sw_version: int  # of the autopilot this dialect is compatible with
    mode_table: ModeTable  # of the vehicle
    modes: Sequence[ModeRow]  # that a client may ask for
    goto_mode: Mode  # in which a position is held to which a client sends the vehicle
    first_seq: int  # of a mission in the lists that clients see; 1 where item 0 is home
    item_request: str  # the message by which it asks for the items of a list that is uploaded
    acknowledges_set_mode: bool  # the old message SET_MODE is answered by COMMAND_ACK with the message's own number
    announces_components: bool  # camera, gimbal and winch send heartbeats of their own
    long_frames: Mapping[int, int]  # MAV_FRAME of the altitude in a COMMAND_LONG, by MAV_CMD; otherwise 0 (AMSL)
    is_active_armed: bool  # the heartbeat's state is active once armed, on the ground too
    amsl_commands: frozenset[int]  # MAV_CMDs whose altitude is above sea level even in a frame relative to home
    aliases: Sequence[Alias]
    constants: Sequence[Constant]

    def of_vehicle(self, modes: ModeTable, ardupilot: ArduPilotVehicle, /) -> Self:
        """The same dialect for a vehicle with these modes that is one of ArduPilot's."""
        ...

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

    def custom_version(self, project: str, version: str) -> bytes:
        """The 8 bytes of AUTOPILOT_VERSION.flight_custom_version."""
        ...

    def parameter_type(self, declaration: Parameter) -> int:
        """MAV_PARAM_TYPE of a parameter of ours."""
        ...

    def parameter_bits(self, param_type: int, value: float) -> int:
        """The value field of PARAM_VALUE, as its 32 bits."""
        ...

    def parameter_value(self, param_type: int, bits: int, asked_type: int) -> float | None:
        """The value a PARAM_SET carries in its 32 bits; None if it is of the wrong type."""
        ...
