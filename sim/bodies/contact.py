"""Contact of a vehicle with ground, trunks, crowns and walls, as springs with dampers and Coulomb friction.

In: pose and motion, each 1 ms. Out: force and torque. The surroundings are looked up once a tick and treated as a
plane for its four substeps. Feet and rotor tips touch the ground; one sphere round the vehicle touches obstacles.
Feet stick by a tangential spring each (a bristle), so a vehicle on a slope does not creep; rotor tips only drag.
They stand on the level top of another vehicle too, and ride with it.
Left out: terrain curvature under one vehicle, torque from obstacles, the tilt of a top, deformation that stays.
"""

import math
from typing import TYPE_CHECKING, Any, TypeAlias

import warp as wp

from common.airframes.multirotor import MultirotorAirframe
from common.geodesy import GRAVITY_M_S2
from common.kernels import MAX_MOTORS, vec8
from sim.world.custom.solids import solids_gap, solids_hit
from sim.world.neighbours import deck_below, deck_vel, is_over_deck, neighbour_box, neighbour_touched
from sim.world.world import World, ground_height, ground_normal_ned, obstacle_contact

wp.set_module_options({"enable_backward": False})

FEET = wp.constant(4)
Vec12: TypeAlias = Any if TYPE_CHECKING else wp.types.vector(length=4 + MAX_MOTORS, dtype=wp.float32)

_OBSTACLE_MARGIN_M = wp.constant(0.2)  # an obstacle nearer than this is found before the substeps reach it: 50 m/s
_NEAR_FACTOR = wp.constant(1.5)  # steep ground is nearer than the height above it: good to 48 deg
_NOWHERE_M = wp.constant(1.0e6)
_DECK_DEEP_M = wp.constant(0.06)  # a foot as deep below another vehicle's top swings in from its side; guess
_FRICTION = wp.constant(0.7)  # JSBSim F450 Gear.xml: 0.8 static, 0.5 dynamic
_NORMAL_RATE_RAD_S = 90.0  # guess: legs yield 1.2 mm under the weight; stable and damped at 1 ms
_TANGENT_RATE_RAD_S = 120.0  # guess: as stiff as 1 ms steps allow
_DAMPING_RATIO = 0.7  # guess: a landing does not bounce


@wp.struct
class ContactModel:
    """Where a vehicle can touch, and how stiff it is there."""

    leg_frd: wp.vec3  # [m] foot front right; the others mirrored
    point_count: int  # feet and rotor tips
    tip_x: vec8  # [m] rotor tips farthest out, frd
    tip_y: vec8  # [m]
    tip_z: vec8  # [m]
    reach_m: float  # farthest ground contact point from the centre of gravity
    hull_radius_m: float
    crash_speed_m_s: float
    normal_n_m: float  # [N/m] per point
    normal_n_s_m: float  # [N s/m] per point
    tangent_n_m: float  # [N/m] per foot
    tangent_n_s_m: float  # [N s/m] per foot


@wp.struct
class Surroundings:
    """What is near a vehicle, valid for one tick."""

    origin_ned: wp.vec3  # [m] where it was looked up
    height_agl_m: float  # of the centre of gravity, vertically
    is_near_ground: int
    normal_ned: wp.vec3  # of the ground, pointing up
    obstacle_normal_ned: wp.vec3  # from the obstacle to the vehicle
    obstacle_depth_m: float  # negative: gap between hull sphere and obstacle, at most the margin
    is_near_obstacle: int
    obstacle_vel_ned: wp.vec3  # [m/s] of another vehicle; all else stands as far as contact goes
    obstacle_shift_ned: wp.vec3  # [m] how far it has gone since it was looked up
    obstacle_rigidity: float  # fraction of a rigid obstacle's push: less where the other hull yields too
    is_near_solid: int
    leg_normal_x: Vec12  # ned, of the solid's surface that each leg crosses, or will if it grows by the margin
    leg_normal_y: Vec12
    leg_normal_z: Vec12
    leg_offset_m: Vec12  # of each surface's plane along its normal, from where it was looked up
    deck_legs: int  # a bit of each leg whose surface is the top of another vehicle
    deck_vel_ned: wp.vec3  # [m/s] of that top, where it was looked up
    deck_turn_rate: float  # [rad/s]


@wp.struct
class FootSlip:
    """How far the tangential spring of each foot is stretched."""

    north: wp.vec4  # [m] one per foot
    east: wp.vec4
    down: wp.vec4


@wp.struct
class ContactForce:
    """Sum over all touching points."""

    force_ned: wp.vec3  # [N]
    torque_frd: wp.vec3  # [N m] about the centre of gravity
    foot_slip: FootSlip
    impact_speed_m_s: float  # largest approach speed along a normal
    is_on_ground: int  # a foot touches
    is_rotor_strike: int  # a rotor tip touches


@wp.func
def look_around(world: World, model: ContactModel, pos_ned: wp.vec3) -> Surroundings:
    """Ground plane and nearest obstacle at a vehicle; the normal is only looked up near the ground."""
    around = Surroundings()
    around.origin_ned = pos_ned
    around.height_agl_m = -pos_ned[2] - ground_height(world, pos_ned[0], pos_ned[1])
    around.normal_ned = wp.vec3(0.0, 0.0, -1.0)
    if around.height_agl_m < _NEAR_FACTOR * model.reach_m + _OBSTACLE_MARGIN_M:
        around.is_near_ground = 1
        around.normal_ned = ground_normal_ned(world, pos_ned[0], pos_ned[1])
    bare = world
    if world.neighbours.count > 0:
        if deck_below(world.neighbours, world.boxes.tick, pos_ned, model.hull_radius_m + _OBSTACLE_MARGIN_M) >= 0:
            bare.neighbours.count = 0  # its feet stand there, not its hull
    touch = obstacle_contact(bare, pos_ned, model.hull_radius_m + _OBSTACLE_MARGIN_M)
    if touch[3] > 0.0:
        around.is_near_obstacle = 1
        around.obstacle_normal_ned = wp.vec3(touch[0], touch[1], touch[2])
        around.obstacle_depth_m = touch[3] - _OBSTACLE_MARGIN_M
        around.obstacle_rigidity = 1.0
        seen_m = model.hull_radius_m + _OBSTACLE_MARGIN_M
        other = neighbour_touched(bare.neighbours, world.boxes.tick, pos_ned, seen_m, touch[3])
        if other >= 0:
            stiffness_n_m = world.neighbours.rows[other].stiffness_n_m
            around.obstacle_vel_ned = world.neighbours.rows[other].vel_ned
            around.obstacle_rigidity = stiffness_n_m / (stiffness_n_m + 4.0 * model.normal_n_m)  # springs in series
    return around


@wp.func
def look_along_legs(world: World, model: ContactModel, around: Surroundings, r_ned_from_frd: wp.mat33) -> Surroundings:
    """The surroundings with the surfaces of solids that feet and rotor tips touch, or may before the tick is over."""
    near_m = model.reach_m + _OBSTACLE_MARGIN_M
    if solids_gap(world.solids, around.origin_ned, near_m)[3] >= near_m:
        return around
    around.is_near_solid = 1
    for point in range(model.point_count):
        arm_ned = r_ned_from_frd * contact_point_frd(model, point)
        length = wp.length(arm_ned)
        along_ned = arm_ned / length
        hit = solids_hit(world.solids, around.origin_ned, along_ned, length + _OBSTACLE_MARGIN_M)
        around.leg_normal_x[point] = hit.normal_ned[0]
        around.leg_normal_y[point] = hit.normal_ned[1]
        around.leg_normal_z[point] = hit.normal_ned[2]
        around.leg_offset_m[point] = -_NOWHERE_M
        if hit.face >= 0:
            around.leg_offset_m[point] = hit.t * wp.dot(hit.normal_ned, along_ned)
    return around


@wp.func
def look_at_deck(world: World, model: ContactModel, around: Surroundings, r_ned_from_frd: wp.mat33) -> Surroundings:
    """The surroundings with the level top of a vehicle straight below for a surface, of the legs that are over it."""
    tick = world.boxes.tick
    deck = deck_below(world.neighbours, tick, around.origin_ned, model.reach_m + _OBSTACLE_MARGIN_M)
    if deck < 0:
        return around
    one = world.neighbours.rows[deck]
    around.deck_vel_ned = deck_vel(one, tick, around.origin_ned)
    around.deck_turn_rate = one.turn_rate
    offset_m = around.origin_ned[2] + neighbour_box(one, tick).high
    for point in range(model.point_count):
        if around.is_near_solid == 0:
            around.leg_offset_m[point] = -_NOWHERE_M
        end_ned = around.origin_ned + r_ned_from_frd * contact_point_frd(model, point)
        is_from_above = offset_m + end_ned[2] - around.origin_ned[2] < _DECK_DEEP_M
        if is_from_above and offset_m > around.leg_offset_m[point] and is_over_deck(one, tick, end_ned):
            around.leg_normal_x[point] = 0.0
            around.leg_normal_y[point] = 0.0
            around.leg_normal_z[point] = -1.0
            around.leg_offset_m[point] = offset_m
            around.deck_legs += 1 << point
    around.is_near_solid = 1
    return around


@wp.func
def over_solids(world: World, model: ContactModel, around: Surroundings) -> Surroundings:
    """The surroundings of a vehicle that takes what is straight below itself for the plane of its ground."""
    if world.solids.count > 0:
        reach_m = _NEAR_FACTOR * model.reach_m + _OBSTACLE_MARGIN_M
        hit = solids_hit(world.solids, around.origin_ned, wp.vec3(0.0, 0.0, 1.0), reach_m)
        if hit.face >= 0 and hit.t < around.height_agl_m:
            around.is_near_ground = 1
            around.height_agl_m = hit.t
            around.normal_ned = hit.normal_ned
    return around


@wp.func
def contact_point_frd(model: ContactModel, point: int) -> wp.vec3:
    """Feet 0..3 (front right, rear right, front left, rear left), then rotor tips in rotor order [m]."""
    if point >= FEET:
        rotor = point - FEET
        return wp.vec3(model.tip_x[rotor], model.tip_y[rotor], model.tip_z[rotor])
    x = model.leg_frd[0]
    y = model.leg_frd[1]
    if point % 2 == 1:
        x = -x
    if point >= 2:
        y = -y
    return wp.vec3(x, y, model.leg_frd[2])


@wp.func
def limit_length(v: wp.vec3, most: float) -> wp.vec3:
    """v, shortened to length `most` where it is longer."""
    length = wp.length(v)
    scale = 1.0
    if length > most:
        scale = most / length
    return v * scale


@wp.func
def ground_contact(
    model: ContactModel,
    around: Surroundings,
    pos_ned: wp.vec3,
    vel_ned: wp.vec3,
    r_ned_from_frd: wp.mat33,
    omega_frd: wp.vec3,
    foot_slip: FootSlip,
    dt: float,
) -> ContactForce:
    """Forces of ground and solids on feet and rotor tips: of each, what it is deeper in.

    A normal spring and damper that never pull, and friction within Coulomb's cone.
    """
    contact = ContactForce()
    normal = around.normal_ned
    ground_ned = around.origin_ned + wp.vec3(0.0, 0.0, around.height_agl_m)
    height = wp.dot(normal, pos_ned - ground_ned)
    for point in range(model.point_count):
        is_on_deck = bool(False)
        arm_frd = contact_point_frd(model, point)
        depth = -height - wp.dot(around.normal_ned, r_ned_from_frd * arm_frd)
        if around.is_near_solid == 1:
            normal = around.normal_ned
            surface = wp.vec3(around.leg_normal_x[point], around.leg_normal_y[point], around.leg_normal_z[point])
            end_ned = pos_ned - around.origin_ned + r_ned_from_frd * arm_frd
            leg_depth = around.leg_offset_m[point] - wp.dot(surface, end_ned)
            if leg_depth > depth:
                depth = leg_depth
                normal = surface
                is_on_deck = (around.deck_legs >> point) % 2 == 1
        if depth > 0.0:
            point_vel_ned = vel_ned + r_ned_from_frd * wp.cross(omega_frd, arm_frd)
            if is_on_deck:
                arm_ned = r_ned_from_frd * arm_frd
                turning_ned = around.deck_turn_rate * wp.vec3(-arm_ned[1], arm_ned[0], 0.0)
                point_vel_ned -= around.deck_vel_ned + turning_ned
            normal_speed = wp.dot(normal, point_vel_ned)
            tangent_vel_ned = point_vel_ned - normal * normal_speed
            normal_force = wp.max(model.normal_n_m * depth - model.normal_n_s_m * normal_speed, 0.0)
            friction_ned = -model.tangent_n_s_m * tangent_vel_ned
            if point < FEET:
                slip_ned = wp.vec3(foot_slip.north[point], foot_slip.east[point], foot_slip.down[point])
                slip_ned = slip_ned + tangent_vel_ned * dt
                slip_ned = slip_ned - normal * wp.dot(normal, slip_ned)
                slip_ned = limit_length(slip_ned, _FRICTION * normal_force / model.tangent_n_m)
                contact.foot_slip.north[point] = slip_ned[0]
                contact.foot_slip.east[point] = slip_ned[1]
                contact.foot_slip.down[point] = slip_ned[2]
                friction_ned = friction_ned - model.tangent_n_m * slip_ned
                contact.is_on_ground = 1
            else:
                contact.is_rotor_strike = 1
            force_ned = normal * normal_force + limit_length(friction_ned, _FRICTION * normal_force)
            contact.force_ned += force_ned
            contact.torque_frd += wp.cross(arm_frd, wp.transpose(r_ned_from_frd) * force_ned)
            contact.impact_speed_m_s = wp.max(contact.impact_speed_m_s, -normal_speed)
    return contact


@wp.func
def obstacle_force(
    model: ContactModel, around: Surroundings, contact: ContactForce, pos_ned: wp.vec3, vel_ned: wp.vec3
) -> ContactForce:
    """Adds the push of a trunk, crown, wall or other vehicle on the hull sphere, frictionless, to a contact."""
    normal = around.obstacle_normal_ned
    depth = around.obstacle_depth_m - wp.dot(normal, pos_ned - around.origin_ned - around.obstacle_shift_ned)
    if depth > 0.0:
        normal_speed = wp.dot(normal, vel_ned - around.obstacle_vel_ned)
        push = 4.0 * (model.normal_n_m * depth - model.normal_n_s_m * normal_speed)  # as all four feet together
        contact.force_ned += normal * (around.obstacle_rigidity * wp.max(push, 0.0))
        contact.impact_speed_m_s = wp.max(contact.impact_speed_m_s, -normal_speed)
    return contact


def contact_model(airframe: MultirotorAirframe) -> ContactModel:
    """Contact constants of an airframe; stiffness follows from its mass and inertia."""
    data = airframe.contact
    mass_kg = airframe.body.mass_kg
    model = ContactModel()
    model.leg_frd = wp.vec3(data.leg_x_m, data.leg_y_m, data.leg_z_m)
    model.point_count = 4 + len(airframe.rotors)
    reach_m = math.dist((data.leg_x_m, data.leg_y_m, data.leg_z_m), (0.0, 0.0, 0.0))
    for i, rotor in enumerate(airframe.rotors):
        hub_m = math.hypot(rotor.x_m, rotor.y_m)
        outward = 1.0 + airframe.rotor_model.radius_m / hub_m
        model.tip_x[i] = rotor.x_m * outward
        model.tip_y[i] = rotor.y_m * outward
        model.tip_z[i] = rotor.z_m
        reach_m = max(reach_m, math.dist((rotor.x_m * outward, rotor.y_m * outward, rotor.z_m), (0.0, 0.0, 0.0)))
    model.reach_m = reach_m
    model.hull_radius_m = data.hull_radius_m
    model.crash_speed_m_s = data.crash_speed_m_s
    model.normal_n_m = mass_kg * _NORMAL_RATE_RAD_S**2 / 4
    model.normal_n_s_m = 2 * _DAMPING_RATIO * mass_kg * _NORMAL_RATE_RAD_S / 4
    # A push at the feet also turns the vehicle: what it feels of its mass is less.
    inertia_kg_m2 = min(airframe.body.inertia_xx_kg_m2, airframe.body.inertia_yy_kg_m2)
    foot_mass_kg = 1 / (1 / mass_kg + data.leg_z_m**2 / inertia_kg_m2)
    model.tangent_n_m = foot_mass_kg * _TANGENT_RATE_RAD_S**2 / 4
    model.tangent_n_s_m = 2 * _DAMPING_RATIO * foot_mass_kg * _TANGENT_RATE_RAD_S / 4
    return model


def resting_height_m(airframe: MultirotorAirframe) -> float:
    """Height of the centre of gravity over level ground at rest, the legs' yielding included."""
    return airframe.contact.leg_z_m - GRAVITY_M_S2 / _NORMAL_RATE_RAD_S**2
