"""What a policy that looks at no image sees and says: one source for training and for flight.

In: the vehicle's own state, the filter of the owner, how near solid things are all round. Out: the observation's
vector, and the velocity that an action leads to: what is asked for goes towards it, not faster than a vehicle can,
whatever a policy says.
"""

import warp as wp

from common.rotation import yaw_from_quat
from policies.tasks.flight.own_state import (
    CLIMB_MAX_M_S,
    OWN_ELEMENTS,
    OWN_SIZE,
    SPEED_MAX_M_S,
    SPEED_SCALE,
    YAW_RATE_MAX_RAD_S,
    Command,
    OwnState,
    action_command,
    level_from_ned,
    write_own,
)
from policies.tasks.follow_me.observe import DECISION_S, IMAGE_SHOWN_OLD_S
from policies.tasks.follow_me.tracked.owner_filter import OwnerFilter, place_now, slowing, velocity_now
from policies.tasks.layout import Element

wp.set_module_options({"enable_backward": False})

SECTORS = 24  # round the vehicle, from its heading clockwise
REACH_M = wp.constant(8.0)  # what is farther away is not told
APPROACH = wp.constant(0.4)  # of the way to what an action says, a decision: some 0.2 s;
CALM_APPROACH = wp.constant(0.15)  # to what is nearly the same, as far as noise reaches, some 0.6 s
CALM_M_S = wp.constant(0.8)
ACCEL_MAX_M_S2 = wp.constant(6.0)  # of the level velocity asked for
_DT_S = wp.constant(DECISION_S)
_SECTORS = wp.constant(SECTORS)
_POSITION_SCALE = wp.constant(3.0)  # [m]
_POSITION_MAX = wp.constant(5.0)  # in scales
_INNOV_SCALE = wp.constant(0.2)  # [m]
_AGE_SCALE = wp.constant(1.0)  # [s]
_AGE_MAX = wp.constant(3.0)
_OWNER_SIZE = wp.constant(18)

TRACKED_ELEMENTS = (
    *OWN_ELEMENTS,
    Element("image_age", "s", float(IMAGE_SHOWN_OLD_S)),
    *(Element(f"seen_owner_pos_hfrd_{axis}", "m", float(_POSITION_SCALE)) for axis in "xyz"),
    *(Element(f"seen_owner_vel_hfrd_{axis}", "m/s", float(SPEED_SCALE)) for axis in "xy"),
    *(Element(f"seen_owner_calm_vel_hfrd_{axis}", "m/s", float(SPEED_SCALE)) for axis in "xy"),
    *(Element(f"seen_owner_innov_hfrd_{axis}", "m", float(_INNOV_SCALE)) for axis in "xy"),
    Element("seen_distance", "m", float(_POSITION_SCALE)),
    Element("seen_bearing_sin", "1"),
    Element("seen_bearing_cos", "1"),
    Element("seen_pos_std", "m"),
    Element("seen_vel_std", "m/s"),
    Element("seen_age", "s", float(_AGE_SCALE)),
    Element("is_owner_seen", "1"),
    Element("has_depth", "1"),
    Element("closing", "m/s", float(SPEED_SCALE)),
    *(Element(f"seen_nearness_{360 // SECTORS * k}_deg", "1") for k in range(SECTORS)),
)


@wp.func
def next_command(last: Command, action: wp.vec4, q_ned_from_frd: wp.quat) -> Command:
    """What is asked for after a decision: the last, and some of the way to what the action says."""
    said = action_command(action, q_ned_from_frd)
    step = said.vel_ned - last.vel_ned
    step = step * (CALM_APPROACH + (APPROACH - CALM_APPROACH) * wp.min(wp.length(step) / CALM_M_S, 1.0))
    longest = _DT_S * ACCEL_MAX_M_S2
    step = step * wp.min(1.0, longest / wp.max(wp.sqrt(step[0] * step[0] + step[1] * step[1]), 1.0e-6))
    out = Command()
    out.vel_ned = last.vel_ned + step
    out.yaw_rate = last.yaw_rate + APPROACH * (said.yaw_rate - last.yaw_rate)
    return out


@wp.func
def command_fractions(command: Command, q_ned_from_frd: wp.quat) -> wp.vec4:
    """A command as the other policies' actions say it, in [-1, 1]."""
    level = level_from_ned(command.vel_ned, yaw_from_quat(q_ned_from_frd))
    return wp.vec4(
        level[0] / SPEED_MAX_M_S,
        level[1] / SPEED_MAX_M_S,
        level[2] / CLIMB_MAX_M_S,
        command.yaw_rate / YAW_RATE_MAX_RAD_S,
    )


@wp.func
def _write_owner(own: OwnState, f: OwnerFilter, out: wp.array2d(dtype=float), i: int, at: int) -> None:
    for k in range(_OWNER_SIZE):
        out[i, at + k] = 0.0
    if f.is_known == 0:
        return
    yaw = yaw_from_quat(own.q_ned_from_frd)
    way = level_from_ned(place_now(f) - own.pos_ned, yaw)
    velocity = velocity_now(f)
    vel = level_from_ned(wp.vec3(velocity[0], velocity[1], 0.0), yaw)
    left = slowing(f.age_s)
    calm = level_from_ned(wp.vec3(left * f.steady.vel[0], left * f.steady.vel[1], 0.0), yaw)
    innov = level_from_ned(wp.vec3(f.innov_ned[0], f.innov_ned[1], 0.0), yaw)
    far_m = wp.max(wp.length(way), 1.0e-3)
    level_m = wp.max(wp.sqrt(way[0] * way[0] + way[1] * way[1]), 1.0e-3)
    shown = way * (wp.min(far_m / _POSITION_SCALE, _POSITION_MAX) / far_m)
    for k in range(3):
        out[i, at + k] = shown[k]
    for k in range(2):
        out[i, at + 3 + k] = vel[k] / SPEED_SCALE
        out[i, at + 5 + k] = calm[k] / SPEED_SCALE
        out[i, at + 7 + k] = wp.clamp(innov[k] / _INNOV_SCALE, -3.0, 3.0)
    out[i, at + 9] = wp.min(far_m / _POSITION_SCALE, _POSITION_MAX)
    out[i, at + 10] = way[1] / level_m
    out[i, at + 11] = way[0] / level_m
    out[i, at + 12] = wp.min(wp.sqrt(wp.max(wp.trace(f.both.pos_var), 0.0)), 3.0)
    out[i, at + 13] = wp.min(wp.sqrt(wp.max(wp.trace(f.both.vel_var), 0.0)), 3.0)
    out[i, at + 14] = wp.min(f.age_s / _AGE_SCALE, _AGE_MAX)
    out[i, at + 15] = 1.0
    own_vel = level_from_ned(own.vel_ned, yaw)
    coming = (own_vel[0] - vel[0]) * way[0] + (own_vel[1] - vel[1]) * way[1]
    out[i, at + 17] = coming / level_m / SPEED_SCALE


@wp.func
def write_tracked(
    own: OwnState,
    last_action: wp.vec4,
    image_age_s: float,
    f: OwnerFilter,
    has_depth: int,
    nearness: wp.array2d(dtype=float),
    out: wp.array2d(dtype=float),
    i: int,
    at: int,
) -> None:
    """The elements of `TRACKED_ELEMENTS`, scaled, into row i from column `at`."""
    write_own(own, last_action, out, i, at)
    out[i, at + OWN_SIZE] = wp.min(image_age_s, IMAGE_SHOWN_OLD_S) / IMAGE_SHOWN_OLD_S
    first = at + OWN_SIZE + 1
    _write_owner(own, f, out, i, first)
    out[i, first + 16] = float(has_depth)
    for k in range(_SECTORS):
        out[i, first + _OWNER_SIZE + k] = nearness[i, k]


@wp.kernel(enable_backward=False)
def observe_tracked_rows(
    own: wp.array(dtype=OwnState),
    commands: wp.array(dtype=Command),
    image_ages_s: wp.array(dtype=float),
    filters: wp.array(dtype=OwnerFilter),
    has_depth: wp.array(dtype=int),
    nearness: wp.array2d(dtype=float),
    out: wp.array2d(dtype=float),
) -> None:
    """The vector of every row: what a companion launches for its one."""
    i = wp.tid()
    last = command_fractions(commands[i], own[i].q_ned_from_frd)
    write_tracked(own[i], last, image_ages_s[i], filters[i], has_depth[i], nearness, out, i, 0)


@wp.kernel(enable_backward=False)
def next_command_rows(
    actions: wp.array(dtype=wp.vec4), own: wp.array(dtype=OwnState), commands: wp.array(dtype=Command)
) -> None:
    """What the actions ask for after what was asked for last, of every row."""
    i = wp.tid()
    commands[i] = next_command(commands[i], actions[i], own[i].q_ned_from_frd)
