"""The vehicle, drawn into a camera's image: filled triangles, far ones first, and see-through discs of what turns.

In: an airframe, then poses of vehicle and camera. Out: pixels, where nothing nearer hides the vehicle.
"""

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from common.airframe import Airframe
from common.attitude import Quat
from mission.log.replay_topic import MOTORS
from mission.view import shapes
from mission.view.snapshot_images import Eye

NEAREST_M = 0.3  # a vehicle nearer than this is not drawn
DISC_OPACITY = 0.35
DISC_SIDES = 24
DISC_RGB = (210, 214, 220)
Image = NDArray[np.uint8]
Floats = NDArray[np.float64]


class VehicleModel:
    """What a vehicle looks like."""

    def __init__(self, airframe: Airframe) -> None:
        shape = shapes.vehicle(airframe)
        self._shape, self._frame = shape, shape.body
        angle = np.linspace(0.0, 2.0 * np.pi, DISC_SIDES, endpoint=False)
        radius = shape.blade_radius_m
        disc = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(DISC_SIDES, -0.03)])
        self._discs = (shape.hubs[:, None] + disc).reshape(-1, 3)

    @property
    def drives(self) -> bool:
        return self._shape.drives

    def draw(
        self,
        image: Image,
        eye: Eye,
        row: Any,
        place: Floats,
        q_ned_from_rdf: Quat,
        turned_rad: Sequence[float] | Floats = (0.0,) * MOTORS,
    ) -> None:
        """Draws it as it is at a recorded moment, into the image that the eye takes from `place` [m].

        Args:
            image: what is drawn into.
            eye: that took it.
            row: the moment.
            place: of the eye.
            q_ned_from_rdf: of the eye.
            turned_rad: how far each wheel has rolled.
        """
        turn, body = matrix(q_ned_from_rdf), matrix(row["q_ned_from_frd"])
        solid = self._solid(float(row["steering_rad"]), turned_rad)
        points = np.concatenate([solid.vertices, self._discs]) @ body.T + (row["pos_ned"] - place)
        points_rdf = points @ turn
        distance = float((row["pos_ned"] - place) @ turn[:, 2])
        if distance < NEAREST_M:
            return
        pixels = _pixels(points_rdf, eye)
        size = np.array(image.shape[1::-1])
        low = np.clip(pixels.min(axis=0) - 1, 0, size)
        high = np.clip(pixels.max(axis=0) + 2, 0, size)
        if (low >= high).any():
            return
        where = np.s_[low[1] : high[1], low[0] : high[0]]
        pixels = pixels - low
        count = len(solid.vertices)
        drawn = image[where].copy()
        _fill(drawn, solid, points_rdf[:count], pixels[:count])
        veiled = drawn.copy()
        for disc in pixels[count:].reshape(-1, DISC_SIDES, 2):
            cv2.fillPoly(veiled, [disc], DISC_RGB, cv2.LINE_AA)
        cv2.addWeighted(veiled, DISC_OPACITY, drawn, 1.0 - DISC_OPACITY, 0.0, dst=drawn)
        is_nearer = eye.depth_m[where] > distance - NEAREST_M
        image[where][is_nearer] = drawn[is_nearer]

    def _solid(self, steering_rad: float, turned_rad: Sequence[float] | Floats) -> shapes.Mesh:
        """The frame with its wheels as they stand, in frd."""
        parts = [self._frame]
        shape = self._shape
        for mesh, hub, is_steered, turned in zip(
            shape.wheels, shape.wheel_hubs, shape.is_steered, turned_rad, strict=False
        ):
            turn = matrix(shapes.wheel_attitude(float(turned), steering_rad if is_steered else 0.0))
            vertices = (mesh.vertices @ turn.T + hub).astype(np.float32)
            parts.append(shapes.Mesh(vertices, mesh.faces, mesh.colours))
        return shapes.joined(parts) if shape.drives else self._frame


def turned_rad(rows: Any) -> Floats:
    """How far motors or wheels have turned until each of the moments of a recording, (moments, motors)."""
    passed_s = np.diff(rows["time_s"], prepend=rows["time_s"][:1])
    turned: Floats = np.cumsum(passed_s[:, None] * rows["motor_speed"].astype(np.float64), axis=0)
    return turned


def _fill(image: Image, mesh: shapes.Mesh, vertices: Floats, pixels: NDArray[np.int32]) -> None:
    faces = mesh.faces
    triangles = vertices[faces]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    is_front = (normals * triangles[:, 0]).sum(axis=1) < 0.0
    upward = -normals[:, 1] / np.maximum(np.linalg.norm(normals, axis=1), 1e-9)  # rdf's y is down
    light = (0.75 + 0.45 * upward)[:, None]
    rgb = np.clip(mesh.colours[faces[:, 0]] * light, 0, 255).tolist()
    for i in np.argsort(-triangles[:, :, 2].mean(axis=1)):
        if is_front[i]:
            cv2.fillConvexPoly(image, pixels[faces[i]], rgb[i], cv2.LINE_AA)


def _pixels(points_rdf: Floats, eye: Eye) -> NDArray[np.int32]:
    """Where points are seen, as OpenCV takes them."""
    height, width = eye.depth_m.shape
    offsets = points_rdf[:, :2] * (eye.focal / np.maximum(points_rdf[:, 2:], 0.05))
    pixels: NDArray[np.int32] = np.rint(offsets + np.array([0.5 * width, 0.5 * height])).astype(np.int32)
    return pixels


def matrix(q: Quat | Any) -> Floats:
    """The rotation matrix of a quaternion x, y, z, w."""
    x, y, z, w = (float(value) for value in q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
