"""ArduPilot's numbers: plain mode numbers of a copter, every parameter as a float, home as item 0 of a mission."""

import struct
from collections.abc import Mapping, Sequence

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.dialects import Alias, Constant, ModeRow, UnknownModeError
from autopilot.mavlink.dialects.ardupilot_aliases import ALIASES, CONSTANTS
from common.params import Parameter

_RELATIVE = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT

# COPTER_MODE
MODE_NUMBERS: dict[Mode, int] = {
    Mode.STABILIZED: 0,
    Mode.ACRO: 1,
    Mode.ALTITUDE: 2,
    Mode.MISSION: 3,
    Mode.GUIDED: 4,
    Mode.HOLD: 5,
    Mode.RETURN: 6,
    Mode.ORBIT: 7,
    Mode.LAND: 9,
    Mode.POSITION: 16,
    Mode.BRAKE: 17,
    Mode.SMART_RETURN: 21,
    Mode.FOLLOW: 23,
}
# Modes of ours that ArduPilot does not have, as the nearest of its own.
SHOWN_AS = {
    Mode.TAKEOFF: Mode.GUIDED,
    Mode.OFFBOARD: Mode.GUIDED,
    Mode.MANUAL: Mode.STABILIZED,
    Mode.PRECISION_LAND: Mode.LAND,
    Mode.TERMINATION: Mode.LAND,
}
MODES = (
    ModeRow(Mode.STABILIZED, "Stabilize", is_advanced=True),
    ModeRow(Mode.ACRO, "Acro", is_advanced=True),
    ModeRow(Mode.ALTITUDE, "Alt Hold", mavlink.MAV_STANDARD_MODE_ALTITUDE_HOLD),
    ModeRow(Mode.MISSION, "Auto", mavlink.MAV_STANDARD_MODE_MISSION),
    ModeRow(Mode.GUIDED, "Guided", is_advanced=True),
    ModeRow(Mode.HOLD, "Loiter"),
    ModeRow(Mode.RETURN, "RTL", mavlink.MAV_STANDARD_MODE_SAFE_RECOVERY),
    ModeRow(Mode.ORBIT, "Circle", mavlink.MAV_STANDARD_MODE_ORBIT),
    ModeRow(Mode.LAND, "Land", mavlink.MAV_STANDARD_MODE_LAND),
    ModeRow(Mode.POSITION, "PosHold", mavlink.MAV_STANDARD_MODE_POSITION_HOLD),
    ModeRow(Mode.BRAKE, "Brake"),
    ModeRow(Mode.SMART_RETURN, "Smart RTL"),
    ModeRow(Mode.FOLLOW, "Follow"),
)
_MODES = {number: mode for mode, number in MODE_NUMBERS.items()}


class ArduPilotDialect:
    """An ArduPilot multicopter, as far as clients can tell."""

    name = "ardupilot"
    autopilot = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
    capabilities = mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST | mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT
    # Copter 4.7.0, a development version: newer than any release, so that no station asks for an update. It names the
    # interface we are compatible with; our own version is the custom version.
    flight_sw_version = 4 << 24 | 7 << 16 | 0 << 8 | mavlink.FIRMWARE_VERSION_TYPE_DEV
    modes: Sequence[ModeRow] = MODES
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
    aliases: Sequence[Alias] = ALIASES
    constants: Sequence[Constant] = CONSTANTS

    def custom_mode(self, mode: Mode) -> int:
        return MODE_NUMBERS[SHOWN_AS.get(mode, mode)]

    def mode_from_custom(self, custom_mode: int) -> Mode:
        mode = _MODES.get(custom_mode)
        if mode is None:
            entry = mavlink.enums["COPTER_MODE"].get(custom_mode)
            name = entry.name.removeprefix("COPTER_MODE_") if entry and "ENUM_END" not in entry.name else custom_mode
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


ARDUPILOT = ArduPilotDialect()
