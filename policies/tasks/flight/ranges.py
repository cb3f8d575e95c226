"""How far it is from a vehicle to what is solid, all round: truth for teachers and critics.

24 level directions from the true heading clockwise, then up and down. Rays end at `RANGE_M`: what lies beyond it, a
decision of a tenth of a second need not know.
"""

import warp as wp

from common.rotation import yaw_from_quat
from policies.tasks.layout import Element
from sim.advance import RigArrays
from sim.world.world import ray_hit

wp.set_module_options({"enable_backward": False})

LEVEL_RAYS = 24
RAYS = LEVEL_RAYS + 2
RANGE_M = wp.constant(8.0)
_LEVEL_RAYS = wp.constant(LEVEL_RAYS)

RANGE_ELEMENTS = tuple(
    Element(f"nearness_{name}", "1") for name in (*(f"{15 * k}_deg" for k in range(LEVEL_RAYS)), "up", "down")
)


@wp.kernel(enable_backward=False)
def measure_ranges(rig: RigArrays, rows: wp.array(dtype=wp.bool), nearness: wp.array2d(dtype=float)) -> None:
    """1 for touching, 0 for nothing within `RANGE_M`; shape (vehicles, RAYS), of the chosen rows."""
    i, k = wp.tid()
    if not rows[i]:
        return
    body = rig.body[i]
    bearing = yaw_from_quat(body.q_ned_from_frd) + float(k) * 2.0 * wp.pi / float(_LEVEL_RAYS)
    dir_ned = wp.vec3(wp.cos(bearing), wp.sin(bearing), 0.0)
    if k == _LEVEL_RAYS:
        dir_ned = wp.vec3(0.0, 0.0, -1.0)
    if k == _LEVEL_RAYS + 1:
        dir_ned = wp.vec3(0.0, 0.0, 1.0)
    world = rig.worlds[rig.i_world[i]]
    nearness[i, k] = 1.0 - ray_hit(world, body.pos_ned, dir_ned, RANGE_M) / RANGE_M
