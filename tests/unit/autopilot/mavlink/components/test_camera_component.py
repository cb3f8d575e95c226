"""The camera component over MAVLink: heartbeats, information, streams, settings, and who answers what."""

import struct
from itertools import pairwise
from xml.etree import ElementTree as ET

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot.mavlink.components.camera.camera_definition import definition_xml
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.mavlink.server import MavlinkServer
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.payload.camera.camera_settings import SETTINGS
from tests.unit.autopilot.mavlink.components.payload_rig import (
    ACCEPTED,
    CAMERA,
    DENIED,
    GIMBAL,
    INFORMATION,
    REQUEST,
    SETTINGS_ID,
    START,
    STATUS,
    UNSUPPORTED,
    PayloadRig,
    PayloadVehicle,
    Stream,
    from_camera,
    requested,
)
from tests.unit.autopilot.mavlink.rig import Client


def test_each_component_has_a_heartbeat_of_its_own_once_a_second(rig):
    beats = [(m.compid, m.fields.type, m.fields.autopilot) for m in rig.frame(100) if m.name == "HEARTBEAT"]
    assert beats.count((CAMERA, mavlink.MAV_TYPE_CAMERA, mavlink.MAV_AUTOPILOT_INVALID)) == 2
    assert beats.count((GIMBAL, mavlink.MAV_TYPE_GIMBAL, mavlink.MAV_AUTOPILOT_INVALID)) == 2
    assert len(beats) == 9  # the autopilot's: the first of all, then one before and one behind the components'


def test_whoever_begins_to_listen_hears_the_autopilot_first(rig):
    beats = [m.compid for m in rig.frame(500) if m.name == "HEARTBEAT"]
    assert beats == [1, *[1, GIMBAL, CAMERA, 1] * 10]


def test_whoever_begins_to_listen_between_two_frames_hears_the_autopilot_first(rig):
    """pymavlink's wait_heartbeat takes the first heartbeat for the vehicle's."""
    for _ in range(200):
        beats = [m.compid for m in rig.frame() if m.name == "HEARTBEAT"]
        assert not beats or beats[0] == 1


class Door:
    """A link source through which clients come, one per frame."""

    def __init__(self):
        self.links = []
        self.clients = []

    def poll(self, _):
        vehicle_end, client_end = memory_pair(LinkRole.GROUND)
        self.links = [*self.links, vehicle_end]
        self.clients.append(Client(client_end))

    def close(self):
        pass


@pytest.mark.parametrize("dialect", [PX4, ARDUPILOT])
def test_on_every_new_link_the_autopilot_speaks_first(dialect):
    """Whenever in the second of its heartbeats a client comes."""
    door, vehicle = Door(), PayloadVehicle(None, Stream())
    server = MavlinkServer(vehicle, [door], dialect, announces_components=True)
    first = {}
    for time_us in range(5_000_000, 7_000_000, 20_000):
        vehicle.state.time_us = time_us
        server.frame(time_us)
        for i, client in enumerate(door.clients):
            for message in client.received():
                if message.name == "HEARTBEAT":
                    first.setdefault(i, message.compid)
    assert first == dict.fromkeys(range(100), 1)


@pytest.mark.parametrize(("announces", "compids"), [(False, {1}), (True, {1, CAMERA, GIMBAL})])
def test_components_have_no_heartbeat_in_ardupilots_dialect_unless_asked_for(tmp_path, announces, compids):
    rig = PayloadRig(tmp_path / "media", dialect=ARDUPILOT, announces_components=announces)
    assert {m.compid for m in rig.frame(100) if m.name == "HEARTBEAT"} == compids
    rig.to(CAMERA, REQUEST, INFORMATION)
    assert from_camera(rig.frame(), "CAMERA_INFORMATION")


def test_the_autopilot_has_the_last_word_in_every_frame_with_heartbeats(rig):
    """Clients that read the mode from the latest heartbeat, whoever sent it, are right all the time."""
    for _ in range(200):
        beats = [m.compid for m in rig.frame() if m.name == "HEARTBEAT"]
        assert not beats or beats[-1] == 1


def test_sequence_numbers_count_per_component(rig):
    seqs = {}
    for message in rig.frame(200):
        seqs.setdefault(message.compid, []).append(message.seq)
    for numbers in seqs.values():
        assert all((b - a) % 256 == 1 for a, b in pairwise(numbers))


@pytest.mark.parametrize("target", [CAMERA, 0])
def test_information_is_answered_by_the_camera_alone(rig, target):
    rig.to(target, REQUEST, INFORMATION)
    messages = rig.frame()
    acks = [(m.compid, m.fields.result) for m in messages if m.name == "COMMAND_ACK"]
    assert acks == [(CAMERA, ACCEPTED)]
    (information,) = from_camera(messages, "CAMERA_INFORMATION")
    assert bytes(information.vendor_name).rstrip(b"\0") == b"Honeyguide"
    assert information.cam_definition_uri == Stream.definition_uri
    assert information.gimbal_device_id == GIMBAL
    assert information.flags & mavlink.CAMERA_CAP_FLAGS_HAS_VIDEO_STREAM


def test_a_command_to_all_is_acknowledged_once_and_carried_out_once(rig):
    assert rig.acks(0, START, 0, 0, 1, 1) == [(CAMERA, ACCEPTED)]
    assert rig.vehicle.camera.shot_count == 1


def test_the_autopilot_passes_camera_commands_on_and_answers_for_them(rig):
    assert rig.acks(1, START, 0, 0, 1, 1) == [(1, ACCEPTED)]
    assert rig.vehicle.camera.shot_count == 1


def test_what_the_camera_does_not_know_is_refused_by_it_only_if_it_is_addressed(rig):
    arm = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
    assert rig.acks(CAMERA, arm, 1) == [(CAMERA, UNSUPPORTED)]
    assert rig.acks(0, arm, 1) == [(1, ACCEPTED)]
    assert rig.acks(CAMERA, mavlink.MAV_CMD_CAMERA_TRACK_POINT, 0.5, 0.5) == [(CAMERA, UNSUPPORTED)]
    assert rig.acks(101, REQUEST, INFORMATION) == []


@pytest.mark.parametrize(
    ("command", "params", "name"),
    [
        (521, (1,), "CAMERA_INFORMATION"),
        (522, (1,), "CAMERA_SETTINGS"),
        (525, (0, 1), "STORAGE_INFORMATION"),
        (527, (1,), "CAMERA_CAPTURE_STATUS"),
        (2504, (1,), "VIDEO_STREAM_INFORMATION"),
        (2505, (1,), "VIDEO_STREAM_STATUS"),
        (REQUEST, (271,), "CAMERA_FOV_STATUS"),
        (REQUEST, (269, 1), "VIDEO_STREAM_INFORMATION"),
        (REQUEST, (270, 1), "VIDEO_STREAM_STATUS"),
    ],
)
def test_every_message_is_sent_on_request_new_form_and_old(rig, command, params, name):
    assert len(from_camera(requested(rig, command, *params), name)) == 1


def test_mode_zoom_and_focus_are_told_to_everyone(rig):
    rig.to(CAMERA, mavlink.MAV_CMD_SET_CAMERA_MODE, 0, mavlink.CAMERA_MODE_VIDEO)
    assert from_camera(rig.frame(), "CAMERA_SETTINGS")[0].mode_id == mavlink.CAMERA_MODE_VIDEO
    rig.to(CAMERA, mavlink.MAV_CMD_SET_CAMERA_ZOOM, mavlink.ZOOM_TYPE_RANGE, 50)
    assert from_camera(rig.frame(), "CAMERA_SETTINGS")[0].zoomLevel == pytest.approx(50.0)
    rig.to(CAMERA, mavlink.MAV_CMD_SET_CAMERA_FOCUS, mavlink.FOCUS_TYPE_RANGE, 20)
    assert from_camera(rig.frame(), "CAMERA_SETTINGS")[0].focusLevel == pytest.approx(20.0)
    assert rig.acks(CAMERA, mavlink.MAV_CMD_SET_CAMERA_MODE, 0, 9) == [(CAMERA, DENIED)]
    assert rig.acks(CAMERA, mavlink.MAV_CMD_SET_CAMERA_ZOOM, 9, 1) == [(CAMERA, DENIED)]
    assert rig.acks(CAMERA, mavlink.MAV_CMD_RESET_CAMERA_SETTINGS, 1) == [(CAMERA, ACCEPTED)]
    (settings,) = from_camera(requested(rig, REQUEST, SETTINGS_ID), "CAMERA_SETTINGS")
    assert (settings.mode_id, settings.zoomLevel) == (0, 0.0)


def test_stream_is_paused_and_resumed(rig):
    stop, start = mavlink.MAV_CMD_VIDEO_STOP_STREAMING, mavlink.MAV_CMD_VIDEO_START_STREAMING
    assert rig.acks(CAMERA, stop, 1) == [(CAMERA, ACCEPTED)]
    (status,) = from_camera(requested(rig, REQUEST, 270, 1), "VIDEO_STREAM_STATUS")
    assert status.flags == 0
    assert rig.acks(CAMERA, start, 1) == [(CAMERA, ACCEPTED)]
    (information,) = from_camera(requested(rig, REQUEST, 269, 1), "VIDEO_STREAM_INFORMATION")
    assert information.flags == mavlink.VIDEO_STREAM_STATUS_FLAGS_RUNNING
    assert information.uri == Stream.uri
    assert rig.acks(CAMERA, start, 2) == [(CAMERA, DENIED)]


def test_a_ground_station_is_told_which_port_the_video_comes_to():
    video = Stream(uri="5600", is_rtp=True, width=640, height=360, rate_hz=15.0, bitrate=2_000_000)
    rig = PayloadRig(stream=Stream(), video=video)
    (information,) = from_camera(requested(rig, REQUEST, 269, 1), "VIDEO_STREAM_INFORMATION")
    assert (information.type, information.encoding) == (
        mavlink.VIDEO_STREAM_TYPE_RTPUDP,
        mavlink.VIDEO_STREAM_ENCODING_H264,
    )
    assert (information.uri, information.resolution_h, information.resolution_v) == ("5600", 640, 360)
    assert (information.stream_id, information.count, information.bitrate) == (1, 1, 2_000_000)
    (camera,) = from_camera(requested(rig, REQUEST, 259), "CAMERA_INFORMATION")
    assert camera.flags & mavlink.CAMERA_CAP_FLAGS_HAS_VIDEO_STREAM
    assert camera.cam_definition_uri == Stream.definition_uri  # files are served over HTTP as before


def test_everyone_is_told_when_the_video_starts_and_stops(rig):
    for command, flags in (
        (mavlink.MAV_CMD_VIDEO_STOP_STREAMING, 0),
        (mavlink.MAV_CMD_VIDEO_START_STREAMING, mavlink.VIDEO_STREAM_STATUS_FLAGS_RUNNING),
    ):
        rig.to(CAMERA, command, 1)
        (status,) = from_camera(rig.frame(), "VIDEO_STREAM_STATUS")
        assert status.flags == flags
        (reported,) = [m for m in rig.second_client.received() if m.name == "VIDEO_STREAM_STATUS"]
        assert reported.fields.flags == flags


def test_without_video_its_start_is_refused_with_the_option_that_gives_it():
    rig = PayloadRig()
    rig.to(CAMERA, mavlink.MAV_CMD_VIDEO_START_STREAMING, 1)
    messages = rig.frame()
    assert [m.fields.result for m in messages if m.name == "COMMAND_ACK"] == [UNSUPPORTED]
    assert any("--video-port" in m.fields.text for m in messages if m.name == "STATUSTEXT")
    (camera,) = from_camera(requested(rig, REQUEST, 259), "CAMERA_INFORMATION")
    assert not camera.flags & mavlink.CAMERA_CAP_FLAGS_HAS_VIDEO_STREAM


def test_messages_come_at_an_interval_to_who_asked(rig):
    assert rig.acks(CAMERA, 511, STATUS, 200_000) == [(CAMERA, ACCEPTED)]
    assert len(from_camera(rig.frame(50), "CAMERA_CAPTURE_STATUS")) == 5
    assert [m for m in rig.second_client.received() if m.name == "CAMERA_CAPTURE_STATUS"] == []
    rig.acks(CAMERA, 511, STATUS, -1)
    assert from_camera(rig.frame(50), "CAMERA_CAPTURE_STATUS") == []
    assert rig.acks(CAMERA, 511, 30, 200_000) == [(CAMERA, UNSUPPORTED)]


def value(layout, number):
    return struct.pack(layout, number).ljust(128, b"\0")


def test_settings_are_listed_read_and_set_with_an_acknowledgement(rig):
    rig.client.send("PARAM_EXT_REQUEST_LIST", target_component=CAMERA)
    listed = from_camera(rig.frame(), "PARAM_EXT_VALUE")
    assert [item.param_id for item in listed] == [setting.name for setting in SETTINGS]
    assert {item.param_count for item in listed} == {len(SETTINGS)}
    rig.client.send(
        "PARAM_EXT_SET", target_component=CAMERA, param_id="CAM_EV", param_value=value("<f", 1.0), param_type=9
    )
    (ack,) = from_camera(rig.frame(), "PARAM_EXT_ACK")
    assert (ack.param_result, struct.unpack("<f", ack.param_value[:4])[0]) == (mavlink.PARAM_ACK_ACCEPTED, 1.0)
    rig.client.send("PARAM_EXT_REQUEST_READ", target_component=CAMERA, param_id="CAM_EV", param_index=-1)
    (read,) = from_camera(rig.frame(), "PARAM_EXT_VALUE")
    assert struct.unpack("<f", read.param_value[:4])[0] == 1.0
    rig.acks(CAMERA, START, 0, 0, 1, 1)
    assert rig.vehicle.light.views[-1].exposure == 2.0


def test_setting_that_does_not_exist_or_does_not_fit_is_refused(rig):
    for name, number, kind, result in [
        ("CAM_WBMODE", 99, 5, mavlink.PARAM_ACK_VALUE_UNSUPPORTED),
        ("CAM_WBMODE", 1, 9, mavlink.PARAM_ACK_VALUE_UNSUPPORTED),
        ("CAM_NONE", 1, 5, mavlink.PARAM_ACK_FAILED),
    ]:
        rig.client.send(
            "PARAM_EXT_SET", target_component=CAMERA, param_id=name, param_value=value("<I", number), param_type=kind
        )
        (ack,) = from_camera(rig.frame(), "PARAM_EXT_ACK")
        assert ack.param_result == result


def test_vehicle_parameters_are_not_the_camera_s(rig):
    rig.client.send("PARAM_REQUEST_READ", target_component=CAMERA, param_id="MAV_SYS_ID", param_index=-1)
    assert [m for m in rig.frame() if m.name == "PARAM_VALUE"] == []


def test_definition_file_lists_every_setting():
    root = ET.fromstring(definition_xml())
    names = [parameter.get("name") for parameter in root.iter("parameter")]
    assert names == [setting.name for setting in SETTINGS]
    assert all(parameter.find("description").text for parameter in root.iter("parameter"))


def test_field_of_view_names_the_place_in_the_middle_of_the_picture(rig):
    rig.vehicle.gimbal.gimbal.pitch = -0.7853981633974483
    rig.vehicle.gimbal.gimbal.aim.pitch = -0.7853981633974483
    (fov,) = from_camera(requested(rig, REQUEST, 271), "CAMERA_FOV_STATUS")
    state = rig.vehicle.state
    metres = ((fov.lat_image - fov.lat_camera) * 0.0111319) ** 2 + ((fov.lon_image - fov.lon_camera) * 0.00754) ** 2
    height = state.estimate.terrain_d - state.estimate.pos_ned[2]
    assert metres**0.5 == pytest.approx(height, rel=0.02)
    assert fov.vfov == pytest.approx(50.5, abs=0.1)
