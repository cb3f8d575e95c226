"""A flown policy's own part: the vehicle as its flight controller estimates it, and what an action asks for.

In: the estimate, in training from the simulated estimator, in flight from MAVLink telemetry. Out: the first twelve
floats of an ego-centric observation, and the velocity and yaw rate an action in [-1, 1] asks for. Knows nothing of the
simulator: a companion computer launches the same functions.
"""

import warp as wp

from common.rotation import yaw_from_quat
from policies.tasks.layout import Element

wp.set_module_options({"enable_backward": False})

SPEED_MAX_M_S = wp.constant(7.0)  # horizontal, of an action of 1: an owner running 5 m/s must be overtaken; guess
CLIMB_MAX_M_S = wp.constant(2.0)  # guess
YAW_RATE_MAX_RAD_S = wp.constant(2.0)  # guess
SPEED_SCALE = wp.constant(5.0)  # [m/s]
OWN_SIZE = wp.constant(12)  # floats of `write_own`
_HEIGHT_SCALE = wp.constant(5.0)  # [m]
_HEIGHT_MAX = wp.constant(2.0)  # in scales


@wp.struct
class OwnState:
    """The vehicle as its flight controller estimates it."""

    pos_ned: wp.vec3  # [m]
    vel_ned: wp.vec3  # [m/s]
    q_ned_from_frd: wp.quat
    yaw_rate: float  # [rad/s] about down
    height_m: float  # above the ground below, of the range finder
    is_height_valid: int


@wp.struct
class Command:
    """What an action asks the flight controller for: a SET_POSITION_TARGET_LOCAL_NED without position."""

    vel_ned: wp.vec3  # [m/s]
    yaw_rate: float  # [rad/s]


@wp.func
def level_from_ned(v_ned: wp.vec3, yaw: float) -> wp.vec3:
    """A vector in hfrd: level, x along the heading, y right, z down."""
    cos = wp.cos(yaw)
    sin = wp.sin(yaw)
    return wp.vec3(cos * v_ned[0] + sin * v_ned[1], cos * v_ned[1] - sin * v_ned[0], v_ned[2])


@wp.func
def ned_from_level(v_hfrd: wp.vec3, yaw: float) -> wp.vec3:
    """The other way."""
    return level_from_ned(v_hfrd, -yaw)


@wp.func
def action_command(action: wp.vec4, q_ned_from_frd: wp.quat) -> Command:
    """Velocity forward, right and down, and yaw rate, of an action in [-1, 1]."""
    command = Command()
    vel_hfrd = wp.vec3(SPEED_MAX_M_S * action[0], SPEED_MAX_M_S * action[1], CLIMB_MAX_M_S * action[2])
    command.vel_ned = ned_from_level(vel_hfrd, yaw_from_quat(q_ned_from_frd))
    command.yaw_rate = YAW_RATE_MAX_RAD_S * action[3]
    return command


@wp.func
def write3(out: wp.array2d(dtype=float), i: int, at: int, v: wp.vec3) -> None:
    for k in range(3):
        out[i, at + k] = v[k]


@wp.func
def write_own(own: OwnState, last_action: wp.vec4, out: wp.array2d(dtype=float), i: int, at: int) -> None:
    """The vehicle's own motion and its last action into row i from column `at`: the elements of `OWN_ELEMENTS`."""
    yaw = yaw_from_quat(own.q_ned_from_frd)
    down_frd = wp.quat_rotate_inv(own.q_ned_from_frd, wp.vec3(0.0, 0.0, 1.0))
    write3(out, i, at, level_from_ned(own.vel_ned, yaw) / SPEED_SCALE)
    out[i, at + 3] = down_frd[0]
    out[i, at + 4] = down_frd[1]
    out[i, at + 5] = own.yaw_rate / YAW_RATE_MAX_RAD_S
    out[i, at + 6] = 0.0
    if own.is_height_valid == 1:
        out[i, at + 6] = wp.clamp(own.height_m / _HEIGHT_SCALE, 0.0, _HEIGHT_MAX)
    out[i, at + 7] = float(own.is_height_valid)
    for k in range(4):
        out[i, at + 8 + k] = last_action[k]


@wp.kernel(enable_backward=False)
def command_rows(
    actions: wp.array(dtype=wp.vec4), own: wp.array(dtype=OwnState), commands: wp.array(dtype=Command)
) -> None:
    """What the actions ask for, of every row."""
    i = wp.tid()
    commands[i] = action_command(actions[i], own[i].q_ned_from_frd)


ACTIONS = (
    Element("forward_sp", "m/s", float(SPEED_MAX_M_S)),
    Element("right_sp", "m/s", float(SPEED_MAX_M_S)),
    Element("down_sp", "m/s", float(CLIMB_MAX_M_S)),
    Element("yaw_rate_sp", "rad/s", float(YAW_RATE_MAX_RAD_S)),
)
OWN_ELEMENTS = (
    *(Element(f"vel_hfrd_{axis}", "m/s", float(SPEED_SCALE)) for axis in "xyz"),
    Element("down_frd_x", "1"),
    Element("down_frd_y", "1"),
    Element("yaw_rate", "rad/s", float(YAW_RATE_MAX_RAD_S)),
    Element("height", "m", float(_HEIGHT_SCALE)),
    Element("is_height_valid", "1"),
    *(Element(f"last_{element.name}", "1") for element in ACTIONS),
)
