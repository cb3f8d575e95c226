"""What teachers and critics see: the truth, which no policy in flight is shown.

The vehicle's own true motion as `write_own` writes it, where the owner truly is, whether anything hides them, and how
near everything solid is, all round.
"""

import warp as wp

from policies.tasks.flight.own_state import OWN_ELEMENTS, OWN_SIZE, SPEED_SCALE, OwnState, write3, write_own
from policies.tasks.flight.ranges import RANGE_ELEMENTS, RANGES
from policies.tasks.follow_me.owner_visibility import ROOM_MAX_M, Sight
from policies.tasks.layout import Element
from sim.truth import Truth

wp.set_module_options({"enable_backward": False})

_POSITION_SCALE = wp.constant(5.0)  # [m]
_POSITION_MAX = wp.constant(4.0)  # in scales
_DISTANCE_SCALE = wp.constant(3.0)  # [m]
_UNSEEN_SCALE = wp.constant(5.0)  # [s]
_RANGES = wp.constant(RANGES)

PRIVILEGED_ELEMENTS = (
    *(Element(f"true_{e.name}", e.unit, e.scale) for e in OWN_ELEMENTS),
    *(Element(f"true_owner_pos_hfrd_{axis}", "m", float(_POSITION_SCALE)) for axis in "xyz"),
    *(Element(f"true_owner_vel_hfrd_{axis}", "m/s", float(SPEED_SCALE)) for axis in "xyz"),
    Element("true_distance", "m", float(_DISTANCE_SCALE)),
    Element("true_bearing_sin", "1"),
    Element("true_bearing_cos", "1"),
    Element("is_owner_in_view", "1"),
    Element("is_owner_free", "1"),
    Element("unseen", "s", float(_UNSEEN_SCALE)),
    Element("room", "m", float(ROOM_MAX_M)),
    *RANGE_ELEMENTS,
)


@wp.func
def true_own(truth: Truth) -> OwnState:
    """The vehicle as it truly is."""
    own = OwnState()
    own.pos_ned = truth.pos_ned
    own.vel_ned = truth.vel_ned
    own.q_ned_from_frd = truth.q_ned_from_frd
    own.yaw_rate = wp.quat_rotate(truth.q_ned_from_frd, truth.omega_frd)[2]
    own.height_m = truth.height_agl_m
    own.is_height_valid = 1
    return own


@wp.func
def write_privileged(
    truth: Truth,
    sight: Sight,
    unseen_s: float,
    last_action: wp.vec4,
    nearness: wp.array2d(dtype=float),
    out: wp.array2d(dtype=float),
    i: int,
    first: int,
) -> None:
    """The elements of `PRIVILEGED_ELEMENTS`, scaled, into row i from column `first`."""
    write_own(true_own(truth), last_action, out, i, first)
    at = first + OWN_SIZE
    position = sight.position_hfrd / _POSITION_SCALE
    far = wp.length(position)
    if far > _POSITION_MAX:
        position = position * (_POSITION_MAX / far)
    write3(out, i, at, position)
    write3(out, i, at + 3, sight.vel_hfrd / SPEED_SCALE)
    out[i, at + 6] = wp.min(sight.distance_m, _POSITION_MAX * _POSITION_SCALE) / _DISTANCE_SCALE
    out[i, at + 7] = wp.sin(sight.bearing_rad)
    out[i, at + 8] = wp.cos(sight.bearing_rad)
    out[i, at + 9] = float(sight.is_in_view)
    out[i, at + 10] = float(sight.is_free)
    out[i, at + 11] = wp.min(unseen_s / _UNSEEN_SCALE, 2.0)
    out[i, at + 12] = sight.room_m / ROOM_MAX_M
    for k in range(_RANGES):
        out[i, at + 13 + k] = nearness[i, k]
