"""What a driving policy sees: its own motion, the goal by the flight controller's estimate, and what stands round it.

One source for training and for driving, where a companion computer launches it for one row with what came over MAVLink.
Nothing here knows the simulator. In: `OwnDrive`, the goal's pose, 72 ranges (OBSTACLE_DISTANCE, the first at the nose).
"""

import math

import warp as wp

from autopilot.ports import Estimate
from common.rotation import wrap_pi, yaw_from_quat
from policies.tasks.flight.own_state import level_from_ned
from policies.tasks.layout import Element

wp.set_module_options({"enable_backward": False})

SPEED_MAX_M_S = wp.constant(2.0)  # of an action of 1, either way
YAW_RATE_MAX_RAD_S = wp.constant(1.5)
SECTORS = 72
DIRECTIONS = 36  # each the nearer of two sectors
RANGE_M = wp.constant(10.0)
OWN_SIZE = wp.constant(6)
GOAL_SIZE = wp.constant(12)
STACK = 2  # two frames show how what is round it moves
LAYOUT_VERSION = 1
_DIRECTIONS = wp.constant(DIRECTIONS)
_STILL = wp.constant(0.04)  # of the greatest speed: less asks it to stand, braked
_NEAR_M = wp.constant(2.0)
_MIDDLE_M = wp.constant(6.0)
_FAR_M = wp.constant(30.0)
_HERE_M = wp.constant(0.05)  # nearer than this there is no direction


@wp.struct
class OwnDrive:
    """The vehicle as its flight controller estimates it."""

    pos_ned: wp.vec3  # [m]
    yaw: float  # [rad]
    speed: float  # [m/s] along the nose
    yaw_rate: float  # [rad/s]
    down_frd: wp.vec3


@wp.struct
class DriveCommand:
    """What an action asks for: a speed along the nose and a yaw rate."""

    speed: float  # [m/s] negative backwards
    yaw_rate: float  # [rad/s]


@wp.func
def own_drive(estimate: Estimate) -> OwnDrive:
    """The part of an estimate that is shown."""
    own = OwnDrive()
    own.pos_ned = estimate.pos_ned
    own.yaw = yaw_from_quat(estimate.q_ned_from_frd)
    own.speed = wp.dot(estimate.vel_ned, wp.quat_rotate(estimate.q_ned_from_frd, wp.vec3(1.0, 0.0, 0.0)))
    own.yaw_rate = estimate.omega_frd[2]
    own.down_frd = wp.quat_rotate_inv(estimate.q_ned_from_frd, wp.vec3(0.0, 0.0, 1.0))
    return own


@wp.func
def drive_command(action: wp.vec2) -> DriveCommand:
    """Of an action in [-1, 1]; hardly any speed is none, so that the vehicle can stand."""
    command = DriveCommand()
    if wp.abs(action[0]) > _STILL:
        command.speed = SPEED_MAX_M_S * action[0]
    command.yaw_rate = YAW_RATE_MAX_RAD_S * action[1]
    return command


@wp.func
def write_frame(
    own: OwnDrive,
    last_action: wp.vec2,
    goal: wp.vec3,
    ranges_m: wp.array2d(dtype=float),
    out: wp.array2d(dtype=float),
    i: int,
    at: int,
) -> None:
    """The newest frame of the observation into row i from column `at`.

    Args:
        own: the vehicle.
        last_action: what it was asked for last.
        goal: north, east [m] and heading [rad].
        ranges_m: shape (rows, SECTORS), RANGE_M and more for no return.
        out: observations.
        i: the row.
        at: the first column.
    """
    out[i, at] = own.speed / SPEED_MAX_M_S
    out[i, at + 1] = own.yaw_rate / YAW_RATE_MAX_RAD_S
    out[i, at + 2] = own.down_frd[0]
    out[i, at + 3] = own.down_frd[1]
    out[i, at + 4] = last_action[0]
    out[i, at + 5] = last_action[1]
    north = goal[0] - own.pos_ned[0]
    east = goal[1] - own.pos_ned[1]
    distance = wp.sqrt(north * north + east * east)
    to_goal = level_from_ned(wp.vec3(north, east, 0.0), own.yaw)
    of_goal = level_from_ned(wp.vec3(-north, -east, 0.0), goal[2])
    turn = wrap_pi(goal[2] - own.yaw)
    g = at + OWN_SIZE
    out[i, g] = wp.clamp(to_goal[0] / _NEAR_M, -1.0, 1.0)
    out[i, g + 1] = wp.clamp(to_goal[1] / _NEAR_M, -1.0, 1.0)
    out[i, g + 2] = to_goal[0] / wp.max(distance, _HERE_M)
    out[i, g + 3] = to_goal[1] / wp.max(distance, _HERE_M)
    out[i, g + 4] = wp.min(distance / _MIDDLE_M, 1.0)
    out[i, g + 5] = distance / _FAR_M
    out[i, g + 6] = wp.cos(turn)
    out[i, g + 7] = wp.sin(turn)
    out[i, g + 8] = wp.clamp(of_goal[0] / _NEAR_M, -1.0, 1.0)
    out[i, g + 9] = wp.clamp(of_goal[1] / _NEAR_M, -1.0, 1.0)
    out[i, g + 10] = wp.clamp(of_goal[0] / _MIDDLE_M, -1.0, 1.0)
    out[i, g + 11] = wp.clamp(of_goal[1] / _MIDDLE_M, -1.0, 1.0)
    r = g + GOAL_SIZE
    for k in range(_DIRECTIONS):
        near = wp.min(ranges_m[i, 2 * k], ranges_m[i, 2 * k + 1])
        out[i, r + k] = 1.0 - wp.sqrt(wp.clamp(near / RANGE_M, 0.0, 1.0))


@wp.kernel(enable_backward=False)
def observe_rows(
    estimates: wp.array(dtype=Estimate),
    actions: wp.array(dtype=wp.vec2),
    goals: wp.array(dtype=wp.vec3),
    ranges_m: wp.array2d(dtype=float),
    out: wp.array2d(dtype=float),
) -> None:
    """One frame of every row, shape (rows, elements)."""
    i = wp.tid()
    write_frame(own_drive(estimates[i]), actions[i], goals[i], ranges_m, out, i, 0)


@wp.kernel(enable_backward=False)
def command_rows(actions: wp.array(dtype=wp.vec2), out: wp.array(dtype=DriveCommand)) -> None:
    """What every row's action asks for."""
    i = wp.tid()
    out[i] = drive_command(actions[i])


ACTIONS = (
    Element("speed_sp", "m/s", float(SPEED_MAX_M_S)),
    Element("yaw_rate_sp", "rad/s", float(YAW_RATE_MAX_RAD_S)),
)
FRAME = (
    Element("speed", "m/s", float(SPEED_MAX_M_S)),
    Element("yaw_rate", "rad/s", float(YAW_RATE_MAX_RAD_S)),
    Element("down_frd_x", "1"),
    Element("down_frd_y", "1"),
    *(Element(f"last_{element.name}", "1") for element in ACTIONS),
    Element("goal_hfrd_x_near", "m", float(_NEAR_M), is_goal=True),
    Element("goal_hfrd_y_near", "m", float(_NEAR_M), is_goal=True),
    Element("goal_dir_hfrd_x", "1", is_goal=True),
    Element("goal_dir_hfrd_y", "1", is_goal=True),
    Element("goal_distance_near", "m", float(_MIDDLE_M), is_goal=True),
    Element("goal_distance", "m", float(_FAR_M), is_goal=True),
    Element("goal_heading_cos", "1", is_goal=True),
    Element("goal_heading_sin", "1", is_goal=True),
    Element("from_goal_x_near", "m", float(_NEAR_M), is_goal=True),
    Element("from_goal_y_near", "m", float(_NEAR_M), is_goal=True),
    Element("from_goal_x", "m", float(_MIDDLE_M), is_goal=True),
    Element("from_goal_y", "m", float(_MIDDLE_M), is_goal=True),
    *(Element(f"nearness_{round(math.degrees(2.0 * math.pi / DIRECTIONS)) * k}_deg", "1") for k in range(DIRECTIONS)),
)
