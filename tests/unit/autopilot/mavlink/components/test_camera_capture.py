"""Photos, series and videos over MAVLink, and the card that they are kept on."""

import shutil
from math import degrees

import cv2
import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from tests.unit.autopilot.mavlink.components.payload_rig import (
    ACCEPTED,
    CAMERA,
    CAPTURED,
    DENIED,
    FAILED,
    REJECTED,
    REQUEST,
    START,
    STATUS,
    STOP,
    STORAGE,
    UNSUPPORTED,
    PayloadRig,
    from_camera,
    requested,
)
from tests.unit.autopilot.mavlink.rig import texts


def test_photo_is_a_jpeg_file_and_is_reported_with_its_place(rig, tmp_path):
    rig.to(CAMERA, START, 0, 0, 1, 1)
    messages = rig.frame(2)
    (shot,) = from_camera(messages, "CAMERA_IMAGE_CAPTURED")
    state = rig.vehicle.state
    assert shot.capture_result == 1
    assert shot.image_index == 0
    assert shot.lat == round(state.position.lat_deg * 1e7)
    assert shot.alt == round(state.position.alt_m * 1000)
    assert shot.relative_alt == pytest.approx(30_000, abs=1)
    assert shot.file_url.endswith("/media/IMG_00001.jpg")
    assert cv2.imread(str(tmp_path / "media" / "IMG_00001.jpg")).shape == (360, 640, 3)
    assert len([m for m in messages if m.name == "CAMERA_TRIGGER"]) == 1


def test_repeated_single_photo_command_takes_one_photo(rig):
    assert rig.acks(CAMERA, START, 0, 0, 1, 7) == [(CAMERA, ACCEPTED)]
    assert rig.acks(CAMERA, START, 0, 0, 1, 7) == [(CAMERA, ACCEPTED)]
    rig.frame(20)
    assert rig.acks(CAMERA, START, 0, 0, 1, 8) == [(CAMERA, ACCEPTED)]
    assert rig.vehicle.camera.shot_count == 2


def test_camera_is_busy_while_it_takes_a_photo(rig):
    rig.vehicle.light.is_slow = True
    rig.acks(CAMERA, START, 0, 0, 1, 1)
    (status,) = from_camera(requested(rig, REQUEST, STATUS), "CAMERA_CAPTURE_STATUS")
    assert status.image_status == 1
    rig.frame(20)
    assert rig.acks(CAMERA, START, 0, 0, 1, 2) == [(CAMERA, REJECTED)]
    rig.vehicle.light.deliver()
    assert len(from_camera(rig.frame(2), "CAMERA_IMAGE_CAPTURED")) == 1
    assert rig.acks(CAMERA, START, 0, 0, 1, 2) == [(CAMERA, ACCEPTED)]


def test_series_takes_its_number_of_photos_at_its_interval(rig):
    rig.to(CAMERA, START, 0, 0.5, 3, 0)
    shots = from_camera(rig.frame(150), "CAMERA_IMAGE_CAPTURED")
    assert [shot.image_index for shot in shots] == [0, 1, 2]
    times_ms = [shot.time_boot_ms for shot in shots]
    assert times_ms[1] - times_ms[0] == times_ms[2] - times_ms[1] == 500


def test_endless_series_ends_when_it_is_stopped_and_refuses_another_photo(rig):
    rig.to(CAMERA, START, 0, 1.0, 0, 0)
    rig.frame(60)
    (status,) = from_camera(requested(rig, REQUEST, STATUS), "CAMERA_CAPTURE_STATUS")
    assert status.image_status & 2
    assert status.image_interval == 1.0
    assert rig.acks(CAMERA, START, 0, 0, 1, 1) == [(CAMERA, REJECTED)]
    assert rig.acks(CAMERA, STOP) == [(CAMERA, ACCEPTED)]
    count = rig.vehicle.camera.shot_count
    rig.frame(100)
    assert rig.vehicle.camera.shot_count == count == 2


@pytest.mark.parametrize("params", [(0, 0.01, 0), (0, 3.4e38, 0), (0, float("nan"), 0), (0, 1.0, -1), (7, 1.0, 0)])
def test_impossible_series_is_denied(rig, params):
    assert rig.acks(CAMERA, START, *params) == [(CAMERA, DENIED)]


def test_photo_report_is_sent_again_by_its_index(rig):
    rig.to(CAMERA, START, 0, 0.5, 3, 0)
    rig.frame(150)
    (shot,) = from_camera(requested(rig, REQUEST, CAPTURED, 1), "CAMERA_IMAGE_CAPTURED")
    assert shot.image_index == 1
    (old,) = from_camera(requested(rig, 2002, 2), "CAMERA_IMAGE_CAPTURED")
    assert old.image_index == 2
    assert rig.acks(CAMERA, REQUEST, CAPTURED, 3) == [(CAMERA, DENIED)]


def test_distance_trigger_takes_a_photo_each_so_many_metres(rig):
    state = rig.vehicle.state
    assert rig.acks(CAMERA, mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST, 10, 0, 1) == [(CAMERA, ACCEPTED)]
    shots = []
    for metres in range(36):
        state.estimate = state.estimate._replace(pos_ned=(float(metres), 0.0, -30.0))
        shots += from_camera(rig.frame(1), "CAMERA_IMAGE_CAPTURED")
    assert len(shots) == 4  # at 0, 10, 20 and 30 m
    assert rig.acks(CAMERA, mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST, 0) == [(CAMERA, ACCEPTED)]
    state.estimate = state.estimate._replace(pos_ned=(100.0, 0.0, -30.0))
    assert from_camera(rig.frame(5), "CAMERA_IMAGE_CAPTURED") == []


def test_interval_trigger_and_digicam_control(rig):
    assert rig.acks(1, mavlink.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL, 500) == [(1, ACCEPTED)]
    assert len(from_camera(rig.frame(60), "CAMERA_IMAGE_CAPTURED")) == 3
    assert rig.acks(1, mavlink.MAV_CMD_DO_TRIGGER_CONTROL, 0) == [(1, ACCEPTED)]
    assert from_camera(rig.frame(60), "CAMERA_IMAGE_CAPTURED") == []
    rig.to(1, mavlink.MAV_CMD_DO_DIGICAM_CONTROL, 0, 0, 0, 0, 1)
    assert len(from_camera(rig.frame(2), "CAMERA_IMAGE_CAPTURED")) == 1


def test_video_has_ten_frames_a_second_of_simulated_time(rig, tmp_path):
    start, stop = mavlink.MAV_CMD_VIDEO_START_CAPTURE, mavlink.MAV_CMD_VIDEO_STOP_CAPTURE
    assert rig.acks(CAMERA, start, 0, 5) == [(CAMERA, ACCEPTED)]
    assert rig.acks(CAMERA, start, 0, 0) == [(CAMERA, REJECTED)]
    statuses = from_camera(rig.frame(100), "CAMERA_CAPTURE_STATUS")
    assert len(statuses) == pytest.approx(10, abs=1)
    assert statuses[-1].video_status == 1
    assert statuses[-1].recording_time_ms > 1500
    assert rig.acks(CAMERA, stop, 0) == [(CAMERA, ACCEPTED)]
    assert rig.acks(CAMERA, stop, 0) == [(CAMERA, ACCEPTED)]  # a repeat
    assert from_camera(rig.frame(50), "CAMERA_CAPTURE_STATUS") == []
    video = cv2.VideoCapture(str(tmp_path / "media" / "VID_00001.mp4"))
    frames = []
    while (frame := video.read())[0]:
        frames.append(frame[1])
    video.release()
    assert len(frames) == pytest.approx(21, abs=1)
    assert frames[0].shape == (180, 320, 3)
    assert [path.name for path in (tmp_path / "media").iterdir()] == ["VID_00001.mp4"]


def test_without_a_card_pictures_fail_with_a_reason():
    rig = PayloadRig(None, None)
    rig.to(CAMERA, START, 0, 0, 1, 1)
    messages = rig.frame()
    assert [m.fields.result for m in messages if m.name == "COMMAND_ACK"] == [FAILED]
    assert "Camera: no storage" in texts(messages)
    (storage,) = from_camera(requested(rig, REQUEST, STORAGE), "STORAGE_INFORMATION")
    assert storage.status == mavlink.STORAGE_STATUS_EMPTY
    assert rig.acks(CAMERA, mavlink.MAV_CMD_VIDEO_START_STREAMING, 0) == [(CAMERA, UNSUPPORTED)]
    assert rig.acks(CAMERA, REQUEST, 269) == [(CAMERA, UNSUPPORTED)]


def test_full_card_takes_no_more(rig):
    rig.vehicle.camera.media.used_bytes = rig.vehicle.camera.media.capacity_bytes
    assert rig.acks(CAMERA, START, 0, 0, 1, 1) == [(CAMERA, FAILED)]
    assert rig.acks(CAMERA, mavlink.MAV_CMD_VIDEO_START_CAPTURE, 0) == [(CAMERA, FAILED)]


def test_a_recording_stops_when_the_card_is_full_and_says_so(rig, tmp_path):
    media = rig.vehicle.camera.media
    media.capacity_bytes = 3 << 20
    rig.vehicle.light.has_noise = True  # nothing that could be compressed
    rig.vehicle.camera.settings.set("CAM_VIDRES", 1)
    assert rig.acks(CAMERA, mavlink.MAV_CMD_VIDEO_START_CAPTURE, 0) == [(CAMERA, ACCEPTED)]
    messages = rig.frame(50)
    (growing,) = from_camera(requested(rig, REQUEST, STORAGE), "STORAGE_INFORMATION")
    assert 0.1 < growing.used_capacity < 3.0
    while rig.vehicle.camera.recording is not None:
        assert rig.time_us < 60_000_000, "it goes on and on"
        messages = rig.frame()
    assert texts(messages) == ["Camera: video stopped: the storage is full"]
    (status,) = from_camera(messages, "CAMERA_CAPTURE_STATUS")  # to everyone, though nobody asked for it
    assert status.video_status == 0
    assert status.available_capacity < 0.5
    assert any(m.name == "CAMERA_CAPTURE_STATUS" for m in rig.second_client.received())
    video = tmp_path / "media" / "VID_00001.mp4"
    assert 2 << 20 < video.stat().st_size <= media.capacity_bytes
    assert cv2.VideoCapture(str(video)).read()[0]  # it is complete
    assert rig.acks(CAMERA, mavlink.MAV_CMD_VIDEO_START_CAPTURE, 0) == [(CAMERA, FAILED)]


def test_a_recording_stops_before_the_hosts_disk_is_full(rig, monkeypatch):
    assert rig.acks(CAMERA, mavlink.MAV_CMD_VIDEO_START_CAPTURE, 0) == [(CAMERA, ACCEPTED)]
    rig.frame(20)
    usage = shutil.disk_usage("/")
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage._replace(free=100_000))
    messages = rig.frame(60)
    assert "Camera: video stopped: the storage is full" in texts(messages)
    assert rig.vehicle.camera.recording is None
    assert rig.acks(CAMERA, START, 0, 0, 1, 1) == [(CAMERA, FAILED)]


def test_a_video_whose_folder_has_gone_ends_no_flight(rig, tmp_path):
    assert rig.acks(CAMERA, mavlink.MAV_CMD_VIDEO_START_CAPTURE, 0) == [(CAMERA, ACCEPTED)]
    rig.frame(20)
    shutil.rmtree(tmp_path / "media")
    assert rig.acks(CAMERA, mavlink.MAV_CMD_VIDEO_STOP_CAPTURE, 0) == [(CAMERA, FAILED)]
    assert rig.vehicle.camera.recording is None


def test_formatting_removes_the_pictures_when_it_is_confirmed(rig, tmp_path):
    rig.to(CAMERA, START, 0, 0, 1, 1)
    rig.frame(20)
    (tmp_path / "media" / "notes.txt").write_text("mine")
    assert rig.acks(CAMERA, mavlink.MAV_CMD_STORAGE_FORMAT, 1, 0) == [(CAMERA, DENIED)]
    assert rig.acks(CAMERA, mavlink.MAV_CMD_STORAGE_FORMAT, 1, 1) == [(CAMERA, ACCEPTED)]
    assert [path.name for path in (tmp_path / "media").iterdir()] == ["notes.txt"]
    (storage,) = from_camera(requested(rig, REQUEST, STORAGE), "STORAGE_INFORMATION")
    assert storage.used_capacity == 0.0


def test_zoom_narrows_the_view_of_the_next_photo(rig):
    rig.acks(CAMERA, START, 0, 0, 1, 1)
    rig.to(CAMERA, mavlink.MAV_CMD_SET_CAMERA_ZOOM, mavlink.ZOOM_TYPE_HORIZONTAL_FOV, 30)
    rig.frame(20)
    rig.acks(CAMERA, START, 0, 0, 1, 2)
    wide, narrow = rig.vehicle.light.views
    assert wide.hfov_deg == pytest.approx(80.0)
    assert narrow.hfov_deg == pytest.approx(30.0)


def test_near_focus_blurs_what_is_far(rig, tmp_path):
    rig.acks(CAMERA, START, 0, 0, 1, 1)
    rig.frame(20)
    rig.to(CAMERA, mavlink.MAV_CMD_SET_CAMERA_FOCUS, mavlink.FOCUS_TYPE_METERS, 0.3)
    rig.acks(CAMERA, START, 0, 0, 1, 2)
    sharp, blurred = (cv2.imread(str(tmp_path / "media" / f"IMG_0000{i}.jpg")).astype(float) for i in (1, 2))
    assert blurred.std() < 0.7 * sharp.std()


def test_slow_host_delays_a_series_and_never_stops_the_flight(rig):
    rig.vehicle.light.is_slow = True
    rig.to(CAMERA, START, 0, 0.5, 0, 0)
    assert from_camera(rig.frame(500), "CAMERA_IMAGE_CAPTURED") == []
    assert len(rig.vehicle.light.waiting) == 2
    rig.vehicle.light.deliver()
    shots = from_camera(rig.frame(3), "CAMERA_IMAGE_CAPTURED")
    assert [shot.image_index for shot in shots] == [0, 1]


def test_recording_ends_without_waiting_for_a_frame(rig, tmp_path):
    rig.vehicle.light.is_slow = True
    rig.acks(CAMERA, mavlink.MAV_CMD_VIDEO_START_CAPTURE, 0, 0)
    rig.frame(10)
    assert rig.acks(CAMERA, mavlink.MAV_CMD_VIDEO_STOP_CAPTURE, 0) == [(CAMERA, ACCEPTED)]
    assert rig.vehicle.camera.recording is None


def test_ardupilot_s_clients_get_camera_feedback(tmp_path):
    rig = PayloadRig(tmp_path / "media", dialect=ARDUPILOT)
    rig.vehicle.gimbal.gimbal.point(-0.5, 0.0, is_yaw_locked=True)
    rig.frame(100)
    rig.to(1, START, 0, 0, 1, 1)
    (feedback,) = [m.fields for m in rig.frame(2) if m.name == "CAMERA_FEEDBACK"]
    assert feedback.img_idx == 1
    assert feedback.alt_rel == pytest.approx(30.0)
    assert feedback.pitch == pytest.approx(degrees(-0.5))
    assert feedback.flags == mavlink.CAMERA_FEEDBACK_PHOTO
