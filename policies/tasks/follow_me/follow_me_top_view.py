"""FollowMe from above: trees, the owner and the way they came, the drone, its camera's field of view and its image."""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from policies.tasks.follow_me.observe import HFOV_DEG
from policies.tasks.top_view import GOAL, GOOD, INK, VEHICLE, Canvas, Rgb
from sim.world.world import WorldMap

_HALF_M = 14.0
_CROWN: Rgb = (206, 216, 190)
_TRUNK: Rgb = (112, 88, 62)
_SIGHT_M = 6.0  # how far the edges of the field of view are drawn


def draw(
    world: WorldMap,
    drone_ned: NDArray[np.float64],
    yaw: float,
    owner_ned: NDArray[np.float64],
    owner_heading: float,
    image: NDArray[np.uint8] | None,
    words: str,
    height_px: int,
) -> NDArray[np.uint8]:
    """The surroundings of the drone, north up, RGB, shape (height_px, height_px, 3)."""
    north, east = float(drone_ned[0]), float(drone_ned[1])
    canvas = Canvas((east - _HALF_M, east + _HALF_M), (north - _HALF_M, north + _HALF_M), height_px)
    canvas.grid(5.0)
    for tree in _near(world, north, east):
        canvas.disc((float(tree["east"]), float(tree["north"])), float(tree["crown_radius"]), _CROWN)
    for tree in _near(world, north, east):
        canvas.disc((float(tree["east"]), float(tree["north"])), float(tree["trunk_radius"]), _TRUNK)
    for side in (-1.0, 1.0):
        bearing = yaw + side * np.radians(0.5 * HFOV_DEG)
        canvas.line([(east, north), (east + _SIGHT_M * np.sin(bearing), north + _SIGHT_M * np.cos(bearing))], INK, 1)
    owner = (float(owner_ned[1]), float(owner_ned[0]))
    canvas.disc(owner, 0.3, GOAL)
    canvas.line([owner, (owner[0] + 0.8 * np.sin(owner_heading), owner[1] + 0.8 * np.cos(owner_heading))], GOAL, 2)
    canvas.disc((east, north), 0.3, VEHICLE)
    canvas.line([(east, north), (east + 0.8 * np.sin(yaw), north + 0.8 * np.cos(yaw))], GOOD, 2)
    canvas.text(words)
    if image is not None:
        side_px = height_px // 3
        inset = cv2.resize(np.ascontiguousarray(image[..., :3]), (side_px, side_px), interpolation=cv2.INTER_NEAREST)
        canvas.pixels[-side_px:, :side_px] = inset
    return canvas.pixels


def _near(world: WorldMap, north: float, east: float) -> Any:
    """The trees that can be seen in the image, the nearest to the ground first."""
    trees = world.trees
    reach = _HALF_M + trees["crown_radius"]
    return trees[(np.abs(trees["north"] - north) < reach) & (np.abs(trees["east"] - east) < reach)]
