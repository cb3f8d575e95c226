"""What a follow-me policy sees and says: one source for training and for flight.

In: the vehicle's own state as its flight controller estimates it, and the last report of where the owner is. Out: the
observation's vector and image, and the velocity and yaw rate that an action asks for, 10 Hz. Training launches these
functions for thousands of rows with what the simulated estimator and phone say, a companion computer for one row with
what came over MAVLink. Nothing here knows the simulator.
"""

import math

import warp as wp

from common.rotation import yaw_from_quat
from policies.tasks.layout import Branch, Element

wp.set_module_options({"enable_backward": False})

DECISION_S = 0.1

# which vector
EGO = wp.constant(0)  # relative to the vehicle, owner's report included
EGO_BLIND = wp.constant(1)  # the same without any word of the owner: `vision-only`
DOCUMENT = wp.constant(2)  # the document's seven numbers

SPEED_MAX_M_S = wp.constant(7.0)  # horizontal, of an action of 1: an owner running 5 m/s must be overtaken; guess
CLIMB_MAX_M_S = wp.constant(2.0)  # guess
YAW_RATE_MAX_RAD_S = wp.constant(2.0)  # guess
DOCUMENT_SPEED_M_S = wp.constant(3.0)  # unpublished; guess, below the drone package's limit of 5
DOCUMENT_CLIMB_M_S = wp.constant(1.0)  # unpublished; guess
DOCUMENT_YAW_RATE_RAD_S = wp.constant(1.0)  # unpublished; guess

_SPEED_SCALE = wp.constant(5.0)  # [m/s]
_PLACE_SCALE = wp.constant(5.0)  # [m]
_PLACE_MAX = wp.constant(4.0)  # an owner reported farther than this many scales away is shown at that distance
_HEIGHT_SCALE = wp.constant(5.0)  # [m]
_HEIGHT_MAX = wp.constant(2.0)  # in scales
_AGE_MAX_S = wp.constant(5.0)  # a report is not carried on for longer
_DEPTH_HALF_M = wp.constant(4.0)  # this far away the depth channel is at half of its range
_SKY_M = wp.constant(1000.0)  # depths from here on are the sky's

IMAGE_SIZE = 64  # [pixels]
IMAGE_CHANNELS = ("red", "green", "blue", "depth")
HFOV_DEG = 90.0
TILT_DEG = -10.0  # of the optical axis: below the horizon of a level vehicle


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
class OwnerReport:
    """The last FOLLOW_TARGET, in the vehicle's ned frame."""

    pos_ned: wp.vec3  # [m] of the phone, about the owner's chest
    vel_ned: wp.vec3  # [m/s]
    age_s: float  # since its time of validity
    is_known: int  # 0: no report yet, or none for too long; the rest does not count then


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
def document_action(forward: int, vertical: int, turn: int) -> wp.vec4:
    """The document's three choices as an action: stay or forward; stay, up or down; none, left or right."""
    action = wp.vec4()
    action[0] = float(forward) * DOCUMENT_SPEED_M_S / SPEED_MAX_M_S
    if vertical == 1:
        action[2] = -DOCUMENT_CLIMB_M_S / CLIMB_MAX_M_S
    if vertical == 2:
        action[2] = DOCUMENT_CLIMB_M_S / CLIMB_MAX_M_S
    if turn == 1:
        action[3] = -DOCUMENT_YAW_RATE_RAD_S / YAW_RATE_MAX_RAD_S
    if turn == 2:
        action[3] = DOCUMENT_YAW_RATE_RAD_S / YAW_RATE_MAX_RAD_S
    return action


@wp.func
def _write3(out: wp.array2d(dtype=float), i: int, at: int, v: wp.vec3) -> None:
    for k in range(3):
        out[i, at + k] = v[k]


@wp.func
def _write_document(own: OwnState, report: OwnerReport, out: wp.array2d(dtype=float), i: int, at: int) -> None:
    """Person and drone in the document's frame (x east, y up, z north), and their distance."""
    person = wp.vec3(report.pos_ned[1], -report.pos_ned[2], report.pos_ned[0])
    drone = wp.vec3(own.pos_ned[1], -own.pos_ned[2], own.pos_ned[0])
    _write3(out, i, at, person)
    _write3(out, i, at + 3, drone)
    out[i, at + 6] = wp.length(person - drone)


@wp.func
def _write_owner(own: OwnState, report: OwnerReport, out: wp.array2d(dtype=float), i: int, at: int) -> None:
    """Where the owner should be by now and how they move, in hfrd; zeros if nothing is known."""
    for k in range(8):
        out[i, at + k] = 0.0
    if report.is_known == 1:
        yaw = yaw_from_quat(own.q_ned_from_frd)
        age_s = wp.clamp(report.age_s, 0.0, _AGE_MAX_S)
        place = level_from_ned(report.pos_ned + age_s * report.vel_ned - own.pos_ned, yaw) / _PLACE_SCALE
        far = wp.length(place)
        if far > _PLACE_MAX:
            place = place * (_PLACE_MAX / far)
        _write3(out, i, at, place)
        _write3(out, i, at + 3, level_from_ned(report.vel_ned, yaw) / _SPEED_SCALE)
        out[i, at + 6] = age_s
        out[i, at + 7] = 1.0


@wp.func
def write_vector(
    kind: int,
    own: OwnState,
    report: OwnerReport,
    last_action: wp.vec4,
    out: wp.array2d(dtype=float),
    i: int,
    at: int,
) -> None:
    """The observation's floats into row i from column `at`: the elements of `vector_elements(kind)`, scaled."""
    if kind == DOCUMENT:
        _write_document(own, report, out, i, at)
        return
    yaw = yaw_from_quat(own.q_ned_from_frd)
    down_frd = wp.quat_rotate_inv(own.q_ned_from_frd, wp.vec3(0.0, 0.0, 1.0))
    _write3(out, i, at, level_from_ned(own.vel_ned, yaw) / _SPEED_SCALE)
    out[i, at + 3] = down_frd[0]
    out[i, at + 4] = down_frd[1]
    out[i, at + 5] = own.yaw_rate / YAW_RATE_MAX_RAD_S
    out[i, at + 6] = 0.0
    if own.is_height_valid == 1:
        out[i, at + 6] = wp.clamp(own.height_m / _HEIGHT_SCALE, 0.0, _HEIGHT_MAX)
    out[i, at + 7] = float(own.is_height_valid)
    for k in range(4):
        out[i, at + 8 + k] = last_action[k]
    if kind == EGO:
        _write_owner(own, report, out, i, at + 12)


@wp.kernel(enable_backward=False)
def observe_rows(
    kind: int,
    own: wp.array(dtype=OwnState),
    report: wp.array(dtype=OwnerReport),
    last_actions: wp.array(dtype=wp.vec4),
    out: wp.array2d(dtype=float),
) -> None:
    """The vector of every row: what a companion launches for its one."""
    i = wp.tid()
    write_vector(kind, own[i], report[i], last_actions[i], out, i, 0)


@wp.kernel(enable_backward=False)
def command_rows(
    actions: wp.array(dtype=wp.vec4), own: wp.array(dtype=OwnState), commands: wp.array(dtype=Command)
) -> None:
    """What the actions ask for, of every row."""
    i = wp.tid()
    commands[i] = action_command(actions[i], own[i].q_ned_from_frd)


@wp.func
def depth_byte(depth_m: float) -> wp.uint8:
    """The depth channel: 0 at the lens, 127 at 4 m, 255 in the sky."""
    if depth_m >= _SKY_M:
        return wp.uint8(255)
    return wp.uint8(wp.floor(255.0 * depth_m / (depth_m + _DEPTH_HALF_M)))


@wp.kernel(enable_backward=False)
def pack_images(
    rgb: wp.array4d(dtype=wp.uint8), depth_m: wp.array3d(dtype=float), images: wp.array4d(dtype=wp.uint8)
) -> None:
    """Red, green, blue (and depth, where the image has a fourth channel), shape (rows, height, width, channels)."""
    i, row, column = wp.tid()
    for k in range(3):
        images[i, row, column, k] = rgb[i, row, column, k]
    if images.shape[3] == 4:
        images[i, row, column, 3] = depth_byte(depth_m[i, row, column])


def camera_mount() -> tuple[float, float, float, float]:
    """q_frd_from_rdf (x, y, z, w) of the policy's camera: ahead, tilted down."""
    half = 0.5 * math.radians(TILT_DEG)
    # rdf to frd, then a pitch about body right.
    x, y, z, w = 0.5, 0.5, 0.5, 0.5
    s, c = math.sin(half), math.cos(half)
    return (c * x + s * z, c * y + s * w, c * z - s * x, c * w - s * y)


def vector_elements(kind: int) -> tuple[Element, ...]:
    """The elements of a vector, in order."""
    if kind == int(DOCUMENT):
        return (
            *(Element(f"person_{axis}", "m") for axis in ("east", "up", "north")),
            *(Element(f"drone_{axis}", "m") for axis in ("east", "up", "north")),
            Element("distance", "m"),
        )
    own = (
        *(Element(f"vel_hfrd_{axis}", "m/s", float(_SPEED_SCALE)) for axis in "xyz"),
        Element("down_frd_x", "1"),
        Element("down_frd_y", "1"),
        Element("yaw_rate", "rad/s", float(YAW_RATE_MAX_RAD_S)),
        Element("height", "m", float(_HEIGHT_SCALE)),
        Element("is_height_valid", "1"),
        *(Element(f"last_{element.name}", "1") for element in ACTIONS),
    )
    if kind == int(EGO_BLIND):
        return own
    return (
        *own,
        *(Element(f"owner_pos_hfrd_{axis}", "m", float(_PLACE_SCALE), is_goal=True) for axis in "xyz"),
        *(Element(f"owner_vel_hfrd_{axis}", "m/s", float(_SPEED_SCALE), is_goal=True) for axis in "xyz"),
        Element("owner_age", "s"),
        Element("is_owner_known", "1"),
    )


ACTIONS = (
    Element("forward_sp", "m/s", float(SPEED_MAX_M_S)),
    Element("right_sp", "m/s", float(SPEED_MAX_M_S)),
    Element("down_sp", "m/s", float(CLIMB_MAX_M_S)),
    Element("yaw_rate_sp", "rad/s", float(YAW_RATE_MAX_RAD_S)),
)
BRANCHES = (
    Branch("forward", ("stay", "forward")),
    Branch("vertical", ("stay", "up", "down")),
    Branch("turn", ("none", "left", "right")),
)
