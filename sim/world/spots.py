"""The spots of a car park, as people are shown them: numbered, with the heading out of them, and whether they are free.

It is the map of an operator: neither the vehicle nor a policy hears of it.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp

from sim.world.boxes import BoxesMap
from sim.world.building import spot_pose
from sim.world.world import WorldMap

wp.set_module_options({"enable_backward": False})

ROOM_M = 0.4  # from the middle of a spot that is free, as in training
_OVER_GROUND_M = 0.25


@dataclass(frozen=True, slots=True)
class Spot:
    """One spot."""

    number: int  # as people count, from 1
    north_m: float  # of its middle
    east_m: float
    out_rad: float  # heading out of it, into the aisle
    is_free: bool


@wp.kernel(enable_backward=False)
def _spot_poses(seed: int, spot_count: int, poses: wp.array(dtype=wp.vec3)) -> None:
    i = wp.tid()
    poses[i] = spot_pose(seed, spot_count, i)


def spots_of(world: WorldMap) -> list[Spot]:
    """All spots of a world; none if it is no car park."""
    count = world.config.spot_count
    if count == 0:
        return []
    poses = wp.zeros(2 * count, dtype=wp.vec3, device="cpu")
    wp.launch(_spot_poses, 2 * count, [world.config.seed, count], [poses], device="cpu")
    rows = poses.numpy().astype(np.float64)
    standing = BoxesMap(world.boxes.rows[world.boxes.rows["period_ticks"] == 0])  # what moves keeps to the aisle
    down = -np.asarray(world.height(rows[:, 0], rows[:, 1])) - _OVER_GROUND_M
    room_m = standing.distance(np.column_stack([rows[:, :2], down]))
    return [
        Spot(i + 1, float(row[0]), float(row[1]), float(row[2]), bool(room_m[i] > ROOM_M)) for i, row in enumerate(rows)
    ]
