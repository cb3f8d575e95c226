"""Where the owner truly is, seen from the vehicle: what rewards, measures and teachers are made from.

Truth about one row. In the image means the camera's true frame; hidden is what terrain, trees or walls stand before.
"""

import math

import warp as wp

from common.rotation import yaw_from_quat
from policies.tasks.flight.own_state import level_from_ned
from policies.tasks.follow_me.follow_me_params import FollowParams
from policies.tasks.follow_me.observe import HFOV_DEG, camera_mount
from policies.tasks.follow_me.observe import LENS_FRD as MOUNT_FRD
from sim.sensors.camera import Lens
from sim.truth import Truth
from sim.world.people import CHEST_M, STATURE_M, Person, chest_ned, is_line_free
from sim.world.world import World, obstacle_contact

wp.set_module_options({"enable_backward": False})

LENS_FRD = wp.constant(wp.vec3(*MOUNT_FRD))
Q_FRD_FROM_RDF = wp.constant(wp.quat(*camera_mount()))
HALF_WIDTH = wp.constant(math.tan(math.radians(0.5 * HFOV_DEG)))
ROOM_MAX_M = wp.constant(2.0)  # the largest radius that contact is asked with
GAIN_MAX = wp.constant(6.0)  # guess: after the exposure time is at its longest; darker than that pictures are dark
_RADIANS = wp.constant(math.pi / 180.0)
_HEAD_FRACTION = wp.constant(0.93)  # of the stature: the eyes
_LEG_FRACTION = wp.constant(0.25)


@wp.struct
class Sight:
    """One row."""

    position_hfrd: wp.vec3  # [m] of the owner's chest
    vel_hfrd: wp.vec3  # [m/s] of the owner
    distance_m: float  # to the chest
    bearing_rad: float  # of the chest from the vehicle's heading, right positive
    lower_m: (
        float  # than CHEST_M above their feet: the middle of the chest that images show, of who is small or crouches
    )
    reach_m: float  # to the nearest part of the owner's body
    room_m: float  # to the nearest trunk, crown, wall, ground or, in training, other person, at most ROOM_MAX_M
    is_free: int  # nothing stands between lens and owner
    is_in_view: int  # and the image shows them


@wp.func
def light_gain(n: FollowParams) -> float:
    """What a camera amplifies the light of an episode by: as far as it can, to that of day."""
    return wp.min(1.0 / n.light, GAIN_MAX)


@wp.func
def lens_in(truth: Truth, n: FollowParams) -> Lens:
    """The policy's camera on a vehicle, as an episode has it: its light, its lens, its mount."""
    lens = lens_of(truth, n.exposure * n.light * light_gain(n))
    if n.lens_tilt_deg != 0.0:
        tilt = wp.quat_from_axis_angle(wp.vec3(1.0, 0.0, 0.0), n.lens_tilt_deg * _RADIANS)
        lens.q_ned_from_rdf = lens.q_ned_from_rdf * tilt
    lens.half_width = HALF_WIDTH * n.lens_scale
    return lens


@wp.func
def lens_of(truth: Truth, exposure: float) -> Lens:
    """The policy's camera on a vehicle; `exposure` is a factor on all light."""
    lens = Lens()
    lens.pos_ned = truth.pos_ned + wp.quat_rotate(truth.q_ned_from_frd, LENS_FRD)
    lens.q_ned_from_rdf = truth.q_ned_from_frd * Q_FRD_FROM_RDF
    lens.half_width = HALF_WIDTH
    lens.exposure = exposure
    lens.balance = wp.vec3(1.0, 1.0, 1.0)
    return lens


@wp.func
def is_in_frame(lens: Lens, point_ned: wp.vec3) -> bool:
    """Whether a square image would show a point, were nothing in between."""
    ray = wp.quat_rotate_inv(lens.q_ned_from_rdf, point_ned - lens.pos_ned)
    edge = lens.half_width * ray[2]
    return ray[2] > 0.0 and wp.abs(ray[0]) < edge and wp.abs(ray[1]) < edge


@wp.func
def room_around(w: World, truth: Truth) -> float:
    """Distance from the vehicle's middle to the nearest trunk, crown, wall or ground [m], at most ROOM_MAX_M."""
    contact = obstacle_contact(w, truth.pos_ned, ROOM_MAX_M)
    return wp.min(ROOM_MAX_M - contact[3], wp.max(truth.height_agl_m, 0.0))


@wp.func
def reach_from(pos_ned: wp.vec3, person: Person) -> float:
    """Distance of a place from the nearest part of a person's body, a line from soles to crown [m]."""
    nearest = person.pos_ned
    nearest[2] = wp.clamp(pos_ned[2], person.pos_ned[2] - person.stature_m, person.pos_ned[2])
    return wp.length(pos_ned - nearest)


@wp.func
def see(w: World, truth: Truth, n: FollowParams, person: Person, drawn: Person) -> Sight:
    """How a vehicle and its owner stand to each other, who is drawn as cameras see them: crouched, or not at all."""
    sight = Sight()
    chest = chest_ned(person)
    head = person.pos_ned - wp.vec3(0.0, 0.0, _HEAD_FRACTION * drawn.stature_m)
    legs = person.pos_ned - wp.vec3(0.0, 0.0, _LEG_FRACTION * drawn.stature_m)
    yaw = yaw_from_quat(truth.q_ned_from_frd)
    sight.position_hfrd = level_from_ned(chest - truth.pos_ned, yaw)
    sight.vel_hfrd = level_from_ned(person.vel_ned, yaw)
    sight.distance_m = wp.length(sight.position_hfrd)
    sight.bearing_rad = wp.atan2(sight.position_hfrd[1], sight.position_hfrd[0])
    sight.reach_m = reach_from(truth.pos_ned, person)
    sight.room_m = room_around(w, truth)
    lens = lens_in(truth, n)
    if drawn.stature_m <= 0.0:
        return sight
    sight.lower_m = CHEST_M * (1.0 - drawn.stature_m / STATURE_M)
    chest += wp.vec3(0.0, 0.0, sight.lower_m)
    is_chest_free = is_line_free(w, lens.pos_ned, chest)
    is_head_free = is_chest_free or is_line_free(w, lens.pos_ned, head)
    sight.is_free = int(is_chest_free or is_head_free)
    is_shown = is_chest_free and (is_in_frame(lens, chest) or is_in_frame(lens, legs))
    if is_shown or (is_head_free and is_in_frame(lens, head)):
        sight.is_in_view = 1
    return sight
