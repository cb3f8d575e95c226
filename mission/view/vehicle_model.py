"""The vehicle, drawn into a camera's image: filled triangles, far ones first, and see-through discs of what turns.

In: an airframe, then poses of vehicle and camera. Out: pixels, where nothing nearer hides the vehicle.
"""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from common.airframe import Airframe
from common.attitude import Quat
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
        self._frame = shape.body
        angle = np.linspace(0.0, 2.0 * np.pi, DISC_SIDES, endpoint=False)
        radius = shape.blade_radius_m
        disc = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(DISC_SIDES, -0.03)])
        self._discs = (shape.hubs[:, None] + disc).reshape(-1, 3)

    def draw(self, image: Image, eye: Eye, row: Any, place: Floats, q_ned_from_rdf: Quat) -> None:
        """Draws it as it is at a recorded moment, into the image that the eye takes from `place` [m]."""
        turn, body = matrix(q_ned_from_rdf), matrix(row["q_ned_from_frd"])
        points = np.concatenate([self._frame.vertices, self._discs]) @ body.T + (row["pos_ned"] - place)
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
        count = len(self._frame.vertices)
        drawn = image[where].copy()
        self._fill(drawn, points_rdf[:count], pixels[:count])
        veiled = drawn.copy()
        for disc in pixels[count:].reshape(-1, DISC_SIDES, 2):
            cv2.fillPoly(veiled, [disc], DISC_RGB, cv2.LINE_AA)
        cv2.addWeighted(veiled, DISC_OPACITY, drawn, 1.0 - DISC_OPACITY, 0.0, dst=drawn)
        is_nearer = eye.depth_m[where] > distance - NEAREST_M
        image[where][is_nearer] = drawn[is_nearer]

    def _fill(self, image: Image, vertices: Floats, pixels: NDArray[np.int32]) -> None:
        faces = self._frame.faces
        triangles = vertices[faces]
        normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        is_front = (normals * triangles[:, 0]).sum(axis=1) < 0.0
        upward = -normals[:, 1] / np.maximum(np.linalg.norm(normals, axis=1), 1e-9)  # rdf's y is down
        light = (0.75 + 0.45 * upward)[:, None]
        rgb = np.clip(self._frame.colours[faces[:, 0]] * light, 0, 255).tolist()
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
