"""PX4's numbers: modes as main and sub mode, integer parameters as bit patterns."""

import re
import struct
from collections.abc import Mapping, Sequence
from hashlib import sha1

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.dialects import Alias, Constant, ModeRow, UnknownModeError
from common.params import Parameter

MANUAL, ALTCTL, POSCTL, AUTO, ACRO, OFFBOARD, STABILIZED, TERMINATION = 1, 2, 3, 4, 5, 6, 7, 10

# (main, sub) of px4_custom_mode.h
MODE_NUMBERS: dict[Mode, tuple[int, int]] = {
    Mode.TAKEOFF: (AUTO, 2),
    Mode.HOLD: (AUTO, 3),
    Mode.MISSION: (AUTO, 4),
    Mode.RETURN: (AUTO, 5),
    Mode.LAND: (AUTO, 6),
    Mode.FOLLOW: (AUTO, 8),
    Mode.PRECISION_LAND: (AUTO, 9),
    Mode.OFFBOARD: (OFFBOARD, 0),
    Mode.MANUAL: (MANUAL, 0),
    Mode.STABILIZED: (STABILIZED, 0),
    Mode.ACRO: (ACRO, 0),
    Mode.ALTITUDE: (ALTCTL, 0),
    Mode.POSITION: (POSCTL, 0),
    Mode.ORBIT: (POSCTL, 1),
    Mode.TERMINATION: (TERMINATION, 0),
}
# Modes of ours that PX4 does not have, as the nearest of its own.
SHOWN_AS = {Mode.BRAKE: Mode.HOLD, Mode.SMART_RETURN: Mode.RETURN, Mode.GUIDED: Mode.OFFBOARD}
MODES = (
    ModeRow(Mode.POSITION, "Position", mavlink.MAV_STANDARD_MODE_POSITION_HOLD),
    ModeRow(Mode.ALTITUDE, "Altitude", mavlink.MAV_STANDARD_MODE_ALTITUDE_HOLD),
    ModeRow(Mode.HOLD, "Hold"),
    ModeRow(Mode.MISSION, "Mission", mavlink.MAV_STANDARD_MODE_MISSION),
    ModeRow(Mode.RETURN, "Return", mavlink.MAV_STANDARD_MODE_SAFE_RECOVERY),
    ModeRow(Mode.LAND, "Land", mavlink.MAV_STANDARD_MODE_LAND),
    ModeRow(Mode.PRECISION_LAND, "Precision Land"),
    ModeRow(Mode.TAKEOFF, "Takeoff", mavlink.MAV_STANDARD_MODE_TAKEOFF),
    ModeRow(Mode.OFFBOARD, "Offboard", is_advanced=True),
    ModeRow(Mode.FOLLOW, "Follow Me"),
    ModeRow(Mode.ORBIT, "Orbit", mavlink.MAV_STANDARD_MODE_ORBIT, is_selectable=False),
    ModeRow(Mode.STABILIZED, "Stabilized", is_advanced=True),
    ModeRow(Mode.MANUAL, "Manual", is_advanced=True),
    ModeRow(Mode.ACRO, "Acro", is_advanced=True),
    ModeRow(Mode.TERMINATION, "Termination", is_selectable=False),
)
_MODES = {numbers: mode for mode, numbers in MODE_NUMBERS.items()}
_WITHOUT_SUB_MODES = frozenset({MANUAL, ALTCTL, ACRO, OFFBOARD, STABILIZED, TERMINATION})


class Px4Dialect:
    """A PX4 multicopter, as far as clients can tell."""

    name = "px4"
    autopilot = mavlink.MAV_AUTOPILOT_PX4
    capabilities = mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
    # PX4 1.18.0, a development version: newer than any release, so that QGroundControl neither calls it too old nor
    # asks for an update. It names the interface we are compatible with; our own version is the custom version.
    flight_sw_version = 1 << 24 | 18 << 16 | 0 << 8 | mavlink.FIRMWARE_VERSION_TYPE_DEV

    modes: Sequence[ModeRow] = MODES
    goto_mode = Mode.HOLD
    first_seq = 0
    item_request = "MISSION_REQUEST_INT"
    acknowledges_set_mode = False
    announces_components = True
    is_active_armed = True
    long_frames: Mapping[int, int] = {}
    # PX4 never looks at the frame of these, and MAVSDK sends altitudes above sea level in a relative one.
    amsl_commands: frozenset[int] = frozenset(
        {mavlink.MAV_CMD_DO_ORBIT, mavlink.MAV_CMD_DO_SET_HOME, mavlink.MAV_CMD_DO_SET_ROI_LOCATION}
    )
    aliases: Sequence[Alias] = ()
    constants: Sequence[Constant] = ()

    def custom_mode(self, mode: Mode) -> int:
        main, sub = MODE_NUMBERS[SHOWN_AS.get(mode, mode)]
        return main << 16 | sub << 24

    def mode_from_custom(self, custom_mode: int) -> Mode:
        return self.mode_from_command(custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF)

    def mode_from_command(self, main_mode: int, sub_mode: int) -> Mode:
        mode = _MODES.get((main_mode, 0 if main_mode in _WITHOUT_SUB_MODES else sub_mode))
        if mode is None:
            raise UnknownModeError(f"there is no mode {main_mode}/{sub_mode}")
        return mode

    def custom_version(self, project: str, version: str) -> bytes:
        """As PX4: five bytes of a hash, then the vendor's version as three bytes; clients read it from the end.

        PX4's hash names its source; ours, which may be no checkout, names project and version.
        """
        numbers = bytes(min(int(part), 255) for part in (re.findall(r"\d+", version) + ["0"] * 3)[:3])
        return (sha1(f"{project} {version}".encode(), usedforsecurity=False).digest()[:5] + numbers)[::-1]

    def parameter_type(self, declaration: Parameter) -> int:
        return int(mavlink.MAV_PARAM_TYPE_INT32 if declaration.is_integer else mavlink.MAV_PARAM_TYPE_REAL32)

    def parameter_bits(self, param_type: int, value: float) -> int:
        is_real = param_type == mavlink.MAV_PARAM_TYPE_REAL32
        return int.from_bytes(struct.pack("<f", value) if is_real else struct.pack("<i", int(value)), "little")

    def parameter_value(self, param_type: int, bits: int, asked_type: int) -> float | None:
        if asked_type != param_type:
            return None
        is_real = param_type == mavlink.MAV_PARAM_TYPE_REAL32
        value: float = struct.unpack("<f" if is_real else "<i", bits.to_bytes(4, "little"))[0]
        return value


PX4 = Px4Dialect()
