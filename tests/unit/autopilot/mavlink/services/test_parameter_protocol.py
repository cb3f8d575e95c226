import struct
import zlib

from pymavlink.dialects.v20 import all as mavlink

from tests.unit.autopilot.mavlink.rig import Rig, texts


def bits(value: float) -> int:
    return int(struct.unpack("<I", struct.pack("<f", value))[0])


def test_list_is_complete_dense_and_counted():
    rig = Rig()
    rig.client.send("PARAM_REQUEST_LIST")
    values = rig.all("PARAM_VALUE", 50)
    table = rig.vehicle.params
    assert [value.param_index for value in values] == list(range(len(table)))
    assert {value.param_count for value in values} == {len(table)}
    assert [value.param_id for value in values] == table.names
    assert "_HASH_CHECK" not in table


def test_list_is_sent_bit_by_bit():
    rig = Rig()
    rig.client.send("PARAM_REQUEST_LIST")
    assert len(rig.all("PARAM_VALUE")) == 20


def test_list_starts_again_when_asked_again():
    rig = Rig()
    rig.client.send("PARAM_REQUEST_LIST")
    rig.frame(2)
    rig.client.send("PARAM_REQUEST_LIST")
    assert [value.param_index for value in rig.all("PARAM_VALUE", 50)] == list(range(len(rig.vehicle.params)))


def test_lists_of_two_links_do_not_disturb_each_other():
    rig = Rig()
    rig.client.send("PARAM_REQUEST_LIST")
    rig.frame(3)
    rig.second_client.send("PARAM_REQUEST_LIST")
    rig.frame(50)
    count = sum(message.name == "PARAM_VALUE" for message in rig.second_client.received())
    assert count == len(rig.vehicle.params)


def test_value_is_read_by_name_and_by_index():
    rig = Rig()
    index = rig.vehicle.params.names.index("MIS_TAKEOFF_ALT")
    rig.client.send("PARAM_REQUEST_READ", param_id="MIS_TAKEOFF_ALT", param_index=-1)
    by_name = rig.only("PARAM_VALUE")
    rig.client.send("PARAM_REQUEST_READ", param_index=index)
    assert rig.only("PARAM_VALUE") == by_name
    assert by_name.param_index == index
    assert by_name.param_value == bits(rig.vehicle.params["MIS_TAKEOFF_ALT"])
    assert by_name.param_type == mavlink.MAV_PARAM_TYPE_REAL32


def test_unknown_name_or_index_is_an_error():
    rig = Rig()
    rig.client.send("PARAM_REQUEST_READ", param_id="NO_SUCH_NAME", param_index=-1)
    error = rig.only("PARAM_ERROR")
    assert (error.param_id, error.error) == ("NO_SUCH_NAME", mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST)
    rig.client.send("PARAM_REQUEST_READ", param_index=30_000)
    assert rig.only("PARAM_ERROR").param_index == 30_000
    rig.client.send("PARAM_SET", param_id="NOPE", param_value=0, param_type=9)
    assert rig.only("PARAM_ERROR").param_id == "NOPE"


def test_set_is_answered_to_everyone():
    rig = Rig()
    rig.client.send("PARAM_SET", param_id="MIS_TAKEOFF_ALT", param_value=bits(12.5), param_type=9)
    value = rig.only("PARAM_VALUE")
    assert rig.vehicle.params["MIS_TAKEOFF_ALT"] == 12.5
    assert value.param_value == bits(12.5)
    assert any(message.fields == value for message in rig.second_client.received())


def test_integer_is_set_by_its_bits():
    rig = Rig()
    rig.client.send("PARAM_SET", param_id="MAV_SYS_ID", param_value=42, param_type=6)
    assert rig.only("PARAM_VALUE").param_value == 42
    assert rig.vehicle.params["MAV_SYS_ID"] == 42


def test_value_out_of_bounds_is_clamped_and_told():
    rig = Rig()
    rig.client.send("PARAM_SET", param_id="MIS_TAKEOFF_ALT", param_value=bits(5000.0), param_type=9)
    messages = rig.frame()
    assert [m.fields.param_value for m in messages if m.name == "PARAM_VALUE"] == [bits(80.0)]
    assert texts(messages) == ["Parameter MIS_TAKEOFF_ALT: 5000 asked, 80 set (0.5 to 80)"]


def test_constant_and_nan_change_nothing():
    rig = Rig()
    rig.client.send("PARAM_SET", param_id="SYS_AUTOSTART", param_value=5, param_type=6)
    assert rig.only("PARAM_VALUE").param_value == 4001
    rig.client.send("PARAM_SET", param_id="MIS_TAKEOFF_ALT", param_value=bits(float("nan")), param_type=9)
    assert rig.only("PARAM_VALUE").param_value == bits(2.5)


def test_wrong_type_changes_nothing():
    rig = Rig()
    rig.client.send("PARAM_SET", param_id="MAV_SYS_ID", param_value=bits(42.0), param_type=9)
    messages = rig.frame()
    assert [m.fields.param_value for m in messages if m.name == "PARAM_VALUE"] == [1]
    assert texts(messages) == ["Parameter MAV_SYS_ID: not set, it is an integer"]


def test_change_inside_the_vehicle_is_told_without_an_index():
    rig = Rig()
    rig.frame()
    rig.vehicle.params.set("MIS_TAKEOFF_ALT", 7.0)
    value = rig.only("PARAM_VALUE")
    assert (value.param_id, value.param_value, value.param_index) == ("MIS_TAKEOFF_ALT", bits(7.0), 65_535)


def test_hash_is_px4s_checksum_over_names_and_values():
    rig = Rig()
    rig.client.send("PARAM_REQUEST_READ", param_id="_HASH_CHECK", param_index=-1)
    value = rig.only("PARAM_VALUE")
    table = rig.vehicle.params
    data = b""
    for name in table.names:
        code = "<i" if table.declarations[name].is_integer else "<f"
        data += name.encode() + struct.pack(code, table[name])
    # PX4's sum starts from 0 and is not inverted; zlib's is inverted at both ends.
    assert value.param_value == zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF
    assert value.param_index == 65_535


def test_client_that_knows_the_hash_stops_the_list():
    rig = Rig()
    rig.client.send("PARAM_REQUEST_LIST")
    rig.frame()
    rig.client.send("PARAM_SET", param_id="_HASH_CHECK", param_value=1, param_type=5)
    assert rig.all("PARAM_VALUE", 10) == []


def test_names_clients_expect_are_there():
    table = Rig().vehicle.params
    for name in ("SYS_AUTOSTART", "COM_RC_IN_MODE", "CAL_GYRO0_ID", "CAL_ACC0_ID", "CAL_MAG0_ID", "BAT1_N_CELLS"):
        assert table[name] != 0
    for name in (
        "RC_MAP_ROLL", "RC_MAP_THROTTLE", "COM_FLTMODE6", "MPC_XY_VEL_MAX", "COM_DISARM_LAND", "MIS_TAKEOFF_ALT",
        "RTL_RETURN_ALT", "RTL_DESCEND_ALT", "RTL_LAND_DELAY", "NAV_DLL_ACT", "COM_LOW_BAT_ACT", "GF_MAX_HOR_DIST",
    ):  # fmt: skip
        assert name in table
    assert "SYS_HITL" not in table
