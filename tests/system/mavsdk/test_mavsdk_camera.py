"""MAVSDK's camera and gimbal plugins over UDP, against `honeyguide fly --idle`."""

import time

import cv2
import pytest
from mavsdk import ComponentType, Configuration, ConnectionResult, Mavsdk
from mavsdk.plugins.camera import Camera, CameraError, CameraResult, Mode, Option, PhotosRange, Setting
from mavsdk.plugins.gimbal import ControlMode, Gimbal, GimbalError, GimbalMode, SendMode

from tests.system.commands.receiver import Receiver
from tests.system.mavsdk.test_mavsdk import START_UP_S
from tests.system.vehicle import IdleVehicle, is_free

CAMERA = 100
WAIT_S = 30.0  # wall clock; MAVSDK asks for what it misses every 5 s


def until(condition, what):
    end_s = time.monotonic() + WAIT_S
    while not condition():
        assert time.monotonic() < end_s, f"not {what}"
        time.sleep(0.02)


@pytest.fixture
def stream_port():
    return next(port for port in range(18_800, 18_999) if is_free(port))


@pytest.fixture
def vehicle(tmp_path, stream_port, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))  # MAVSDK keeps definition files
    with IdleVehicle(tmp_path, "--trees", 20, "--stream-port", stream_port, speed=3.0) as vehicle:
        yield vehicle


@pytest.fixture
def system(vehicle):
    mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    assert mavsdk.add_any_connection(f"udpin://127.0.0.1:{vehicle.api_port}") == ConnectionResult.SUCCESS
    system = mavsdk.first_autopilot(START_UP_S)
    assert system is not None
    yield system
    mavsdk.destroy()


def stored(vehicle, suffix):
    return sorted((vehicle.folder / "media").glob(f"*{suffix}"))


def storage_of(camera):
    """The storage, None until MAVSDK has asked for it."""
    try:
        return camera.get_storage(CAMERA)
    except CameraError:
        return None


@pytest.mark.slow
def test_camera_plugin_takes_photos_and_video_and_changes_settings(vehicle, system, stream_port):
    camera = Camera(system)
    shots = []
    camera.subscribe_capture_info(lambda shot, _: shots.append(shot))
    until(lambda: camera.camera_list().cameras, "found")
    (information,) = camera.camera_list().cameras
    assert (information.component_id, information.vendor_name) == (CAMERA, "Honeyguide")

    camera.take_photo(CAMERA)
    until(lambda: len(shots) == 1, "taken")
    assert shots[0].is_success
    assert shots[0].file_url.endswith(f":{stream_port}/media/IMG_00001.jpg")
    assert cv2.imread(str(stored(vehicle, ".jpg")[0])).shape == (360, 640, 3)
    camera.start_photo_interval(CAMERA, 3.0)
    until(lambda: len(shots) == 4, "a series")
    camera.stop_photo_interval(CAMERA)
    with pytest.raises(CameraError) as refused:
        camera.track_point(CAMERA, 0.5, 0.5, 0.1)
    assert refused.value.result == CameraResult.ACTION_UNSUPPORTED

    camera.start_video(CAMERA)
    time.sleep(1.0)
    camera.stop_video(CAMERA)
    (video,) = stored(vehicle, ".mp4")
    assert cv2.VideoCapture(str(video)).read()[1].shape == (180, 320, 3)

    until(lambda: storage_of(camera) is not None, "told of the storage")
    storage = storage_of(camera)
    assert storage.total_storage_mib == pytest.approx(512.0)
    listed = camera.list_photos(CAMERA, PhotosRange.ALL)
    assert len(listed) >= 4

    camera.set_mode(CAMERA, Mode.VIDEO)
    until(lambda: camera.get_mode(CAMERA) == Mode.VIDEO, "in video mode")
    until(lambda: camera.get_possible_setting_options(CAMERA), "offering settings")
    camera.set_setting(CAMERA, Setting("CAM_WBMODE", "", Option("1", ""), False))
    balance = camera.get_setting(CAMERA, Setting("CAM_WBMODE", "", Option("", ""), False))
    assert balance.option.option_description == "Incandescent"

    until(lambda: camera.get_video_stream_info(CAMERA).settings.uri, "told of the stream")
    assert camera.get_video_stream_info(CAMERA).settings.uri == f"http://127.0.0.1:{stream_port}/stream.mjpg"
    camera.stop_video_streaming(CAMERA, 1)
    camera.start_video_streaming(CAMERA, 1)
    for act in (camera.zoom_range, camera.focus_range):
        act(CAMERA, 50.0)
    camera.reset_settings(CAMERA)
    camera.format_storage(CAMERA, 1)
    assert stored(vehicle, ".jpg") == []


@pytest.mark.slow
def test_camera_plugin_starts_and_stops_the_video_that_a_station_watches(tmp_path):
    port = next(port for port in range(15_600, 15_998, 2) if is_free(port) and is_free(port + 1))
    with IdleVehicle(tmp_path, "--trees", 20, "--video-port", port) as vehicle, Receiver(tmp_path, port) as receiver:
        mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
        assert mavsdk.add_any_connection(f"udpin://127.0.0.1:{vehicle.api_port}") == ConnectionResult.SUCCESS
        camera = Camera(mavsdk.first_autopilot(START_UP_S))
        until(lambda: camera.camera_list().cameras, "found")
        until(lambda: camera.get_video_stream_info(CAMERA).settings.uri, "told of the video")
        settings = camera.get_video_stream_info(CAMERA).settings
        assert settings.uri == str(port)
        assert (settings.horizontal_resolution_pix, settings.vertical_resolution_pix) == (640, 360)
        until(lambda: receiver.count > 2, "watched")
        assert receiver.size == (640, 360)
        camera.stop_video_streaming(CAMERA, 1)
        time.sleep(1.0)
        count = receiver.count
        time.sleep(1.0)
        assert receiver.count == count
        camera.start_video_streaming(CAMERA, 1)
        until(lambda: receiver.count > count + 2, "watched again")
        mavsdk.destroy()
        assert (vehicle.folder / "video.sdp").read_text().startswith("v=0")


@pytest.mark.slow
def test_gimbal_plugin_takes_control_and_points(system):
    gimbal = Gimbal(system)
    until(lambda: gimbal.gimbal_list().gimbals, "found")
    (item,) = gimbal.gimbal_list().gimbals
    assert (item.gimbal_manager_component_id, item.gimbal_device_id) == (1, 154)
    gimbal_id = item.gimbal_id

    def forward():
        return gimbal.get_attitude(gimbal_id).euler_angle_forward

    gimbal.take_control(gimbal_id, ControlMode.PRIMARY)
    until(lambda: gimbal.get_control_status(gimbal_id).control_mode == ControlMode.PRIMARY, "in control")
    gimbal.set_angles(gimbal_id, 0.0, -45.0, 30.0, GimbalMode.YAW_FOLLOW, SendMode.ONCE)
    until(lambda: abs(forward().pitch_deg + 45.0) < 0.5 and abs(forward().yaw_deg - 30.0) < 0.5, "pointing")
    gimbal.set_angles(gimbal_id, 0.0, 0.0, 90.0, GimbalMode.YAW_LOCK, SendMode.ONCE)
    until(lambda: abs(gimbal.get_attitude(gimbal_id).euler_angle_north.yaw_deg - 90.0) < 0.5, "pointing east")
    gimbal.set_angular_rates(gimbal_id, 0.0, -10.0, 0.0, GimbalMode.YAW_FOLLOW, SendMode.ONCE)
    until(lambda: forward().pitch_deg < -5.0, "turning")
    gimbal.set_angular_rates(gimbal_id, 0.0, 0.0, 0.0, GimbalMode.YAW_FOLLOW, SendMode.ONCE)
    gimbal.set_roi_location(gimbal_id, 47.397742, 8.545594 + 0.01, 488.0)  # 750 m to the east, level
    until(lambda: abs(gimbal.get_attitude(gimbal_id).euler_angle_north.yaw_deg - 90.0) < 2.0, "looking east")
    gimbal.release_control(gimbal_id)
    until(lambda: gimbal.get_control_status(gimbal_id).control_mode == ControlMode.NONE, "released")
    with pytest.raises(GimbalError):
        gimbal.set_angles(99, 0.0, 0.0, 0.0, GimbalMode.YAW_FOLLOW, SendMode.ONCE)
