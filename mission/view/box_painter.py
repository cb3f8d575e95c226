"""Boxes, drawn into a camera's image: walls, parked cars, carts, which the cameras' own kernels do not see.

In: a world, and the pose of an eye that has taken its image. Out: pixels, where nothing nearer hides a box, and the
depth of what is seen then.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from common.attitude import Quat
from mission.view import shapes
from mission.view.snapshot_images import Eye
from mission.view.vehicle_model import Floats, Image, matrix
from sim.world.world import WorldMap

NEAREST_M = 0.1  # to the eye: nearer parts are cut off
LIGHT, SUNLIT = 0.7, 0.4  # of a side in the shade, and how much more of one that faces the sun


class BoxPainter:
    """The boxes of one world."""

    def __init__(self, world: WorldMap) -> None:
        self._world = world

    def draw(self, image: Image, eye: Eye, tick: int, place: Floats, q_ned_from_rdf: Quat) -> None:
        """Draws them as they stand at a tick, into the image that the eye has taken from `place` [m]."""
        mesh = shapes.boxes(self._world, tick)
        if mesh is None:
            return
        turn = matrix(q_ned_from_rdf)
        sun_rdf = shapes.SUN_NED @ turn
        corners = ((mesh.vertices - place) @ turn)[mesh.faces]
        for triangle, colour in zip(corners, mesh.colours[mesh.faces[:, 0]], strict=True):
            normal = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
            if normal @ triangle[0] < 0.0 and triangle[:, 2].max() > NEAREST_M:
                normal /= np.linalg.norm(normal)
                light = LIGHT + SUNLIT * max(float(normal @ sun_rdf), 0.0)
                _paint(image, eye, _before(triangle), normal, np.clip(light * colour, 0.0, 255.0).astype(np.uint8))


def _before(triangle: Floats) -> Floats:
    """The part of a triangle that is before the eye (Sutherland and Hodgman 1974, one plane)."""
    kept = []
    for start, end in zip(triangle, np.roll(triangle, -1, axis=0), strict=True):
        if start[2] >= NEAREST_M:
            kept.append(start)
        if (start[2] >= NEAREST_M) != (end[2] >= NEAREST_M):
            kept.append(start + (NEAREST_M - start[2]) / (end[2] - start[2]) * (end - start))
    return np.array(kept)


def _paint(image: Image, eye: Eye, polygon: Floats, normal: Floats, colour: NDArray[np.uint8]) -> None:
    """Fills a polygon where it is the nearest thing."""
    height, width = eye.depth_m.shape
    middle = np.array([0.5 * width, 0.5 * height])
    pixels = polygon[:, :2] * (eye.focal / polygon[:, 2:]) + middle
    low = np.clip(np.floor(pixels.min(axis=0)), 0, (width, height)).astype(int)
    high = np.clip(np.ceil(pixels.max(axis=0)) + 1, 0, (width, height)).astype(int)
    if (low >= high).any():
        return
    covered = np.zeros((high[1] - low[1], high[0] - low[0]), np.uint8)
    cv2.fillConvexPoly(covered, np.rint(np.clip(pixels - low, -1e4, 1e4)).astype(np.int32), 1)
    x = (np.arange(low[0], high[0]) + 0.5 - middle[0]) / eye.focal
    y = (np.arange(low[1], high[1]) + 0.5 - middle[1]) / eye.focal
    slope = normal[0] * x[None, :] + normal[1] * y[:, None] + normal[2]
    depth_m = float(normal @ polygon[0]) / np.minimum(slope, -1.0e-6)  # both are negative: it faces the eye
    where = np.s_[low[1] : high[1], low[0] : high[0]]
    is_nearest = (covered > 0) & (depth_m < eye.depth_m[where])
    image[where][is_nearest] = colour
    eye.depth_m[where][is_nearest] = depth_m[is_nearest]
