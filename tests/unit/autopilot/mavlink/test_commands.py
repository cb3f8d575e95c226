from dataclasses import replace
from math import isnan, nan, radians

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.client_requests import ChangeMode, GoTo, SetHome, TakeOff
from autopilot.interface.vehicle_state import Mode, Reply, Verdict
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from tests.unit.autopilot.mavlink.rig import HOME, Rig, texts

ACCEPTED = mavlink.MAV_RESULT_ACCEPTED
DENIED = mavlink.MAV_RESULT_DENIED
UNSUPPORTED = mavlink.MAV_RESULT_UNSUPPORTED
TEMPORARILY_REJECTED = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
INT32_MAX = 2**31 - 1


def send_int(rig: Rig, command: int, frame: int, **fields: float) -> int:
    """COMMAND_INT; the result."""
    nans = {f"param{i}": nan for i in range(1, 5)}
    rig.client.send("COMMAND_INT", command=command, frame=frame, **(nans | fields))
    return rig.only("COMMAND_ACK").result


@pytest.mark.parametrize(
    ("params", "call"),
    [
        ((1.0, 0.0), ("arm", False)),
        ((1.0, 21196.0), ("arm", True)),
        ((0.0,), ("disarm", False)),
        ((0.0, 21196.0), ("disarm", True)),
    ],
)
def test_arming(params, call):
    rig = Rig()
    assert rig.ack(400, *params).result == ACCEPTED
    assert rig.vehicle.calls == [call]


def test_refused_arm_says_why():
    rig = Rig()
    rig.vehicle.reply = Reply(Verdict.TEMPORARILY_REJECTED, "no GNSS fix")
    rig.client.command(400, 1.0)
    messages = rig.frame()
    (ack,) = [message.fields for message in messages if message.name == "COMMAND_ACK"]
    assert (ack.command, ack.result) == (400, TEMPORARILY_REJECTED)
    assert texts(messages) == ["Arm: no GNSS fix"]
    assert [m.fields.severity for m in messages if m.name == "STATUSTEXT"] == [mavlink.MAV_SEVERITY_CRITICAL]


def test_arm_with_another_number_is_denied():
    rig = Rig()
    assert rig.ack(400, 2.0).result == DENIED
    assert rig.ack(400).result == DENIED
    assert rig.vehicle.calls == []


def test_takeoff_altitude_is_above_sea_level():
    rig = Rig()
    assert rig.ack(22, -1.0, 0.0, 0.0, nan, nan, nan, 500.0).result == ACCEPTED
    (asked,) = rig.vehicle.calls
    assert isinstance(asked, TakeOff)
    assert asked.alt_amsl_m == 500.0
    assert isnan(asked.yaw_rad)


def test_takeoff_without_altitude_leaves_it_to_the_vehicle():
    rig = Rig()
    rig.ack(22)
    assert isnan(rig.vehicle.calls[0].alt_amsl_m)


def test_takeoff_above_home_by_command_int():
    rig = Rig()
    assert send_int(rig, 22, 3, param4=90.0, z=10.0) == ACCEPTED
    assert rig.vehicle.calls == [TakeOff(HOME.alt_m + 10.0, pytest.approx(radians(90.0)))]


@pytest.mark.parametrize("frame", [0, 3, 5, 6])
def test_orbit_home_and_region_of_interest_are_above_sea_level_in_any_frame_of_px4(frame):
    rig = Rig()
    position = {"x": round(HOME.lat_deg * 1e7), "y": round(HOME.lon_deg * 1e7), "z": 500.0}
    for command in (34, 179, 195):
        assert send_int(rig, command, frame, **position) == ACCEPTED
    orbit, home, look_at = rig.vehicle.calls
    assert (orbit.alt_amsl_m, home.alt_amsl_m, look_at[4]) == (500.0, 500.0, 500.0)


def test_an_orbit_is_above_sea_level_and_home_and_roi_in_their_frame_in_ardupilot():
    rig = Rig(dialect=ARDUPILOT)
    position = {"x": round(HOME.lat_deg * 1e7), "y": round(HOME.lon_deg * 1e7), "z": 500.0}
    for command in (34, 179, 195):
        assert send_int(rig, command, 3, **position) == ACCEPTED
    orbit, home, look_at = rig.vehicle.calls
    assert (orbit.alt_amsl_m, home.alt_amsl_m, look_at[4]) == (500.0, HOME.alt_m + 500.0, HOME.alt_m + 500.0)


def test_altitude_above_ground_counts_from_the_terrain():
    rig = Rig()
    assert send_int(rig, 22, 11, z=10.0) == ACCEPTED
    assert rig.vehicle.calls[0].alt_amsl_m == pytest.approx(
        HOME.alt_m + 1.0 + 10.0
    )  # the ground is 1 m above the origin


def test_altitude_above_home_needs_a_home():
    rig = Rig()
    rig.update(home=None)
    assert send_int(rig, 22, 6, z=10.0) == TEMPORARILY_REJECTED
    assert rig.vehicle.calls == []


def test_altitude_in_a_local_frame_is_denied():
    rig = Rig()
    assert send_int(rig, 22, 1, z=10.0) == DENIED


def test_land_here_and_there():
    rig = Rig()
    rig.ack(21)
    rig.ack(21, 0, 0, 0, 0, 0, 0, 0)
    assert all(isnan(call.lat_deg) and isnan(call.lon_deg) for call in rig.vehicle.calls)
    assert send_int(rig, 21, 0, x=473977420, y=85455940, param4=nan) == ACCEPTED
    assert (rig.vehicle.calls[2].lat_deg, rig.vehicle.calls[2].lon_deg) == (47.397742, 8.545594)


def test_return_is_a_command_too():
    rig = Rig()
    assert rig.ack(20).result == ACCEPTED
    assert rig.vehicle.calls == [ChangeMode(Mode.RETURN)]


@pytest.mark.parametrize("base_mode", [1.0, 129.0, 29.0, 81.0])
def test_mode_by_command(base_mode):
    rig = Rig()
    assert rig.ack(176, base_mode, 4.0, 4.0).result == ACCEPTED
    assert rig.vehicle.calls == [ChangeMode(Mode.MISSION)]


def test_offboard_mode_needs_no_sub_mode():
    rig = Rig()
    assert rig.ack(176, 1.0, 6.0, 0.0).result == ACCEPTED
    assert rig.vehicle.calls == [ChangeMode(Mode.OFFBOARD)]


@pytest.mark.parametrize("params", [(1.0, 3.0, 9.0), (0.0, 4.0, 4.0), (1.0, 4.0, 77.0), (1.0, nan, nan)])
def test_mode_we_do_not_have_is_denied(params):
    rig = Rig()
    rig.client.command(176, *params)
    messages = rig.frame()
    assert [m.fields.result for m in messages if m.name == "COMMAND_ACK"] == [DENIED]
    assert texts(messages)[0].startswith("Mode: ")
    assert rig.vehicle.calls == []


def test_set_mode_message_has_no_acknowledgement():
    rig = Rig()
    rig.client.send("SET_MODE", base_mode=1, custom_mode=0x06040000)
    assert rig.all("COMMAND_ACK") == []
    assert rig.vehicle.calls == [ChangeMode(Mode.LAND)]


def test_set_mode_message_tells_a_refusal():
    rig = Rig()
    rig.client.send("SET_MODE", base_mode=1, custom_mode=0x00080000)
    assert "no mode" in texts(rig.frame())[0]
    rig.vehicle.reply = Reply(Verdict.DENIED, "no mission")
    rig.client.send("SET_MODE", base_mode=1, custom_mode=0x04040000)
    assert texts(rig.frame()) == ["Mode: no mission"]


def test_goto_by_command_int_honours_the_frame():
    rig = Rig()
    goto = {"param1": -1.0, "param2": 1.0, "param4": 0.5, "x": 473977420, "y": 85455940}
    assert send_int(rig, 192, 0, **goto, z=520.0) == ACCEPTED
    assert send_int(rig, 192, 6, **goto, z=32.0) == ACCEPTED
    for asked in rig.vehicle.calls:
        assert replace(asked, speed_m_s=0.0) == GoTo(47.397742, 8.545594, 520.0, 0.5, 0.0)
        assert isnan(asked.speed_m_s)


def test_pause_is_a_goto_to_nowhere():
    rig = Rig()
    assert rig.ack(192, -1.0, 1.0).result == ACCEPTED
    assert rig.vehicle.calls[0].is_pause


def test_unset_integer_position_is_free():
    rig = Rig()
    assert send_int(rig, 192, 0, param2=1.0, x=INT32_MAX, y=INT32_MAX, z=520.0) == ACCEPTED
    assert isnan(rig.vehicle.calls[0].lat_deg)
    assert rig.vehicle.calls[0].alt_amsl_m == 520.0


def test_goto_may_not_change_mode_without_the_flag():
    rig = Rig()
    rig.update(mode=Mode.MISSION)
    assert rig.ack(192, -1.0, 0.0, 0.0, nan, 47.0, 8.0, 500.0).result == DENIED
    rig.update(mode=Mode.HOLD)
    assert rig.ack(192, 3.0, 0.0, 0.0, nan, 47.0, 8.0, 500.0).result == ACCEPTED
    assert rig.vehicle.calls[0].speed_m_s == 3.0


@pytest.mark.parametrize("position", [(91.0, 8.0), (47.0, 181.0), (47.0, nan), (float("inf"), 8.0)])
def test_position_that_does_not_exist_is_denied(position):
    rig = Rig()
    assert rig.ack(192, -1.0, 1.0, 0.0, nan, *position, 500.0).result == DENIED
    assert rig.vehicle.calls == []


def test_home_here_and_there():
    rig = Rig()
    rig.ack(179, 1.0)
    assert isnan(rig.vehicle.calls[0].lat_deg)
    assert rig.ack(179, 0.0, 0, 0, 0, 47.5, 8.5, 400.0).result == ACCEPTED
    assert rig.vehicle.calls[1] == SetHome(47.5, 8.5, 400.0)
    assert rig.ack(179, 0.0).result == DENIED


def test_home_is_sent_on_request():
    rig = Rig()
    rig.frame(20)
    rig.client.command(410)
    names = [message.name for message in rig.frame()]
    assert names.index("COMMAND_ACK") < names.index("HOME_POSITION")


def test_home_that_is_not_known_is_refused():
    rig = Rig()
    rig.update(home=None)
    assert rig.ack(512, 242).result == TEMPORARILY_REJECTED
    assert rig.ack(410).result == TEMPORARILY_REJECTED


@pytest.mark.parametrize(
    "probe",
    [
        (512, 395),  # REQUEST_MESSAGE of COMPONENT_INFORMATION, which stations took before COMPONENT_METADATA
        (512, 259),
        (511, 9999, 1e6),
        (510, 9999),
        (519, 1.0),  # REQUEST_PROTOCOL_VERSION
        (521, 1.0),  # REQUEST_CAMERA_INFORMATION
        (2504, 0.0),  # REQUEST_VIDEO_STREAM_INFORMATION
    ],
)
def test_probe_for_what_is_not_there_is_unsupported_without_a_text(probe):
    rig = Rig()
    rig.client.command(*probe)
    messages = rig.frame()
    assert [m.fields.result for m in messages if m.name == "COMMAND_ACK"] == [UNSUPPORTED]
    assert texts(messages) == []


def test_message_request_that_means_nothing_is_told_in_one_short_text():
    for params in ((511, 0.0, -1.0), (511, 30.0, nan), (512, float("inf"))):
        rig = Rig()
        rig.client.command(*params)
        reported = [m.fields for m in rig.frame() if m.name == "STATUSTEXT"]
        assert [text.chunk_seq for text in reported] == [0]
        assert reported[0].severity == mavlink.MAV_SEVERITY_NOTICE


def test_prearm_checks_on_request():
    rig = Rig()
    rig.vehicle.arming_problems = ["no GNSS fix", "battery low"]
    assert rig.ack(401).result == TEMPORARILY_REJECTED  # armed
    rig.update(is_armed=False)
    rig.client.command(401)
    messages = rig.frame()
    assert [m.fields.result for m in messages if m.name == "COMMAND_ACK"] == [ACCEPTED]
    assert texts(messages) == ["PreArm: no GNSS fix", "PreArm: battery low"]


def test_reboot_is_the_vehicles_decision():
    rig = Rig()
    rig.vehicle.reply = Reply(Verdict.DENIED, "the vehicle is armed")
    assert rig.ack(246, 1.0).result == DENIED
    assert rig.vehicle.calls == [("reboot",)]
    assert rig.ack(246, 2.0).result == UNSUPPORTED


def test_unknown_command_is_unsupported_with_a_text():
    rig = Rig()
    rig.client.command(84, 20.0)
    messages = rig.frame()
    assert [m.fields.result for m in messages if m.name == "COMMAND_ACK"] == [UNSUPPORTED]
    assert texts(messages) == ["NAV_VTOL_TAKEOFF is not supported"]


def test_every_command_without_a_handler_is_unsupported():
    rig = Rig()
    handled = set(rig.server.command_handlers())
    for command in [*mavlink.enums["MAV_CMD"], 9999, 65535]:
        if command not in handled and command <= 65535:
            ack = rig.ack(command, 1.0)
            assert (ack.command, ack.result) == (command, UNSUPPORTED)
    assert rig.vehicle.calls == []


def test_message_interval_is_set_and_read():
    rig = Rig()
    attitude = 30
    assert rig.ack(511, attitude, 100_000.0).result == ACCEPTED
    rig.frame(10)
    assert len(rig.all("ATTITUDE", 100)) == 20
    rig.client.command(510, attitude)
    messages = rig.frame()
    assert next(m for m in messages if m.name == "MESSAGE_INTERVAL").fields == (attitude, 100_000)
    assert rig.ack(511, attitude, -1.0).result == ACCEPTED
    assert rig.all("ATTITUDE", 100) == []
    rig.client.command(510, attitude)
    assert rig.only("MESSAGE_INTERVAL").interval_us == -1
    assert rig.ack(511, attitude, 0.0).result == ACCEPTED
    assert 39 <= len(rig.all("ATTITUDE", 100)) <= 41


def test_message_interval_holds_on_its_link_only():
    rig = Rig()
    rig.ack(511, 30, -1.0)
    rig.second_client.received()
    rig.frame(50)
    assert sum(message.name == "ATTITUDE" for message in rig.second_client.received()) == 50


def test_repeated_interval_requests_starve_no_stream():
    rig = Rig()
    count = 0
    for i in range(100):
        rig.client.command(511, 30, 100_000.0 + i)
        count += len(rig.all("HOME_POSITION", 10))
    assert count == pytest.approx(10, abs=1)  # 0.5 Hz for 20 s


@pytest.mark.parametrize("params", [(9999, 1e6), (253, 1e6), (nan, 1e6), (1e9, 0)])
def test_interval_of_a_message_we_do_not_send_is_unsupported(params):
    assert Rig().ack(511, *params).result == UNSUPPORTED


def test_heartbeat_cannot_be_stopped():
    rig = Rig()
    assert rig.ack(511, 0.0, -1.0).result == DENIED
    assert len(rig.all("HEARTBEAT", 100)) == 2


def test_longest_interval_fits_the_answer():
    rig = Rig()
    assert rig.ack(511, 30, 1e10).result == ACCEPTED
    rig.client.command(510, 30)
    assert rig.only("MESSAGE_INTERVAL").interval_us == INT32_MAX


def test_loiter_as_a_command_holds():
    rig = Rig()
    assert rig.ack(17, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0).result == ACCEPTED  # pymavlink's set_mode_loiter
    assert rig.vehicle.calls == [ChangeMode(Mode.HOLD)]


def test_banner_is_sent_again_to_who_asks():
    rig = Rig()
    rig.client.command(42428)
    messages = rig.frame()
    assert [m.fields.result for m in messages if m.name == "COMMAND_ACK"] == [ACCEPTED]
    assert any("Honeyguide" in text for text in texts(messages))
    assert not any("Honeyguide" in text for text in texts(rig.second_client.received()))
