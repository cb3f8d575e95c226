"""A film of a recorded flight: a camera that flies behind and above the vehicle, and what the vehicle itself sees.

In: a recording and its world. Out: pictures for an mp4, 25 a second. The whole flight is known, so the
camera moves by averages over the time before and after; it comes nearer where a tree would stand before it.
"""

from collections.abc import Iterator
from math import atan2
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from common.airframe import load_airframe
from common.attitude import Quat, product, quat_of
from common.kernels import FRAME_US
from mission.angles import yaw_rad
from mission.view import shapes
from mission.view.moment import Moment
from mission.view.pictures import Eye, onboard_eye
from mission.view.recording import Recording
from sim.world.world import WorldMap

WIDTH, HEIGHT, HFOV_DEG = 480, 270, 75.0
RANGE_M = 150.0
STRIDE = 2  # frames of the flight per picture
PICTURE_S = STRIDE * FRAME_US * 1e-6
INSET = 96  # [pixels] side of the onboard picture
MARGIN = 8
BEHIND_M, ABOVE_M = 3.6, 1.6  # of the vehicle
NEAREST_M = 1.2
ROOM_M = 0.4  # between the camera and a crown
LEAST_HEIGHT_M = 0.6
SMOOTH_S = 0.8  # standard deviation of the averages
ROTOR_OPACITY = 0.35
_RDF_IN_FRD = (0.5, 0.5, 0.5, 0.5)  # a camera that looks ahead
Picture = NDArray[np.uint8]
Floats = NDArray[np.float64]


def film(recording: Recording, world: WorldMap) -> Iterator[Picture]:
    """The pictures, RGB, (HEIGHT, WIDTH, 3), one each PICTURE_S."""
    recording = recording.every(STRIDE)
    eye = Eye(world, WIDTH, HEIGHT, HFOV_DEG, range_m=RANGE_M)
    onboard = onboard_eye(world)
    places, targets = camera_path(recording, world)
    model = VehicleModel(recording)
    for row, place, target in zip(recording.rows, places, targets, strict=True):
        q_ned_from_rdf = looking(place, target)
        eye.look(place, q_ned_from_rdf, row["owner"])
        picture = eye.rgb.copy()
        model.draw(picture, eye, row, place, q_ned_from_rdf)
        onboard.look_from(row)
        inset = cv2.resize(onboard.rgb, (INSET, INSET), interpolation=cv2.INTER_NEAREST)
        picture[MARGIN : MARGIN + INSET, -MARGIN - INSET : -MARGIN] = inset
        corner = (WIDTH - MARGIN - INSET - 1, MARGIN - 1)
        cv2.rectangle(picture, corner, (WIDTH - MARGIN, MARGIN + INSET), (255, 255, 255), 1)
        yield picture


def camera_path(recording: Recording, world: WorldMap) -> tuple[Floats, Floats]:
    """Where the camera is and where it looks at each moment [m], both (moments, 3); a moment each PICTURE_S."""
    rows, sigma = recording.rows, SMOOTH_S / PICTURE_S
    pos = rows["pos_ned"].astype(np.float64)
    has_owner = rows["owner"]["stature_m"] > 0.0
    towards = np.where(has_owner[:, None], rows["owner"]["pos_ned"] - rows["pos_ned"], 0.0)[:, :2].astype(np.float64)
    near = np.linalg.norm(towards, axis=1, keepdims=True)
    yaw = yaw_rad(rows["q_ned_from_frd"].astype(np.float64))
    heading = np.stack([np.cos(yaw), np.sin(yaw)], axis=1)
    ahead = averaged(np.where(near > 0.3, towards / np.maximum(near, 0.3), heading), sigma)
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-6)
    middle = averaged(pos, sigma)
    back = np.column_stack([-BEHIND_M * ahead, np.full(len(rows), -ABOVE_M)])
    length = float(np.hypot(BEHIND_M, ABOVE_M))
    free = np.array([world.ray_hit(m, b / length, length + ROOM_M) for m, b in zip(middle, back, strict=True)])
    room = np.clip(free - ROOM_M, NEAREST_M, length)
    window = int(2 * sigma) | 1
    least = np.lib.stride_tricks.sliding_window_view(np.pad(room, window // 2, mode="edge"), window).min(axis=1)
    place = middle + back * (averaged(least[:, None], sigma) / length)
    highest = -world.height(place[:, 0], place[:, 1]) - LEAST_HEIGHT_M
    place[:, 2] = np.minimum(place[:, 2], highest)
    target = middle + np.column_stack([1.5 * ahead, np.zeros(len(rows))])
    return place, target


def averaged(rows: Floats, sigma: float) -> Floats:
    """Each row's average with its neighbours, weighted by a Gaussian of `sigma` rows; ends are held."""
    reach = int(3 * sigma)
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    padded = np.pad(rows, ((reach, reach), (0, 0)), mode="edge")
    columns = [np.convolve(column, weights / weights.sum(), mode="valid") for column in padded.T]
    return np.stack(columns, axis=1)


def looking(place: Floats, target: Floats) -> Quat:
    """Attitude q_ned_from_rdf of a level camera that looks at a target."""
    north, east, down = (float(value) for value in target - place)
    yaw = atan2(east, north)
    pitch = atan2(-down, float(np.hypot(north, east)))
    return product(quat_of(yaw, pitch), _RDF_IN_FRD)


class VehicleModel:
    """The vehicle, drawn into a picture: filled triangles, far ones first, and see-through rotor discs."""

    def __init__(self, recording: Recording) -> None:
        airframe = load_airframe(recording.config.airframe)
        self._frame = shapes.quadrotor(airframe)
        self._hubs = shapes.hubs_frd(airframe)
        angle = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
        radius = shapes.rotor_radius_m(airframe)
        self._disc = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(24, -0.03)])

    def draw(self, picture: Picture, eye: Eye, row: Any, place: Floats, q_ned_from_rdf: Quat) -> None:
        """Draws it where nothing nearer hides it; depth is compared with that of its middle."""
        turn = matrix(q_ned_from_rdf)
        body = matrix(Moment(row).q_ned_from_frd)

        def seen(points_frd: NDArray[np.float32] | Floats) -> Floats:
            """In the camera's rdf [m]."""
            points: Floats = (points_frd @ body.T + row["pos_ned"] - place) @ turn
            return points

        distance = float(seen(np.zeros((1, 3)))[0, 2])
        if distance < 0.3:
            return
        drawn = picture.copy()
        vertices = seen(self._frame.vertices)
        self._fill(drawn, eye, vertices)
        veiled = drawn.copy()
        for hub in self._hubs:
            cv2.fillPoly(veiled, [_pixels(seen(self._disc + hub), eye)], (210, 214, 220), cv2.LINE_AA)
        cv2.addWeighted(veiled, ROTOR_OPACITY, drawn, 1.0 - ROTOR_OPACITY, 0.0, dst=drawn)
        is_nearer = eye.depth_m > distance - 0.3
        picture[is_nearer] = drawn[is_nearer]

    def _fill(self, picture: Picture, eye: Eye, vertices: Floats) -> None:
        triangles = vertices[self._frame.faces]
        normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        is_front = (normals * triangles[:, 0]).sum(axis=1) < 0.0
        upward = -normals[:, 1] / np.maximum(np.linalg.norm(normals, axis=1), 1e-9)  # rdf's y is down
        for i in np.argsort(-triangles[:, :, 2].mean(axis=1)):
            if is_front[i]:
                colour = self._frame.colours[self._frame.faces[i, 0]] * (0.75 + 0.45 * upward[i])
                rgb = tuple(float(value) for value in np.clip(colour, 0, 255))
                cv2.fillConvexPoly(picture, _pixels(triangles[i], eye), rgb, cv2.LINE_AA)


def _pixels(points_rdf: Floats, eye: Eye) -> NDArray[np.int32]:
    """Where points are seen, as OpenCV takes them."""
    offsets = points_rdf[:, :2] * (eye.focal / np.maximum(points_rdf[:, 2:], 0.05))
    pixels: NDArray[np.int32] = np.rint(offsets + np.array([0.5 * WIDTH, 0.5 * HEIGHT])).astype(np.int32)
    return pixels


def matrix(q: Quat) -> Floats:
    """The rotation matrix of a quaternion x, y, z, w."""
    x, y, z, w = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
