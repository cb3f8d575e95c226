"""What the camera tells of itself: information, settings, storage, capture, stream and field of view."""

from math import atan, degrees, isfinite, nan, radians, tan

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.platform import Host
from autopilot.interface.vehicle_state import VehicleState
from autopilot.mavlink.components.camera.camera_definition import MODEL, VENDOR, VERSION
from autopilot.mavlink.telemetry.motion import boot_ms
from autopilot.mavlink.wire.codec import known_type
from autopilot.mavlink.wire.convert import INT32_MAX, degrees_e7, i32, u16, u32, wxyz_from_quat
from autopilot.payload.camera.camera import Camera, Shot
from autopilot.payload.camera.camera_settings import PHOTO_SIZES
from autopilot.payload.camera.lens import FOCAL_LENGTH_MM, SENSOR_HEIGHT_MM, SENSOR_WIDTH_MM
from autopilot.payload.camera.ports import VideoStream
from autopilot.ports import TERRAIN_VALID
from common.attitude import roll_pitch_yaw_of
from common.geodesy import geodetic_from_ned

GIMBAL_DEVICE = 154  # MAV_COMP_ID_GIMBAL
STREAM_ID = 1
_FIRMWARE = 1  # version 1.0.0.0, least byte first
_CARD = 1  # storage id
_MIB = float(1 << 20)
_SPEED_MIB_S = 90.0  # of a common card; guess

_information = known_type("CAMERA_INFORMATION").pack
_settings = known_type("CAMERA_SETTINGS").pack
_storage = known_type("STORAGE_INFORMATION").pack
_capture_status = known_type("CAMERA_CAPTURE_STATUS").pack
_image_captured = known_type("CAMERA_IMAGE_CAPTURED").pack
_feedback = known_type("CAMERA_FEEDBACK").pack
_stream_information = known_type("VIDEO_STREAM_INFORMATION").pack
_stream_status = known_type("VIDEO_STREAM_STATUS").pack
_fov_status = known_type("CAMERA_FOV_STATUS").pack

_CAPABILITIES = (
    mavlink.CAMERA_CAP_FLAGS_CAPTURE_VIDEO
    | mavlink.CAMERA_CAP_FLAGS_CAPTURE_IMAGE
    | mavlink.CAMERA_CAP_FLAGS_HAS_MODES
    | mavlink.CAMERA_CAP_FLAGS_CAN_CAPTURE_IMAGE_IN_VIDEO_MODE
    | mavlink.CAMERA_CAP_FLAGS_CAN_CAPTURE_VIDEO_IN_IMAGE_MODE
    | mavlink.CAMERA_CAP_FLAGS_HAS_IMAGE_SURVEY_MODE
    | mavlink.CAMERA_CAP_FLAGS_HAS_BASIC_ZOOM
    | mavlink.CAMERA_CAP_FLAGS_HAS_BASIC_FOCUS
)


class CameraMessages:
    """Payloads of one camera's messages.

    Args:
        camera: the camera.
        state: the vehicle that carries it.
        host: where its image and its files are.
    """

    def __init__(self, camera: Camera, state: VehicleState, host: Host) -> None:
        self._camera = camera
        self._state = state
        self._host = host

    def information(self) -> bytes:
        """Maker, optics, abilities, and where the definition file is."""
        server = self._host.stream
        width, height = PHOTO_SIZES[-1]
        return _information(
            time_boot_ms=boot_ms(self._state.time_us),
            vendor_name=tuple(VENDOR.encode().ljust(32, b"\0")),
            model_name=tuple(MODEL.encode().ljust(32, b"\0")),
            firmware_version=_FIRMWARE,
            focal_length=FOCAL_LENGTH_MM,
            sensor_size_h=SENSOR_WIDTH_MM,
            sensor_size_v=SENSOR_HEIGHT_MM,
            resolution_h=width,
            resolution_v=height,
            flags=_CAPABILITIES | (mavlink.CAMERA_CAP_FLAGS_HAS_VIDEO_STREAM if self._host.live_stream else 0),
            cam_definition_version=VERSION if server and server.definition_uri else 0,
            cam_definition_uri=server.definition_uri if server else "",
            gimbal_device_id=GIMBAL_DEVICE,
        )

    def settings(self) -> bytes:
        """Mode, zoom and focus."""
        lens = self._camera.lens
        lens.update(self._state.time_us)
        return _settings(boot_ms(self._state.time_us), int(self._camera.mode), lens.zoom_level, lens.focus_level)

    def storage(self) -> bytes:
        """The memory card and the room on it."""
        media, time_ms = self._camera.media, boot_ms(self._state.time_us)
        if media is None:
            return _storage(time_ms, _CARD, 0, mavlink.STORAGE_STATUS_EMPTY)
        return _storage(
            time_boot_ms=time_ms,
            storage_id=_CARD,
            storage_count=1,
            status=mavlink.STORAGE_STATUS_READY,
            total_capacity=media.capacity_bytes / _MIB,
            used_capacity=(media.used_bytes + media.growing_bytes) / _MIB,
            available_capacity=media.free_bytes / _MIB,
            read_speed=_SPEED_MIB_S,
            write_speed=_SPEED_MIB_S,
            type=mavlink.STORAGE_TYPE_MICROSD,
            name="media",
            storage_usage=mavlink.STORAGE_USAGE_FLAG_SET
            | mavlink.STORAGE_USAGE_FLAG_PHOTO
            | mavlink.STORAGE_USAGE_FLAG_VIDEO,
        )

    def capture_status(self) -> bytes:
        """What is being taken."""
        camera = self._camera
        is_interval = camera.trigger.is_active
        return _capture_status(
            time_boot_ms=boot_ms(self._state.time_us),
            image_status=int(camera.is_taking_photo) + 2 * int(is_interval),
            video_status=int(camera.recording is not None),
            image_interval=camera.trigger.interval_us * 1e-6,
            recording_time_ms=u32(camera.recording_ms),
            available_capacity=camera.available_mib,
            image_count=camera.shot_count,
        )

    def image_captured(self, shot: Shot) -> bytes:
        """One photo."""
        url = shot.name if self._host.stream is None else self._host.stream.media_uri(shot.name)
        return _image_captured(
            time_boot_ms=boot_ms(shot.time_us),
            time_utc=self._host.boot_unix_us + shot.time_us,
            camera_id=0,
            lat=degrees_e7(shot.position.lat_deg),
            lon=degrees_e7(shot.position.lon_deg),
            alt=i32(1000.0 * shot.position.alt_m),
            relative_alt=i32(1000.0 * shot.above_home_m),
            q=wxyz_from_quat(shot.q_ned_from_frd),
            image_index=shot.index,
            capture_result=int(shot.is_stored),
            file_url=url,
        )

    def feedback(self, shot: Shot) -> bytes:
        """One photo, as ArduPilot reports it."""
        _, pitch, yaw = roll_pitch_yaw_of(shot.q_ned_from_frd)
        return _feedback(
            time_usec=self._host.boot_unix_us + shot.time_us,
            img_idx=shot.index + 1 & 0xFFFF,
            lat=degrees_e7(shot.position.lat_deg),
            lng=degrees_e7(shot.position.lon_deg),
            alt_msl=shot.position.alt_m,
            alt_rel=shot.above_home_m,
            pitch=degrees(pitch),
            yaw=degrees(yaw) % 360.0,
            foc_len=FOCAL_LENGTH_MM,
            flags=mavlink.CAMERA_FEEDBACK_PHOTO,
            completed_captures=shot.index + 1 & 0xFFFF,
        )

    def stream_information(self, stream: VideoStream) -> bytes:
        """The live image and where it is."""
        return _stream_information(
            stream_id=STREAM_ID,
            count=1,
            # The enumeration has no name for HTTP; the address says what it is.
            type=mavlink.VIDEO_STREAM_TYPE_RTPUDP if stream.is_rtp else mavlink.VIDEO_STREAM_TYPE_RTSP,
            flags=self._stream_flags(stream),
            framerate=stream.rate_hz,
            resolution_h=stream.width,
            resolution_v=stream.height,
            bitrate=stream.bitrate,
            rotation=0,
            hfov=u16(self._camera.lens.hfov_deg),
            name="Camera",
            uri=stream.uri,
            encoding=mavlink.VIDEO_STREAM_ENCODING_H264 if stream.is_rtp else mavlink.VIDEO_STREAM_ENCODING_UNKNOWN,
        )

    def stream_status(self, stream: VideoStream) -> bytes:
        """Whether the live image runs."""
        return _stream_status(
            stream_id=STREAM_ID,
            flags=self._stream_flags(stream),
            framerate=stream.rate_hz,
            resolution_h=stream.width,
            resolution_v=stream.height,
            bitrate=stream.bitrate,
            rotation=0,
            hfov=u16(self._camera.lens.hfov_deg),
        )

    @staticmethod
    def _stream_flags(stream: VideoStream) -> int:
        return mavlink.VIDEO_STREAM_STATUS_FLAGS_RUNNING if stream.is_running else 0

    def fov_status(self) -> bytes:
        """Where the camera is, and the position on the ground in the middle of the image."""
        camera, state = self._camera, self._state
        camera.lens.update(state.time_us)
        q = camera.gimbal.q_ned_from_frd()
        width, height = camera.settings.photo_size
        hfov_deg = camera.lens.hfov_deg
        vfov_deg = degrees(2.0 * atan(tan(radians(0.5 * hfov_deg)) * height / width))
        position, middle = state.position, self._middle_ned()
        image = (nan, nan, nan) if middle is None else geodetic_from_ned(*middle, state.origin)
        return _fov_status(
            time_boot_ms=boot_ms(state.time_us),
            lat_camera=degrees_e7(position.lat_deg),
            lon_camera=degrees_e7(position.lon_deg),
            alt_camera=i32(1000.0 * position.alt_m, INT32_MAX),
            lat_image=degrees_e7(image[0]),
            lon_image=degrees_e7(image[1]),
            alt_image=i32(1000.0 * image[2], INT32_MAX),
            q=wxyz_from_quat(q),
            hfov=hfov_deg,
            vfov=vfov_deg,
        )

    def _middle_ned(self) -> tuple[float, float, float] | None:
        """Where the optical axis meets level ground as high as that below the vehicle [m]; None above the horizon."""
        estimate = self._state.estimate
        ground_d = estimate.terrain_d if estimate.flags & TERRAIN_VALID else self._state.home_ned[2]
        x, y, z, w = self._camera.gimbal.q_ned_from_frd()
        ahead = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)
        north, east, down = estimate.pos_ned
        if ahead[2] < 0.01 or not isfinite(ground_d) or ground_d <= down:
            return None
        distance = (ground_d - down) / ahead[2]
        return north + distance * ahead[0], east + distance * ahead[1], ground_d
