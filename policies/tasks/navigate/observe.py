"""What a navigating policy sees: its own motion, the goal by the flight controller's estimate, and its ranges.

One source for training and for flight, where a companion computer launches it for one row with what came over MAVLink.
Nothing here knows the simulator.
"""

import warp as wp

from common.range_sectors import BEAM_ELEVATIONS_DEG, RANGE_M, RANGES, SECTORS
from common.rotation import yaw_from_quat
from policies.tasks.flight.own_state import OWN_ELEMENTS, OWN_SIZE, OwnState, level_from_ned, write_own
from policies.tasks.layout import Element

wp.set_module_options({"enable_backward": False})

LAYOUT_VERSION = 2  # 1: ranges were levelled by the truth
GOAL_MAX_M, ROVER_GOAL_MAX_M = 85.0, 45.0  # the farthest goals of training
GOAL_SIZE = wp.constant(5)  # floats of `write_goal`
RAY_STACK = 2  # frames in a stack of an observation with ranges
DEPTH_CHANNELS = ("nearness",)  # of the image of an observation without
_FAR_M = wp.constant(20.0)  # a goal farther off is ahead, no more
_CLIMB_SCALE_M = wp.constant(5.0)
_HERE_M = wp.constant(0.1)  # nearer than this there is no direction
_RANGES = wp.constant(RANGES)
_RANGE_M = wp.constant(RANGE_M)

GOAL_ELEMENTS = (
    Element("goal_dir_hfrd_x", "1", is_goal=True),
    Element("goal_dir_hfrd_y", "1", is_goal=True),
    Element("goal_distance_near", "m", float(_FAR_M), is_goal=True),
    Element("goal_distance", "m", 100.0, is_goal=True),
    Element("goal_below", "m", float(_CLIMB_SCALE_M), is_goal=True),
)
RANGE_ELEMENTS = (
    *(Element(f"nearness_{5 * k - 118:+d}_deg", "1") for k in range(SECTORS)),  # middles are half a degree on
    *(Element(f"nearness_ahead_{angle:+.0f}_deg", "1") for angle in BEAM_ELEVATIONS_DEG),
)


def frame_elements(*, has_rays: bool) -> tuple[Element, ...]:
    """What `write_frame` writes."""
    return (*OWN_ELEMENTS, *GOAL_ELEMENTS, *(RANGE_ELEMENTS if has_rays else ()))


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


@wp.func
def write_frame(
    has_rays: int,
    own: OwnState,
    last_action: wp.vec4,
    goal_ned: wp.vec3,
    ranges_m: wp.array2d(dtype=float),
    out: wp.array2d(dtype=float),
    i: int,
    at: int,
) -> None:
    """The newest frame of the observation into row i from column `at`; nearness is 1 for touching, 0 for no return."""
    write_own(own, last_action, out, i, at)
    write_goal(own, goal_ned, out, i, at + OWN_SIZE)
    if has_rays == 1:
        for k in range(_RANGES):
            out[i, at + OWN_SIZE + GOAL_SIZE + k] = 1.0 - ranges_m[i, k] / _RANGE_M


@wp.kernel(enable_backward=False)
def observe_rows(
    has_rays: int,
    own: wp.array(dtype=OwnState),
    actions: wp.array(dtype=wp.vec4),
    goals_ned: wp.array(dtype=wp.vec3),
    ranges_m: wp.array2d(dtype=float),
    out: wp.array2d(dtype=float),
) -> None:
    """One frame of every row, shape (rows, elements)."""
    i = wp.tid()
    write_frame(has_rays, own[i], actions[i], goals_ned[i], ranges_m, out, i, 0)
