"""Navigate from above: trees, walls, the goal, the vehicle and what its rangefinder tells."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from common.range_sectors import FIRST_EDGE_DEG, RANGE_M, SECTOR_DEG, SECTORS
from policies.tasks.top_view import GOAL, GOOD, INK, OBSTACLE, VEHICLE, Canvas, Rgb
from sim.world.world import WorldMap

CROWN: Rgb = (206, 216, 190)
TRUNK: Rgb = (112, 88, 62)
MOVER: Rgb = (201, 141, 52)
_HALF_M = 20.0


def draw(
    world: WorldMap,
    drone_ned: NDArray[np.float64],
    yaw: float,
    goal_ned: NDArray[np.float64],
    ranges_m: NDArray[np.float32],
    words: str,
    height_px: int,
) -> NDArray[np.uint8]:
    """The surroundings of the drone, north up, RGB, shape (height_px, height_px, 3)."""
    north, east = float(drone_ned[0]), float(drone_ned[1])
    canvas = Canvas((east - _HALF_M, east + _HALF_M), (north - _HALF_M, north + _HALF_M), height_px)
    canvas.grid(5.0)
    plant(canvas, world.trees, north, east, _HALF_M)
    build(canvas, world, 0)
    for k in range(SECTORS):
        if ranges_m[k] < RANGE_M:
            bearing = yaw + np.radians(FIRST_EDGE_DEG + (k + 0.5) * SECTOR_DEG)
            end = (east + float(ranges_m[k]) * np.sin(bearing), north + float(ranges_m[k]) * np.cos(bearing))
            canvas.line([(east, north), end], INK, 1)
    canvas.disc((float(goal_ned[1]), float(goal_ned[0])), 0.5, GOAL)
    way = goal_ned[:2] - drone_ned[:2]
    way = 3.0 * way / max(float(np.linalg.norm(way)), 0.1)
    canvas.line([(east, north), (east + float(way[1]), north + float(way[0]))], GOAL, 1)
    canvas.disc((east, north), 0.37, VEHICLE)
    canvas.line([(east, north), (east + 1.5 * np.sin(yaw), north + 1.5 * np.cos(yaw))], GOOD, 2)
    canvas.text(words)
    return canvas.pixels


def plant(canvas: Canvas, trees: NDArray[np.void], north: float, east: float, half_m: float) -> None:
    """Draws the trees that reach into a square: crowns, then trunks on top, which are what is passed."""
    reach = half_m + trees["crown_radius"]
    near: Any = trees[(np.abs(trees["north"] - north) < reach) & (np.abs(trees["east"] - east) < reach)]
    for tree in near:
        canvas.disc((float(tree["east"]), float(tree["north"])), float(tree["crown_radius"]), CROWN)
    for tree in near:
        canvas.disc((float(tree["east"]), float(tree["north"])), float(tree["trunk_radius"]), TRUNK)


def build(canvas: Canvas, world: WorldMap, tick: int) -> None:
    """Draws the boxes, those that move where they are at a tick."""
    for row, (north, east) in zip(world.boxes.rows, world.boxes.middle(tick), strict=True):
        size = (2.0 * float(row["half_length"]), 2.0 * float(row["half_width"]))
        angle = np.pi / 2 - float(np.arctan2(row["sin_yaw"], row["cos_yaw"]))
        canvas.box((float(east), float(north)), size, angle, MOVER if row["period_ticks"] else OBSTACLE)
