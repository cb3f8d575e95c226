import struct

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.mavlink.services.parameter_view import ParameterView
from autopilot.params import parameter_table
from common.airframe import load_airframe
from mission.flight_config import FlightConfig, flight_parameters
from tests.unit.autopilot.mavlink.rig import Rig, texts

AXES = "XYZ"
# What clients look for, by dialect: quiet connect, setup pages, behaviour, MAVSDK, MAVProxy.
EXPECTED = {
    PX4: [
        "SYS_AUTOSTART", "COM_RC_IN_MODE", "RC_MAP_ROLL", "RC_MAP_PITCH", "RC_MAP_YAW", "RC_MAP_THROTTLE",
        "CAL_GYRO0_ID", "CAL_ACC0_ID", "CAL_MAG0_ID", "BAT1_N_CELLS", "BAT1_V_CHARGED", "BAT1_V_EMPTY",
        "SYS_AUTOCONFIG", "MAV_SYS_ID", "CAL_MAG1_ID", "CAL_MAG2_ID", "RC_MAP_AUX1", "RC_MAP_AUX2", "RC_MAP_FLAPS",
        *(f"COM_FLTMODE{i}" for i in range(1, 7)), "BAT1_SOURCE", "RTL_LAND_DELAY", "RTL_DESCEND_ALT",
        "RTL_RETURN_ALT", "NAV_DLL_ACT", "COM_RC_LOSS_T", "NAV_RCL_ACT", "COM_LOW_BAT_ACT", "MPC_XY_VEL_MAX",
        "GF_MAX_HOR_DIST", "COM_DISARM_LAND", "MIS_TAKEOFF_ALT", "SYS_FAILURE_EN", "SENS_BOARD_X_OFF",
        "SENS_BOARD_Y_OFF", "SENS_BOARD_Z_OFF",
        *(f"FLW_TGT_{end}" for end in ("HT", "DST", "FA", "RS", "MAX_VEL", "ALT_M")),
    ],
    ARDUPILOT: [
        "FRAME_CLASS", "FRAME_TYPE", "COMPASS_DEV_ID", "COMPASS_DEV_ID2", "COMPASS_DEV_ID3", "COMPASS_USE",
        "COMPASS_USE2", "COMPASS_USE3", *(f"COMPASS_OFS{i}_{axis}" for i in ("", 2, 3) for axis in AXES),
        *(f"INS_ACCOFFS_{axis}" for axis in AXES), "RCMAP_ROLL", "RCMAP_PITCH", "RCMAP_YAW", "RCMAP_THROTTLE",
        *(f"RC{i}_{end}" for i in range(1, 5) for end in ("MIN", "MAX", "TRIM")),
        *(f"FLTMODE{i}" for i in range(1, 7)), "BATT_MONITOR", "BATT_CAPACITY", "RTL_ALT", "FENCE_ENABLE",
        "FENCE_ACTION", "FENCE_TYPE", "FENCE_ALT_MAX", "FENCE_RADIUS", "FENCE_MARGIN", "FS_THR_ENABLE",
        "FS_GCS_ENABLE", "FOLL_ENABLE", "FOLL_SYSID", "FOLL_DIST_MAX", "FOLL_OFS_X", "FOLL_OFS_Y", "FOLL_OFS_Z",
        "SYSID_THISMAV", "STAT_FLTTIME", "WPNAV_SPEED", "PILOT_TKOFF_ALT", "ATC_RATE_Y_MAX", "ARMING_CHECK",
    ],
}  # fmt: skip


def ardupilot_view() -> ParameterView:
    return ParameterView(parameter_table(load_airframe("x500")), ARDUPILOT)


def bits(value: float) -> int:
    return int(struct.unpack("<I", struct.pack("<f", value))[0])


@pytest.mark.parametrize("dialect", EXPECTED, ids=lambda dialect: dialect.name)
def test_every_name_that_clients_look_for_exists(dialect):
    view = ParameterView(parameter_table(load_airframe("x500")), dialect)
    assert [name for name in EXPECTED[dialect] if name not in view] == []


@pytest.mark.parametrize("dialect", EXPECTED, ids=lambda dialect: dialect.name)
def test_names_are_dense_and_short_and_values_fit_their_types(dialect):
    view = ParameterView(parameter_table(load_airframe("x500")), dialect)
    assert list(view.indices.values()) == list(range(len(view)))
    most = {2: 127, 4: 32_767, 6: 2**31 - 1}
    for name in view.names:
        assert len(name) <= 16
        low, high = view.bounds(name)
        assert low <= view.value(name) <= high
        if view.param_type(name) in most:
            assert isinstance(view.value(name), int)
            assert abs(view.value(name)) <= most[view.param_type(name)]


def test_every_alias_stands_for_a_parameter_and_has_no_other_meaning():
    airframe = load_airframe("x500")
    table = flight_parameters(FlightConfig(dialect="ardupilot"), airframe)
    assert [alias.name for alias in ARDUPILOT.aliases if alias.of not in table or alias.name in table] == []
    names = [alias.name for alias in ARDUPILOT.aliases] + [constant.name for constant in ARDUPILOT.constants]
    assert len(set(names)) == len(names)
    assert [constant.name for constant in ARDUPILOT.constants if constant.name in table] == []


def test_stations_find_nothing_to_complain_about():
    view = ardupilot_view()
    assert view.value("FRAME_CLASS") != 0
    assert view.value("ARMING_REQUIRE") != 0
    assert view.value("ARMING_CHECK") != 0
    assert all(view.value(f"COMPASS_OFS_{axis}") != 0.0 for axis in AXES)
    assert any(view.value(f"INS_ACCOFFS_{axis}") != 0.0 for axis in AXES)
    assert view.value("BATT_CAPACITY") == load_airframe("x500").battery.capacity_mah


def test_alias_has_its_own_unit():
    table = parameter_table()
    view = ParameterView(table, ARDUPILOT)
    assert view.value("RTL_ALT") == 3000
    assert view.set("RTL_ALT", 1550) == 1550
    assert table["RTL_RETURN_ALT"] == 15.5
    assert view.set("WPNAV_SPEED", 1e6) == 2000.0  # clamped
    assert table["MPC_XY_CRUISE"] == 20.0


def test_rounded_alias_does_not_change_what_it_shows():
    table = parameter_table()
    table.set("RTL_RETURN_ALT", 12.3456)
    view = ParameterView(table, ARDUPILOT)
    assert view.set("RTL_ALT", view.value("RTL_ALT")) == 1235
    assert table["RTL_RETURN_ALT"] == 12.3456


def test_alias_of_a_number_speaks_the_other_numbers():
    table = parameter_table()
    view = ParameterView(table, ARDUPILOT)
    assert view.value("BATT_FS_CRT_ACT") == 2
    assert view.set("BATT_FS_CRT_ACT", 1) == 1
    assert table["COM_LOW_BAT_ACT"] == 2
    assert view.set("BATT_FS_CRT_ACT", 77) == 1  # there is no such action


def test_constant_stays_as_it_is():
    view = ardupilot_view()
    assert view.set("FRAME_CLASS", 7) == 1


def test_change_is_told_under_every_name():
    table = parameter_table()
    view = ParameterView(table, ARDUPILOT)
    heard = []
    view.on_change(heard.append)
    table.set("RTL_RETURN_ALT", 20.0)
    assert sorted(heard) == ["RTL_ALT", "RTL_RETURN_ALT"]


def test_list_and_set_go_through_the_aliases():
    rig = Rig(dialect=ARDUPILOT)
    rig.client.send("PARAM_REQUEST_LIST")
    values = rig.all("PARAM_VALUE", 50)
    names = [value.param_id for value in values]
    assert {"RTL_ALT", "RTL_RETURN_ALT", "FRAME_CLASS"} <= set(names)
    assert [value.param_index for value in values] == list(range(values[0].param_count))
    rig.client.send("PARAM_SET", param_id="RTL_ALT", param_value=bits(2000.0), param_type=mavlink.MAV_PARAM_TYPE_REAL32)
    answers = {value.param_id: value for value in rig.all("PARAM_VALUE", 30)}
    assert answers["RTL_ALT"].param_value == bits(2000.0)
    assert answers["RTL_ALT"].param_index == names.index("RTL_ALT")
    assert answers["RTL_RETURN_ALT"].param_value == bits(20.0)
    assert answers["RTL_RETURN_ALT"].param_index == 65_535
    assert rig.vehicle.params["RTL_RETURN_ALT"] == 20.0


@pytest.mark.parametrize(("name", "value"), [("RTL_ALT", 2000.0), ("RTL_RETURN_ALT", 20.0)])
def test_set_is_answered_first_under_the_name_that_was_set(name, value):
    """Scripts set a parameter and print the next PARAM_VALUE."""
    rig = Rig(dialect=ARDUPILOT)
    rig.client.send("PARAM_SET", param_id=name, param_value=bits(value), param_type=9)
    answer = rig.only("PARAM_VALUE", 20)
    assert (answer.param_id, answer.param_value) == (name, bits(value))
    rig.client.send("PARAM_REQUEST_READ", param_id="WPNAV_SPEED", param_index=-1)
    assert rig.only("PARAM_VALUE", 20).param_id == "WPNAV_SPEED"
    assert {rig.only("PARAM_VALUE", 20).param_id, name} == {"RTL_ALT", "RTL_RETURN_ALT"}


def test_value_out_of_range_is_told_in_the_clients_unit():
    rig = Rig(dialect=ARDUPILOT)
    rig.client.send("PARAM_SET", param_id="WPNAV_SPEED", param_value=bits(9000.0), param_type=9)
    assert texts(rig.frame()) == ["Parameter WPNAV_SPEED: 9000 asked, 2000 set (50 to 2000)"]
