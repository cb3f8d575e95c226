"""Drive from above: what stands and moves, the goal, the rover and what its ranges tell."""

import numpy as np
from numpy.typing import NDArray

from policies.tasks.drive.observe import RANGE_M, SECTORS
from policies.tasks.navigate.navigate_top_view import build, plant
from policies.tasks.top_view import GOAL, GOOD, INK, VEHICLE, Canvas
from sim.world.world import WorldMap

LENGTH_M, WIDTH_M = 0.74, 0.44  # of the hull
_LEAST_HALF_M = 8.0


def draw(
    world: WorldMap,
    tick: int,
    pose: NDArray[np.float64],
    goal: NDArray[np.float64],
    ranges_m: NDArray[np.float32],
    words: str,
    height_px: int,
) -> NDArray[np.uint8]:
    """Rover and goal with what is round them, north up, RGB, shape (height_px, height_px, 3)."""
    middle, half_m = 0.5 * (pose[:2] + goal[:2]), max(_LEAST_HALF_M, 0.7 * float(np.abs(pose[:2] - goal[:2]).max()) + 3)
    north, east = float(middle[0]), float(middle[1])
    canvas = Canvas((east - half_m, east + half_m), (north - half_m, north + half_m), height_px)
    canvas.grid(2.0)
    plant(canvas, world.trees, north, east, half_m)
    build(canvas, world, tick)
    at = (float(pose[1]), float(pose[0]))
    for k in range(SECTORS):
        if ranges_m[k] < RANGE_M:
            bearing = pose[2] + 2.0 * np.pi * k / SECTORS
            canvas.line(
                [at, (at[0] + float(ranges_m[k]) * np.sin(bearing), at[1] + float(ranges_m[k]) * np.cos(bearing))],
                INK,
                1,
            )
    for where, colour in ((goal, GOAL), (pose, VEHICLE)):
        place = (float(where[1]), float(where[0]))
        canvas.box(place, (LENGTH_M, WIDTH_M), np.pi / 2 - float(where[2]), colour)
        nose = (place[0] + 0.5 * np.sin(where[2]), place[1] + 0.5 * np.cos(where[2]))
        canvas.line([place, nose], GOOD, 2)
    canvas.text(words)
    return canvas.pixels
