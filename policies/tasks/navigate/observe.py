"""What a navigating policy sees beside its own motion and its ranges: the goal, by the flight controller's estimate.

One function for training and for flight. In: the estimate, the goal. Out: five floats of the observation.
"""

import warp as wp

from common.rotation import yaw_from_quat
from policies.tasks.flight.own_state import OwnState, level_from_ned
from policies.tasks.layout import Element

wp.set_module_options({"enable_backward": False})

GOAL_SIZE = wp.constant(5)  # floats of `write_goal`
_FAR_M = wp.constant(20.0)  # a goal farther off is ahead, no more
_CLIMB_SCALE_M = wp.constant(5.0)
_HERE_M = wp.constant(0.1)  # nearer than this there is no direction

GOAL_ELEMENTS = (
    Element("goal_dir_hfrd_x", "1", is_goal=True),
    Element("goal_dir_hfrd_y", "1", is_goal=True),
    Element("goal_distance_near", "m", float(_FAR_M), is_goal=True),
    Element("goal_distance", "m", 100.0, is_goal=True),
    Element("goal_below", "m", float(_CLIMB_SCALE_M), is_goal=True),
)


@wp.func
def write_goal(own: OwnState, goal_ned: wp.vec3, out: wp.array2d(dtype=float), i: int, at: int) -> None:
    """Direction, distance (once clipped, once not) and height of the goal into row i from column `at`."""
    way = level_from_ned(goal_ned - own.pos_ned, yaw_from_quat(own.q_ned_from_frd))
    level_m = wp.sqrt(way[0] * way[0] + way[1] * way[1])
    out[i, at] = way[0] / wp.max(level_m, _HERE_M)
    out[i, at + 1] = way[1] / wp.max(level_m, _HERE_M)
    out[i, at + 2] = wp.min(level_m / _FAR_M, 1.0)
    out[i, at + 3] = level_m / 100.0
    out[i, at + 4] = wp.clamp(way[2] / _CLIMB_SCALE_M, -2.0, 2.0)
