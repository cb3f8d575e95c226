"""The camera on board as Foxglove gets it: JPEG, pinhole model, coloured points, and where it is mounted.

In: images with depth of what the vehicle carries: the policy's camera, or the one for photos on its gimbal, of which a
small image is rendered. Out: messages in the frame `camera`, whose time stamp is when the image was taken; in real time
it is rendered beside the flight and comes later.
"""

from concurrent.futures import Future
from dataclasses import dataclass
from math import radians, tan

import numpy as np
from foxglove.messages import (
    CameraCalibration,
    CompressedImage,
    FrameTransform,
    PackedElementField,
    PackedElementFieldNumericType,
    PointCloud,
    Pose,
)
from numpy.typing import NDArray

from autopilot.payload.camera.image_file import jpeg_bytes
from autopilot.payload.camera.ports import RawFrame, View
from common.attitude import Quat
from common.image_stream import ImageFrame
from mission.flight_base import FlightBase
from mission.foxglove.channel_set import ChannelSet
from mission.foxglove.channels import CALIBRATION, IMAGE, POINTS
from mission.foxglove.frames import CAMERA, VEHICLE, flu_from_frd, q_flu_from_rdf
from mission.foxglove.messages import quaternion, timestamp, vector
from sim.camera_rig import MOUNT_FRD, CameraRig

IMAGE_SIZE = (320, 180)
IMAGE_PERIOD_US = 500_000  # of the camera for photos: rendering costs more than all else
POINT_STEP = 4  # every fourth pixel of every fourth row
FAR_M = 100.0
NO_RETURN = 255  # of a byte of depth
POINT = np.dtype(
    [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("red", "u1"), ("green", "u1"), ("blue", "u1"), ("alpha", "u1")]
)
_FLOAT, _BYTE = PackedElementFieldNumericType.Float32, PackedElementFieldNumericType.Uint8
_FIELDS = [
    PackedElementField(name=name, offset=offset, type=_FLOAT if offset < 12 else _BYTE)
    for name, offset in zip(POINT.names or (), (0, 4, 8, 12, 13, 14, 15), strict=True)
]


@dataclass(frozen=True, slots=True, eq=False)
class Shot:
    """One image."""

    time_us: int  # when it was taken
    rgb: NDArray[np.uint8]  # (height, width, 3)
    depth_m: NDArray[np.float32]  # (height, width), along the optical axis; inf: nothing
    hfov_deg: float
    q_frd_from_rdf: Quat


class FlightCamera:
    """What a flight's vehicle sees, if it carries a camera.

    Args:
        flight: which.
        has_thread: images of the camera for photos are rendered while the flight goes on.
    """

    def __init__(self, flight: FlightBase, *, has_thread: bool) -> None:
        self._flight = flight
        self._new: Shot | None = None
        self._due_us = 0
        self._pending: tuple[int, View, Future[RawFrame]] | None = None
        self._rig: CameraRig | None = None
        if flight.onboard is not None:
            self._onboard = flight.onboard
            flight.onboard.add_sink(self._seen)
        elif flight.controller.camera is not None:
            self._rig = CameraRig(flight.rig, flight.world, has_thread=has_thread)
        self.mount: list[FrameTransform] = []

    def frame(self, channels: ChannelSet, now_us: int) -> None:
        """Tells of an image if there is a new one."""
        if self._rig is not None and now_us >= self._due_us and self._pending is None and is_heard(channels):
            self._due_us = now_us + IMAGE_PERIOD_US
            view: View = self._flight.controller.camera.view(IMAGE_SIZE, is_smooth=False)
            self._pending = now_us, view, self._rig.capture(view)
        if self._pending is not None and self._pending[2].done():
            (time_us, view, future), self._pending = self._pending, None
            raw = future.result()
            self._new = Shot(time_us, raw.rgb, raw.depth_m, view.hfov_deg, view.q_frd_from_rdf)
        if self._new is not None:
            shot, self._new = self._new, None
            self.mount = [mounted(shot)]
            publish(channels, shot, now_us)

    def close(self) -> None:
        """Ends the thread."""
        if self._rig is not None:
            self._rig.close()

    def _seen(self, frame: ImageFrame) -> None:
        byte = frame.pixels[..., 3].astype(np.float32)
        depth_m = np.where(byte < NO_RETURN, frame.depth_half_m * byte / np.maximum(NO_RETURN - byte, 1.0), np.inf)
        q = self._onboard.q_frd_from_rdf
        time_us = frame.time_us + self._flight.controller.state.boot_us  # of the flight
        self._new = Shot(time_us, frame.pixels[..., :3], depth_m.astype(np.float32), frame.hfov_deg, q)


def is_heard(channels: ChannelSet) -> bool:
    """Whether somebody wants images or what is made from them."""
    found = [channels.open(spec).has_sinks() for spec in (IMAGE, POINTS, CALIBRATION)]  # each is offered
    return any(found)


def publish(channels: ChannelSet, shot: Shot, now_us: int) -> None:
    """An image, the model of its lens, its points."""
    if channels.is_due(IMAGE, now_us):
        channels.log(IMAGE, jpeg_of(shot), now_us)
    if channels.is_due(CALIBRATION, now_us):
        channels.log(CALIBRATION, calibration_of(shot), now_us)
    if channels.is_due(POINTS, now_us):
        channels.log(POINTS, points_of(shot), now_us)


def mounted(shot: Shot) -> FrameTransform:
    """Where the lens is on the vehicle."""
    return FrameTransform(
        timestamp=timestamp(shot.time_us),
        parent_frame_id=VEHICLE,
        child_frame_id=CAMERA,
        translation=vector(flu_from_frd(MOUNT_FRD)),
        rotation=quaternion(q_flu_from_rdf(shot.q_frd_from_rdf)),
    )


def jpeg_of(shot: Shot) -> CompressedImage:
    return CompressedImage(timestamp=timestamp(shot.time_us), frame_id=CAMERA, data=jpeg_bytes(shot.rgb), format="jpeg")


def focal_pixels(shot: Shot) -> float:
    """Focal length [pixel]."""
    width: int = shot.rgb.shape[1]
    return 0.5 * width / tan(radians(0.5 * shot.hfov_deg))


def calibration_of(shot: Shot) -> CameraCalibration:
    """A pinhole without distortion, the axis in the middle."""
    height, width = shot.rgb.shape[:2]
    focal, middle_x, middle_y = focal_pixels(shot), 0.5 * width, 0.5 * height
    return CameraCalibration(
        timestamp=timestamp(shot.time_us),
        frame_id=CAMERA,
        width=width,
        height=height,
        distortion_model="plumb_bob",
        D=[0.0] * 5,
        K=[focal, 0.0, middle_x, 0.0, focal, middle_y, 0.0, 0.0, 1.0],
        R=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        P=[focal, 0.0, middle_x, 0.0, 0.0, focal, middle_y, 0.0, 0.0, 0.0, 1.0, 0.0],
    )


def cloud(shot: Shot) -> NDArray[np.void]:
    """Rows of POINT in the camera's axes: what is nearer than FAR_M; a small image whole."""
    height, width = shot.rgb.shape[:2]
    step = POINT_STEP if width >= IMAGE_SIZE[0] else 1
    rows, columns = np.mgrid[0:height:step, 0:width:step]
    depth_m = shot.depth_m[rows, columns]
    is_near = np.isfinite(depth_m) & (depth_m < FAR_M)
    rows, columns, depth_m = rows[is_near], columns[is_near], depth_m[is_near]
    focal = focal_pixels(shot)
    points = np.zeros(len(depth_m), POINT)
    points["x"] = (columns + 0.5 - 0.5 * width) / focal * depth_m
    points["y"] = (rows + 0.5 - 0.5 * height) / focal * depth_m
    points["z"] = depth_m
    for i, name in enumerate(("red", "green", "blue")):
        points[name] = shot.rgb[rows, columns, i]
    points["alpha"] = 255
    return points


def points_of(shot: Shot) -> PointCloud:
    """The depth image as points."""
    pose = Pose(position=vector((0.0, 0.0, 0.0)), orientation=quaternion((0.0, 0.0, 0.0, 1.0)))
    return PointCloud(
        timestamp=timestamp(shot.time_us),
        frame_id=CAMERA,
        pose=pose,
        point_stride=POINT.itemsize,
        fields=_FIELDS,
        data=cloud(shot).tobytes(),
    )
