"""PX4's numbers: modes as main and sub mode, integer parameters as bit patterns."""

import re
import struct
from collections.abc import Mapping, Sequence
from hashlib import sha1
from typing import Self

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.ardupilot_vehicle import Alias, ArduPilotVehicle, Constant
from autopilot.interface.mode_spec import ModeTable
from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.dialects import ModeNumbers, ModeRow, UnknownModeError
from autopilot.vehicles.default_class import DEFAULT_CLASS
from common.params import Parameter


class Px4Dialect:
    """A vehicle of PX4's, as far as clients can tell."""

    name = "px4"
    autopilot = mavlink.MAV_AUTOPILOT_PX4
    capabilities = mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
    # PX4 1.18.0, a development version: newer than any release, so that QGroundControl neither calls it too old nor
    # asks for an update. It names the interface we are compatible with; our own version is the custom version.
    flight_sw_version = 1 << 24 | 18 << 16 | 0 << 8 | mavlink.FIRMWARE_VERSION_TYPE_DEV

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

    def __init__(self, modes: ModeTable) -> None:
        self.mode_table = modes
        self._numbers = ModeNumbers(modes, lambda spec: spec.px4)
        self.modes: Sequence[ModeRow] = self._numbers.rows
        mains = [number >> 16 & 0xFF for number in self._numbers.numbers]
        self._without_sub_modes = {
            main for main in mains if mains.count(main) == 1 and self._numbers.mode_of(main << 16) is not None
        }

    def of_vehicle(self, modes: ModeTable, _ardupilot: ArduPilotVehicle) -> Self:
        return self if modes is self.mode_table else type(self)(modes)

    def custom_mode(self, mode: Mode) -> int:
        return self._numbers.number_of(mode)

    def mode_from_custom(self, custom_mode: int) -> Mode:
        return self.mode_from_command(custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF)

    def mode_from_command(self, main_mode: int, sub_mode: int) -> Mode:
        sub = 0 if main_mode in self._without_sub_modes else sub_mode
        are_bytes = 0 <= main_mode <= 0xFF and 0 <= sub <= 0xFF
        mode = self._numbers.mode_of(main_mode << 16 | sub << 24) if are_bytes else None
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


PX4 = Px4Dialect(DEFAULT_CLASS.modes)
