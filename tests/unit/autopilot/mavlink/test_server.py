from types import SimpleNamespace

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.vehicle_state import LandedState, Mode, Severity
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.mavlink.server import MavlinkServer
from autopilot.mavlink.services.identity import project_version
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.codec import FrameReader, encode
from tests.unit.autopilot.mavlink.rig import HOME, AskedVehicle, Client, Rig, texts

FRAMES_IN_100_MS = 5


def test_heartbeat_comes_at_1_hz():
    rig = Rig()
    assert len(rig.all("HEARTBEAT", 500)) == 10


def test_first_frame_has_a_heartbeat():
    heartbeat = Rig().only("HEARTBEAT")
    assert heartbeat.autopilot == mavlink.MAV_AUTOPILOT_PX4
    assert heartbeat.type == mavlink.MAV_TYPE_QUADROTOR
    assert heartbeat.base_mode & mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    assert heartbeat.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED
    assert heartbeat.custom_mode == 0x03040000
    assert heartbeat.mavlink_version == 3


def test_heartbeat_follows_a_change_in_the_same_frame():
    rig = Rig()
    rig.frame(10)
    rig.update(mode=Mode.LAND, is_armed=False)
    rig.server.heartbeat_now()
    heartbeat = rig.only("HEARTBEAT")
    assert heartbeat.custom_mode == 0x06040000
    assert not heartbeat.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED


def test_system_status_is_in_step_with_the_landed_state():
    rig = Rig()
    for landed_state, is_failsafe, expected in (
        (LandedState.IN_AIR, False, mavlink.MAV_STATE_ACTIVE),
        (LandedState.LANDING, False, mavlink.MAV_STATE_ACTIVE),
        (LandedState.IN_AIR, True, mavlink.MAV_STATE_CRITICAL),
    ):
        rig.update(landed_state=landed_state, is_failsafe=is_failsafe)
        rig.server.heartbeat_now()
        assert rig.all("HEARTBEAT")[-1].system_status == expected


@pytest.mark.parametrize(
    ("dialect", "is_armed", "expected"),
    [
        (PX4, True, mavlink.MAV_STATE_ACTIVE),
        (PX4, False, mavlink.MAV_STATE_STANDBY),
        (ARDUPILOT, True, mavlink.MAV_STATE_STANDBY),  # there active means flying, for ground stations
        (ARDUPILOT, False, mavlink.MAV_STATE_STANDBY),
    ],
)
def test_a_vehicle_on_the_ground_is_active_once_armed_in_px4(dialect, is_armed, expected):
    rig = Rig(dialect=dialect)
    rig.update(landed_state=LandedState.ON_GROUND, is_armed=is_armed)
    rig.server.heartbeat_now()
    assert rig.all("HEARTBEAT")[-1].system_status == expected


def test_clocks_that_clients_see_begin_again_with_a_restart():
    rig = Rig()
    rig.frame(100)
    rig.update(boot_us=rig.time_us)
    messages = {message.name: message.fields for message in rig.frame(300)}
    rig.client.send("TIMESYNC", tc1=0, ts1=7)
    rig.client.send("PING", time_usec=5_000_123, seq=1)
    messages |= {message.name: message.fields for message in rig.frame()}
    assert 5_000 < messages["ATTITUDE"].time_boot_ms < 6_100
    assert 5_000 < messages["SYSTEM_TIME"].time_boot_ms < 6_100
    assert messages["SYSTEM_TIME"].time_unix_usec > 1_700_000_000_000_000  # the date stays
    assert 3_000_000 < messages["ESTIMATOR_STATUS"].time_usec < 6_100_000
    assert messages["GPS_RAW_INT"].time_usec == 0  # a fix from before
    assert 5_000_000_000 < messages["TIMESYNC"].tc1 < 6_100_000_000
    assert (messages["TIMESYNC"].ts1, messages["PING"].time_usec) == (7, 5_000_123)  # the client's own


def test_lift_off_is_told_in_the_same_frame():
    rig = Rig()
    rig.update(landed_state=LandedState.ON_GROUND)
    rig.frame(55)
    rig.update(landed_state=LandedState.TAKEOFF)
    messages = {message.name: message.fields for message in rig.frame()}
    assert messages["HEARTBEAT"].system_status == mavlink.MAV_STATE_ACTIVE
    assert messages["EXTENDED_SYS_STATE"].landed_state == LandedState.TAKEOFF


def test_ground_station_connects_without_silence():
    """QGroundControl's sequence: each request is answered within 100 ms, ack before message."""
    rig = Rig()
    rig.client.send("HEARTBEAT", type=mavlink.MAV_TYPE_GCS, autopilot=mavlink.MAV_AUTOPILOT_INVALID)
    assert any("Honeyguide" in text for text in texts(rig.frame()))

    rig.client.command(mavlink.MAV_CMD_REQUEST_MESSAGE, 148)
    names = [message.name for message in rig.frame(FRAMES_IN_100_MS)]
    assert names.index("COMMAND_ACK") < names.index("AUTOPILOT_VERSION")
    rig.client.command(mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, 1)
    names = [message.name for message in rig.frame(FRAMES_IN_100_MS)]
    assert names.index("COMMAND_ACK") < names.index("AUTOPILOT_VERSION")

    rig.client.command(mavlink.MAV_CMD_REQUEST_MESSAGE, 397)
    names = [message.name for message in rig.frame(FRAMES_IN_100_MS)]
    assert names.index("COMMAND_ACK") < names.index("COMPONENT_METADATA")
    for msg_id in (300, 395, 280, 259):  # protocol, older metadata, gimbal, camera
        rig.client.command(mavlink.MAV_CMD_REQUEST_MESSAGE, msg_id, 0)
        ack = rig.only("COMMAND_ACK", FRAMES_IN_100_MS)
        assert (ack.command, ack.result) == (512, mavlink.MAV_RESULT_UNSUPPORTED)
    for command in (519, 521, 2510):
        rig.client.command(command)
        assert rig.only("COMMAND_ACK", FRAMES_IN_100_MS).result == mavlink.MAV_RESULT_UNSUPPORTED

    rig.client.send("PARAM_REQUEST_LIST")
    assert len(rig.all("PARAM_VALUE", FRAMES_IN_100_MS)) > 50
    for mission_type in (0, 1, 2):
        rig.client.send("MISSION_REQUEST_LIST", target_component=1, mission_type=mission_type)
        assert rig.only("MISSION_COUNT", FRAMES_IN_100_MS)[2:] == (0, mission_type)


def test_autopilot_version_says_who_we_are():
    rig = Rig()
    rig.client.command(mavlink.MAV_CMD_REQUEST_MESSAGE, 148)
    version = rig.only("AUTOPILOT_VERSION")
    assert version.flight_sw_version >> 16 > 0x0104  # QGroundControl calls PX4 before 1.4.1 too old
    ours = tuple(int(part) for part in project_version().split(".")[:3])
    assert tuple(version.flight_custom_version[2::-1]) == ours  # where MAVSDK reads the vendor's version
    for bit in (
        mavlink.MAV_PROTOCOL_CAPABILITY_MAVLINK2,
        mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_INT,
        mavlink.MAV_PROTOCOL_CAPABILITY_COMMAND_INT,
        mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE,
        mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY,
        mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE,
        mavlink.MAV_PROTOCOL_CAPABILITY_FTP,
    ):
        assert version.capabilities & bit
    assert version.uid != 0


def test_system_id_is_the_parameter():
    vehicle = AskedVehicle()
    vehicle.params.set("MAV_SYS_ID", 7)
    vehicle_end, client_end = memory_pair()
    MavlinkServer(vehicle, [vehicle_end]).frame(20_000)
    assert {message.sysid for message in Client(client_end).received()} == {7}


def test_message_for_another_vehicle_gets_no_answer():
    rig = Rig()
    rig.client.send("COMMAND_LONG", target_system=2, command=400, param1=1.0)
    rig.client.send("COMMAND_LONG", target_component=100, command=400, param1=1.0)
    assert rig.all("COMMAND_ACK", 5) == []
    assert rig.vehicle.calls == []


def test_answer_carries_the_senders_ids_and_stays_on_its_link():
    rig = Rig()
    rig.second_client.command(9999)
    assert rig.all("COMMAND_ACK", 2) == []
    (ack,) = [message for message in rig.second_client.received() if message.name == "COMMAND_ACK"]
    assert (ack.fields.target_system, ack.fields.target_component) == (245, 191)


def test_own_frames_that_come_back_are_ignored():
    rig = Rig()
    rig.client.link.send(encode("COMMAND_LONG", 1, 1, 0, target_system=1, command=400, param1=1.0))
    rig.frame()
    assert rig.vehicle.calls == []


def test_companion_with_our_system_id_is_heard():
    rig = Rig()
    rig.client.link.send(encode("COMMAND_LONG", 1, 191, 0, target_system=1, command=400, param1=1.0))
    rig.frame()
    assert rig.vehicle.calls == [("arm", False)]


def test_ping_request_is_answered_and_an_answer_is_not():
    rig = Rig()
    rig.client.send("PING", time_usec=77, seq=5)
    ping = rig.only("PING")
    assert (ping.time_usec, ping.seq, ping.target_system) == (77, 5, 255)
    rig.client.send("PING", time_usec=77, seq=6, target_system=1, target_component=1)
    assert rig.all("PING") == []


def test_timesync_request_is_answered_in_simulated_time():
    rig = Rig()
    rig.client.send("TIMESYNC", tc1=0, ts1=123)
    answer = rig.only("TIMESYNC")
    assert (answer.tc1, answer.ts1) == (rig.time_us * 1000, 123)
    rig.client.send("TIMESYNC", tc1=5, ts1=123)
    assert rig.all("TIMESYNC") == []


def test_what_another_component_says_is_logged_unless_it_says_too_much():
    rig, logged = Rig(), []
    rig.vehicle.host.log_stream = SimpleNamespace(statustext=lambda severity, text: logged.append((severity, text)))
    for sysid, compid, severity in ((1, 191, 5), (1, 191, 200), (255, 190, 5), (1, 1, 5)):
        rig.client.link.send(encode("STATUSTEXT", sysid, compid, 0, severity=severity, text="guard: height"))
        rig.frame()
    assert logged == [(Severity.NOTICE, "guard: height"), (Severity.DEBUG, "guard: height")]
    for _ in range(200):
        rig.client.link.send(encode("STATUSTEXT", 1, 191, 0, severity=5, text="again"))
        rig.frame()
    assert 50 <= len(logged) <= 80


def test_long_text_is_sent_in_chunks():
    rig = Rig()
    text = "PreArm: " + "too few satellites, " * 8
    rig.server.statustext(Severity.CRITICAL, text)
    messages = rig.frame()
    chunks = [message.fields for message in messages if message.name == "STATUSTEXT"]
    assert [chunk.chunk_seq for chunk in chunks] == [0, 1, 2, 3]
    assert len({chunk.id for chunk in chunks}) == 1
    assert chunks[0].id != 0
    assert texts(messages) == [text]


def test_short_text_is_one_message():
    rig = Rig()
    rig.server.statustext(Severity.INFO, "x" * 50)
    chunk = rig.only("STATUSTEXT")
    assert (chunk.severity, chunk.id, chunk.chunk_seq, chunk.text) == (6, 0, 0, "x" * 50)


def test_events_are_announced_on_every_link():
    rig = Rig()
    rig.frame(3)
    rig.second_client.received()
    rig.server.mission_item_reached(3)
    rig.server.mission_current_changed(4)
    rig.server.home_changed()
    for messages in (rig.frame(), rig.second_client.received()):
        events = {message.name: message.fields for message in messages}
        assert events["MISSION_ITEM_REACHED"].seq == 3
        assert events["MISSION_CURRENT"].seq == 4
        assert events["HOME_POSITION"].altitude == HOME.alt_m * 1000


def test_log_gets_received_frames_answers_and_the_first_links_streams():
    rig = Rig()
    rig.frame(50)
    names = [frame.kind.name for _, data in rig.log for frame in FrameReader().feed(data)]
    assert names.count("ATTITUDE") == 20
    rig.log.clear()
    rig.second_client.command(9999)
    rig.frame()
    names = [frame.kind.name for _, data in rig.log for frame in FrameReader().feed(data)]
    assert "COMMAND_LONG" in names
    assert "COMMAND_ACK" in names
    assert {time_us for time_us, _ in rig.log} == {rig.time_us}


def test_absent_services_answer_at_once():
    rig = Rig()
    rig.client.send("LOG_REQUEST_LIST", target_component=1, start=0, end=0xFFFF)
    assert rig.only("LOG_ENTRY").num_logs == 0
    rig.client.send("LOG_REQUEST_DATA", target_component=1, id=3, ofs=90, count=90)
    assert rig.only("LOG_DATA")[:3] == (3, 90, 0)
    rig.client.send("SET_GPS_GLOBAL_ORIGIN", latitude=1, longitude=2, altitude=3)
    assert rig.all("GPS_GLOBAL_ORIGIN")[-1].latitude == round(HOME.lat_deg * 1e7)


def test_closing_closes_the_links():
    closed = []

    class Door:
        role = LinkRole.GROUND
        keeps_datagrams = True

        def close(self) -> None:
            closed.append(self)

    MavlinkServer(AskedVehicle(), [Door()]).close()
    assert len(closed) == 1
