import pytest
from pymavlink import mavutil

from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.dialects import UnknownModeError
from autopilot.mavlink.dialects.px4 import PX4
from common.params import Parameter

PYMAVLINK_NAMES = {
    Mode.HOLD: "LOITER",
    Mode.TAKEOFF: "TAKEOFF",
    Mode.MISSION: "MISSION",
    Mode.RETURN: "RTL",
    Mode.LAND: "LAND",
    Mode.FOLLOW: "FOLLOWME",
    Mode.OFFBOARD: "OFFBOARD",
    Mode.MANUAL: "MANUAL",
    Mode.STABILIZED: "STABILIZED",
    Mode.ACRO: "ACRO",
    Mode.ALTITUDE: "ALTCTL",
    Mode.POSITION: "POSCTL",
    Mode.BRAKE: "LOITER",
    Mode.SMART_RETURN: "RTL",
    Mode.GUIDED: "OFFBOARD",
}
INT32, REAL32 = 6, 9  # MAV_PARAM_TYPE
INTEGER = Parameter("I", 3, -5, 5, "", "", "")
REAL = Parameter("R", 3.0, -5.0, 5.0, "", "", "")


@pytest.mark.parametrize("mode", PYMAVLINK_NAMES)
def test_modes_are_those_pymavlink_knows(mode):
    assert mavutil.interpret_px4_mode(157, PX4.custom_mode(mode)) == PYMAVLINK_NAMES[mode]


@pytest.mark.parametrize("mode", [row.mode for row in PX4.modes])
def test_mode_survives_the_round_trip(mode):
    assert PX4.mode_from_custom(PX4.custom_mode(mode)) == mode


@pytest.mark.parametrize(("main", "sub"), [(3, 9), (8, 0), (4, 1), (4, 10), (4, 99), (200, 0), (-1, 0)])
def test_unknown_mode_is_refused_with_a_reason(main, sub):
    with pytest.raises(UnknownModeError, match=r"\w+"):
        PX4.mode_from_command(main, sub)


def test_integers_travel_as_bit_patterns():
    assert PX4.parameter_bits(INT32, -2) == 0xFFFFFFFE
    assert PX4.parameter_value(INT32, 0xFFFFFFFE, INT32) == -2
    assert PX4.parameter_bits(REAL32, 1.0) == 0x3F800000
    assert PX4.parameter_value(REAL32, 0x3F800000, REAL32) == 1.0


def test_parameters_are_int32_or_real32():
    assert PX4.parameter_type(INTEGER) == INT32
    assert PX4.parameter_type(REAL) == REAL32


def test_wrong_parameter_type_is_noticed():
    assert PX4.parameter_value(INT32, 0x3F800000, REAL32) is None


def test_custom_version_is_the_vendors_version_and_a_hash_read_from_the_end():
    version = PX4.custom_version("Honeyguide", "1.2.3")
    assert tuple(version[:3]) == (3, 2, 1)
    assert len(version) == 8
    assert version[3:] != PX4.custom_version("Honeyguide", "1.2.4")[3:]
    assert tuple(PX4.custom_version("Honeyguide", "0.10.999.dev1")[:3]) == (255, 10, 0)
    assert tuple(PX4.custom_version("Honeyguide", "7")[:3]) == (0, 0, 7)
