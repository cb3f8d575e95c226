"""What a follow-me policy sees and says: one source for training and for flight.

In: the vehicle's own state as its flight controller estimates it, and the last report of where the owner is. Out: the
observation's vector and image, and the velocity and yaw rate that an action asks for, 10 Hz. Training launches these
functions for thousands of rows with what the simulated estimator and phone say, a companion computer for one row with
what came over MAVLink. Nothing here knows the simulator.
"""

import math

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.rotation import yaw_from_quat
from policies.tasks.flight.own_state import (
    CLIMB_MAX_M_S,
    OWN_ELEMENTS,
    OWN_SIZE,
    SPEED_MAX_M_S,
    SPEED_SCALE,
    YAW_RATE_MAX_RAD_S,
    OwnState,
    level_from_ned,
    write3,
    write_own,
)
from policies.tasks.layout import Branch, Element

wp.set_module_options({"enable_backward": False})

DECISION_S = 0.1
LAYOUT_VERSION = 2  # 1: without the picture's age

# which vector
EGO = wp.constant(0)  # relative to the vehicle, owner's report included
EGO_BLIND = wp.constant(1)  # the same without any word of the owner: `vision-only`
DOCUMENT = wp.constant(2)  # the document's seven numbers
TRACKED = wp.constant(3)  # what senses know, and no image: tracked/vector.py

DOCUMENT_SPEED_M_S = wp.constant(3.0)  # unpublished; guess, below the drone package's limit of 5
DOCUMENT_CLIMB_M_S = wp.constant(1.0)  # unpublished; guess
DOCUMENT_YAW_RATE_RAD_S = wp.constant(1.0)  # unpublished; guess

_POSITION_SCALE = wp.constant(5.0)  # [m]
_POSITION_MAX = wp.constant(4.0)  # an owner reported farther than this many scales away is shown at that distance
IMAGE_SHOWN_OLD_S = wp.constant(0.5)  # an older picture is shown as one of this age
REPORT_OLD_S = wp.constant(5.0)  # a report older than this tells nothing; guess
REPORT_LAG_S = 0.3  # of a phone's position when it arrives; guess: phones do not say, their clock is not ours
DEPTH_HALF_M = wp.constant(4.0)  # this far away the depth channel is at half of its range
_SKY_M = wp.constant(1000.0)  # depths from here on are the sky's

IMAGE_SIZE = 64  # [pixels]
IMAGE_CHANNELS = ("red", "green", "blue", "depth")
IMAGE_SHAPE = (IMAGE_SIZE, IMAGE_SIZE, len(IMAGE_CHANNELS))
HFOV_DEG = 90.0
LENS_FRD = (0.10, 0.0, 0.06)  # [m] of the lens from the vehicle's middle
TILT_DEG = -10.0  # of the optical axis: below the horizon of a level vehicle


@wp.struct
class OwnerReport:
    """The last FOLLOW_TARGET, in the vehicle's ned frame."""

    pos_ned: wp.vec3  # [m] of the phone, about the owner's chest
    vel_ned: wp.vec3  # [m/s]
    age_s: float  # since its time of validity
    is_known: int  # 0: no report yet, or none for too long; the rest does not count then


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
def _write_document(own: OwnState, report: OwnerReport, out: wp.array2d(dtype=float), i: int, at: int) -> None:
    """Person and drone in the document's frame (x east, y up, z north), and their distance."""
    person = wp.vec3(report.pos_ned[1], -report.pos_ned[2], report.pos_ned[0])
    drone = wp.vec3(own.pos_ned[1], -own.pos_ned[2], own.pos_ned[0])
    write3(out, i, at, person)
    write3(out, i, at + 3, drone)
    out[i, at + 6] = wp.length(person - drone)


@wp.func
def _write_owner(own: OwnState, report: OwnerReport, out: wp.array2d(dtype=float), i: int, at: int) -> None:
    """Where the owner should be by now and how they move, in hfrd; zeros if nothing is known."""
    for k in range(8):
        out[i, at + k] = 0.0
    if report.is_known == 1:
        yaw = yaw_from_quat(own.q_ned_from_frd)
        age_s = wp.clamp(report.age_s, 0.0, REPORT_OLD_S)
        position = level_from_ned(report.pos_ned + age_s * report.vel_ned - own.pos_ned, yaw) / _POSITION_SCALE
        far = wp.length(position)
        if far > _POSITION_MAX:
            position = position * (_POSITION_MAX / far)
        write3(out, i, at, position)
        write3(out, i, at + 3, level_from_ned(report.vel_ned, yaw) / SPEED_SCALE)
        out[i, at + 6] = age_s
        out[i, at + 7] = 1.0


@wp.func
def write_vector(
    kind: int,
    own: OwnState,
    report: OwnerReport,
    last_action: wp.vec4,
    image_age_s: float,
    out: wp.array2d(dtype=float),
    i: int,
    at: int,
) -> None:
    """The observation's floats into row i from column `at`: the elements of `vector_elements(kind)`, scaled."""
    if kind == DOCUMENT:
        _write_document(own, report, out, i, at)
        return
    write_own(own, last_action, out, i, at)
    out[i, at + OWN_SIZE] = wp.min(image_age_s, IMAGE_SHOWN_OLD_S) / IMAGE_SHOWN_OLD_S
    if kind == EGO:
        _write_owner(own, report, out, i, at + OWN_SIZE + 1)


@wp.kernel(enable_backward=False)
def observe_rows(
    kind: int,
    own: wp.array(dtype=OwnState),
    report: wp.array(dtype=OwnerReport),
    last_actions: wp.array(dtype=wp.vec4),
    image_ages_s: wp.array(dtype=float),
    out: wp.array2d(dtype=float),
) -> None:
    """The vector of every row: what a companion launches for its one."""
    i = wp.tid()
    write_vector(kind, own[i], report[i], last_actions[i], image_ages_s[i], out, i, 0)


@wp.func
def depth_byte(depth_m: float) -> wp.uint8:
    """The depth channel: 0 at the lens, 127 at 4 m, 255 in the sky."""
    if depth_m >= _SKY_M:
        return wp.uint8(255)
    return wp.uint8(wp.floor(255.0 * depth_m / (depth_m + DEPTH_HALF_M)))


def depth_of(byte: NDArray[np.float64]) -> NDArray[np.float64]:
    """The depth [m] that bytes below 255 of the depth channel stand for: they were rounded down."""
    return float(DEPTH_HALF_M) * (byte + 0.5) / (255.0 - byte)


@wp.kernel(enable_backward=False)
def pack_images(
    rgb: wp.array4d(dtype=wp.uint8),
    depth_m: wp.array3d(dtype=float),
    rows: wp.array(dtype=wp.bool),
    images: wp.array4d(dtype=wp.uint8),
) -> None:
    """Red, green, blue (and depth, where the image has a fourth channel) of the chosen rows, as they are observed.

    Shapes (rows, height, width, channels), of depth without the last. One thread per row of pixels.
    """
    i, y = wp.tid()
    if not rows[i]:
        return
    for x in range(rgb.shape[2]):
        for c in range(3):
            images[i, y, x, c] = rgb[i, y, x, c]
        if images.shape[3] == 4:
            images[i, y, x, 3] = depth_byte(depth_m[i, y, x])


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
    own = (*OWN_ELEMENTS, Element("image_age", "s", float(IMAGE_SHOWN_OLD_S)))
    if kind == int(EGO_BLIND):
        return own
    return (
        *own,
        *(Element(f"owner_pos_hfrd_{axis}", "m", float(_POSITION_SCALE), is_goal=True) for axis in "xyz"),
        *(Element(f"owner_vel_hfrd_{axis}", "m/s", float(SPEED_SCALE), is_goal=True) for axis in "xyz"),
        Element("owner_age", "s"),
        Element("is_owner_known", "1"),
    )


BRANCHES = (
    Branch("forward", ("stay", "forward")),
    Branch("vertical", ("stay", "up", "down")),
    Branch("turn", ("none", "left", "right")),
)
