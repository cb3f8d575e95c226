"""ArduPilot's numbers: plain mode numbers by its vehicle, every parameter as a float, home as item 0 of a mission."""

import struct
from collections.abc import Mapping, Sequence
from typing import Self

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.ardupilot_vehicle import Alias, ArduPilotVehicle, Constant
from autopilot.interface.mode_spec import ModeTable
from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.dialects import ModeNumbers, ModeRow, UnknownModeError
from autopilot.mavlink.dialects.ardupilot_aliases import ALIASES, CONSTANTS, switch_aliases
from autopilot.vehicles.default_class import DEFAULT_CLASS
from common.params import Parameter

_RELATIVE = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT


class ArduPilotDialect:
    """One of ArduPilot's vehicles, as far as clients can tell."""

    name = "ardupilot"
    autopilot = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
    capabilities = mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST | mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT
    goto_mode = Mode.GUIDED
    first_seq = 1
    item_request = "MISSION_REQUEST"  # clients made for ArduPilot may know no other
    acknowledges_set_mode = True
    announces_components = False  # a camera and a mount are parts of component 1
    is_active_armed = False
    long_frames: Mapping[int, int] = {
        mavlink.MAV_CMD_NAV_TAKEOFF: _RELATIVE,
        mavlink.MAV_CMD_DO_SET_ROI: _RELATIVE,
        mavlink.MAV_CMD_DO_SET_ROI_LOCATION: _RELATIVE,
    }
    amsl_commands: frozenset[int] = frozenset({mavlink.MAV_CMD_DO_ORBIT})  # a command of PX4's: see there

    def __init__(self, modes: ModeTable, vehicle: ArduPilotVehicle) -> None:
        self.mode_table = modes
        self._vehicle = vehicle
        # It names the interface we are compatible with; our own version is the custom version.
        major, minor, patch = vehicle.version
        self.flight_sw_version = major << 24 | minor << 16 | patch << 8 | mavlink.FIRMWARE_VERSION_TYPE_DEV
        self._numbers = ModeNumbers(modes, lambda spec: spec.ardupilot)
        self.constants: Sequence[Constant] = sorted((*CONSTANTS, *vehicle.constants), key=lambda each: each.name)
        self.modes: Sequence[ModeRow] = sorted(self._numbers.rows, key=lambda row: self._numbers.number_of(row.mode))
        self.aliases: Sequence[Alias] = (*ALIASES, *switch_aliases(modes, vehicle.switch_prefix), *vehicle.aliases)

    def of_vehicle(self, modes: ModeTable, ardupilot: ArduPilotVehicle) -> Self:
        is_same = modes is self.mode_table and ardupilot == self._vehicle
        return self if is_same else type(self)(modes, ardupilot)

    def custom_mode(self, mode: Mode) -> int:
        return self._numbers.number_of(mode)

    def mode_from_custom(self, custom_mode: int) -> Mode:
        mode = self._numbers.mode_of(custom_mode)
        if mode is None:
            enum = f"{self._vehicle.name.upper()}_MODE"
            entry = mavlink.enums[enum].get(custom_mode)
            name = entry.name.removeprefix(f"{enum}_") if entry and "ENUM_END" not in entry.name else custom_mode
            raise UnknownModeError(f"there is no mode {name}")
        return mode

    def mode_from_command(self, main_mode: int, _sub_mode: int) -> Mode:
        return self.mode_from_custom(main_mode)

    def custom_version(self, _project: str, version: str) -> bytes:
        """Text, as ArduPilot."""
        return f"HG-{version}".encode("ascii")[:8].ljust(8, b"\0")

    def parameter_type(self, declaration: Parameter) -> int:
        return int(mavlink.MAV_PARAM_TYPE_INT32 if declaration.is_integer else mavlink.MAV_PARAM_TYPE_REAL32)

    def parameter_bits(self, _param_type: int, value: float) -> int:
        return int.from_bytes(struct.pack("<f", value), "little")

    def parameter_value(self, _param_type: int, bits: int, _asked_type: int) -> float | None:
        """A number is a number, whatever type the client believes the parameter to be of."""
        value: float = struct.unpack("<f", bits.to_bytes(4, "little"))[0]
        return value


ARDUPILOT = ArduPilotDialect(DEFAULT_CLASS.modes, DEFAULT_CLASS.ardupilot)
