"""The owner: a person who walks and runs through the world along smooth random paths, 50 Hz.

In: the world, and how this person moves. Out: where they stand, look and go, and the phase of their gait. They plan a
few seconds at a time (a stop, a bend, a change of speed, a tree to pass closely), steer round trunks, turn back before
the edges of the map, and slow down on slopes. Step every PERSON_TICKS ticks: a person is too slow for 250 Hz.
"""

from typing import Any

import warp as wp

from common.kernels import TICK_S
from common.rng import draw_key
from common.rotation import wrap_pi
from sim.rng_streams import OWNER_BODY, OWNER_PLAN
from sim.world.footways import BODY_CLEARANCE_M, around_nearest, clear_of_trunks, free_way_m, towards_tree
from sim.world.world import World, ground_height, ray_hit

wp.set_module_options({"enable_backward": False})

PERSON_TICKS = 5  # 50 Hz
PERSON_DT_S = PERSON_TICKS * TICK_S
WALK_SPEED_M_S = 2.0  # people walk below and run above it; Baker et al. 2025 (arXiv 2501.00720): 1.9 to 3.0
RUN_SPEED_M_S = 5.0  # 18 km/h: a brisk run

STATURE_M = wp.constant(1.75)  # of a person of the usual size
CHEST_M = wp.constant(1.0)  # above the feet: what a follower keeps its distance to, and where the phone is carried
_EDGE_M = wp.constant(8.0)  # turns back this far from the edge of the map; guess
_TURN = wp.constant(6.283185307179586)
_PI = wp.constant(3.141592653589793)
_AHEAD_S = wp.constant(1.6)  # how far ahead people look for trees, in time and at least; guess
_AHEAD_MIN_M = wp.constant(2.5)
_AHEAD_MAX_M = wp.constant(7.0)
_FACE_GAIN = wp.constant(2.5)  # [1/s] from a course error to a turn rate; guess
_TURN_TIME_S = wp.constant(0.25)  # of a turn rate towards what is wanted; guess
_CREEP_M_S = wp.constant(0.3)  # past a trunk that is touched; guess
_CHORD_S = wp.constant(0.25)  # half of the time in which a person who walks into a trunk can stop; guess
_BRAKE_TIME_S = wp.constant(0.2)  # how fast people stop before what they would run into; guess
_BRAKE_M_S2 = wp.constant(5.0)  # guess
_SLOPE_STEP_M = wp.constant(0.5)  # about one step: a person feels the slope over it
_WALK_RATIO_M_S = wp.constant(0.39)  # step length over steps per second; Sekiya and Nagasaki 1998: 0.0065 m/(steps/min)
_RUN_STEPS = wp.vec2(2.3, 0.12)  # steps per second at rest and per m/s: 2.5 at 2 m/s, 2.9 at 5 m/s; guess


@wp.struct
class PersonModel:
    """How a person moves."""

    speed_min: float  # [m/s] the slowest they choose to go
    speed_max: float  # [m/s]
    stop_fraction: float  # fraction of plans that are a stop
    stop_min_s: float
    stop_max_s: float
    plan_min_s: float  # how long a plan lasts
    plan_max_s: float
    course_std_rad: float  # change of course from plan to plan
    bend_std_rad_s: float  # how fast the course bends within a plan
    graze_fraction: float  # fraction of plans that lead closely past a tree, if there is one in reach
    clearance_min_m: float  # from the body to the bark of trees they pass
    clearance_max_m: float
    speed_time_s: float  # relaxation time of the speed
    accel_max: float  # [m/s²] along the path
    lateral_accel_max: float  # [m/s²] across it
    turn_rate_max: float  # [rad/s]


@wp.struct
class Person:
    """Where a person is and what they are about to do; feet on the ground."""

    pos_ned: wp.vec3  # [m] between the feet
    vel_ned: wp.vec3  # [m/s]
    heading_rad: float  # where body and face point
    turn_rate: float  # [rad/s]
    speed: float  # [m/s] along the heading
    stature_m: float
    gait_phase: float  # [rad] 0..2 pi: one stride, two steps; the left foot lands at 0
    is_running: int
    speed_sp: float  # [m/s] the plan: speed, course and its bend, room left to trees, time left
    course_rad: float
    bend_rad_s: float
    clearance_m: float  # from the body to the bark
    plan_left_s: float


def person_model(speed_max_m_s: float = WALK_SPEED_M_S) -> Any:
    """A person who goes up to a speed [m/s]: WALK_SPEED_M_S to walk only, RUN_SPEED_M_S to run too."""
    model = PersonModel()
    model.speed_min = 0.4  # guess: strolling
    model.speed_max = speed_max_m_s
    model.stop_fraction = 0.2  # guess, as are the next seven
    model.stop_min_s, model.stop_max_s = 1.0, 4.0
    model.plan_min_s, model.plan_max_s = 2.0, 7.0
    model.course_std_rad = 0.9
    model.bend_std_rad_s = 0.12
    model.graze_fraction = 0.3
    model.clearance_min_m, model.clearance_max_m = 0.05, 0.8
    model.speed_time_s = 0.66  # Liu et al. 2017, Physica A 468: 0.659 s
    model.accel_max = 2.5  # guess: brisk; sprinters start with 6 (di Prampero et al. 2005)
    model.lateral_accel_max = 3.0  # guess: a slip-free bend on grass
    model.turn_rate_max = 2.5  # guess: about-turn in 1.3 s
    return model


@wp.func
def chest_ned(person: Person) -> wp.vec3:
    """The middle of the chest, in ned [m]: CHEST_M above the feet."""
    return person.pos_ned - wp.vec3(0.0, 0.0, CHEST_M)


@wp.func
def is_line_free(w: World, from_ned: wp.vec3, to_ned: wp.vec3) -> bool:
    """Whether nothing solid is on the line between two points [m]."""
    way = to_ned - from_ned
    distance = wp.length(way)
    if distance < 1.0e-3:
        return True
    return ray_hit(w, from_ned, way / distance, distance) >= distance


@wp.func
def person_start(
    w: World, model: PersonModel, north: float, east: float, heading_rad: float, seed: int, i: int, tick: int
) -> Person:
    """A person who stands near a position, looks along a heading, and will soon set off.

    Args:
        w: the world.
        model: how they move.
        north: where to stand [m]; beside a trunk if there is one.
        east: [m].
        heading_rad: from north, clockwise.
        seed: of their random draws.
        i: row of the batch.
        tick: now.
    """
    state = draw_key(seed, i, tick, OWNER_BODY)
    person = Person()
    person.stature_m = 1.55 + 0.35 * wp.randf(state)  # NCD-RisC 2016: means of adults 1.50 to 1.83 m
    person.plan_left_s = 0.5 + 1.5 * wp.randf(state)
    person.gait_phase = 0.0
    person.heading_rad = wrap_pi(heading_rad)
    person.course_rad = person.heading_rad
    person.clearance_m = model.clearance_max_m
    position = clear_of_trunks(w.forest, within_map(w, north, east))
    person.pos_ned = wp.vec3(position[0], position[1], -ground_height(w, position[0], position[1]))
    return person


@wp.func
def person_step(w: World, model: PersonModel, person: Person, seed: int, i: int, tick: int, dt_s: float) -> Person:
    """The person after `dt_s`, at most 0.1 s.

    Args:
        w: the world.
        model: how they move.
        person: before.
        seed: of their random draws.
        i: row of the batch.
        tick: now; a person draws at most once per tick.
        dt_s: duration of the step [s].
    """
    out = planned(w, model, person, seed, i, tick, dt_s)
    course = free_course(w, out)
    error = wrap_pi(course - out.heading_rad)
    # turn: as fast as legs allow while standing, as the grip on the ground allows while moving
    rate_max = wp.min(model.turn_rate_max, model.lateral_accel_max / wp.max(out.speed, 0.1))
    rate_sp = wp.clamp(_FACE_GAIN * error, -rate_max, rate_max)
    if out.speed_sp < 0.05:
        rate_sp = 0.0
    out.turn_rate = wp.clamp(
        out.turn_rate + (rate_sp - out.turn_rate) * dt_s / (_TURN_TIME_S + dt_s), -rate_max, rate_max
    )
    out.heading_rad = wrap_pi(out.heading_rad + out.turn_rate * dt_s)
    # speed: slower for a sharp turn, on a slope, and straight before a trunk
    speed_sp = out.speed_sp * slope_fraction(w, out) * wp.max(0.25, 1.0 - wp.abs(error) / (0.5 * _PI))
    accel = wp.clamp((speed_sp - out.speed) / model.speed_time_s, -model.accel_max, model.accel_max)
    # along the chord of a bend
    chord_rad = out.heading_rad + _CHORD_S * out.turn_rate
    free_m = free_way_m(w.forest, wp.vec2(out.pos_ned[0], out.pos_ned[1]), chord_rad, ahead_m(out))
    speed_limit = _CREEP_M_S + wp.sqrt(model.accel_max * free_m)
    if speed_limit < out.speed:
        accel = wp.max((speed_limit - out.speed) / _BRAKE_TIME_S, -_BRAKE_M_S2)
    out.speed = wp.max(out.speed + accel * dt_s, 0.0)
    return stepped(w, out, dt_s)


@wp.func
def stepped(w: World, person: Person, dt_s: float) -> Person:
    """The person moved along their heading, pushed out of trunks, put back on the ground, their legs swung."""
    out = person
    start = person.pos_ned
    north = start[0] + person.speed * wp.cos(person.heading_rad) * dt_s
    east = start[1] + person.speed * wp.sin(person.heading_rad) * dt_s
    position = clear_of_trunks(w.forest, within_map(w, north, east))
    out.pos_ned = wp.vec3(position[0], position[1], -ground_height(w, position[0], position[1]))
    out.vel_ned = (out.pos_ned - start) / dt_s
    # a trunk that was touched takes the speed towards it
    out.speed = wp.min(person.speed, wp.length(wp.vec2(out.vel_ned[0], out.vel_ned[1])))
    # hysteresis: nobody changes gait at every breath
    if person.speed > 1.1 * WALK_SPEED_M_S:
        out.is_running = 1
    elif person.speed < 0.95 * WALK_SPEED_M_S:
        out.is_running = 0
    steps_per_s = wp.sqrt(person.speed / _WALK_RATIO_M_S)
    if out.is_running != 0:
        steps_per_s = _RUN_STEPS[0] + _RUN_STEPS[1] * person.speed
    phase = person.gait_phase + _PI * steps_per_s * dt_s
    out.gait_phase = phase - _TURN * wp.floor(phase / _TURN)
    return out


@wp.func
def planned(w: World, model: PersonModel, person: Person, seed: int, i: int, tick: int, dt_s: float) -> Person:
    """The person with a plan for now: the old one followed, or a new one drawn."""
    out = person
    out.plan_left_s = person.plan_left_s - dt_s
    out.course_rad = wrap_pi(person.course_rad + person.bend_rad_s * dt_s)
    if out.plan_left_s <= 0.0:
        state = draw_key(seed, i, tick, OWNER_PLAN)
        is_stop = wp.randf(state) < model.stop_fraction
        # nobody stops twice in a row
        if is_stop and person.speed_sp > 0.0:
            out.speed_sp = 0.0
            out.bend_rad_s = 0.0
            out.plan_left_s = model.stop_min_s + (model.stop_max_s - model.stop_min_s) * wp.randf(state)
        else:
            out.plan_left_s = model.plan_min_s + (model.plan_max_s - model.plan_min_s) * wp.randf(state)
            out.speed_sp = model.speed_min + (model.speed_max - model.speed_min) * wp.randf(state)
            out.course_rad = wrap_pi(out.course_rad + model.course_std_rad * wp.randn(state))
            out.bend_rad_s = model.bend_std_rad_s * wp.randn(state)
            out.clearance_m = model.clearance_min_m + (model.clearance_max_m - model.clearance_min_m) * wp.randf(state)
            if wp.randf(state) < model.graze_fraction:
                position = wp.vec2(person.pos_ned[0], person.pos_ned[1])
                out.course_rad = towards_tree(w.forest, position, out.course_rad, out.clearance_m)
                out.bend_rad_s = 0.0
    out.course_rad = inward_course(w, out)
    return out


@wp.func
def ahead_m(person: Person) -> float:
    """How far ahead the person looks [m]."""
    return wp.clamp(_AHEAD_S * wp.max(person.speed, person.speed_sp), _AHEAD_MIN_M, _AHEAD_MAX_M)


@wp.func
def inward_course(w: World, person: Person) -> float:
    """The course [rad], mirrored at a line inside the edge of the map where it would lead beyond."""
    limit = w.terrain.half_size_m - _EDGE_M
    towards_north = wp.cos(person.course_rad)
    towards_east = wp.sin(person.course_rad)
    look = ahead_m(person)
    north = person.pos_ned[0] + look * towards_north
    east = person.pos_ned[1] + look * towards_east
    if wp.abs(north) > limit and north * towards_north > 0.0:
        towards_north = -towards_north
    if wp.abs(east) > limit and east * towards_east > 0.0:
        towards_east = -towards_east
    return wp.atan2(towards_east, towards_north)


@wp.func
def within_map(w: World, north: float, east: float) -> wp.vec2:
    """The position [m], at least a body's width inside the map."""
    limit = w.terrain.half_size_m - 2.0 * BODY_CLEARANCE_M
    return wp.vec2(wp.clamp(north, -limit, limit), wp.clamp(east, -limit, limit))


@wp.func
def slope_fraction(w: World, person: Person) -> float:
    """Speed on the slope ahead over that on the level; Tobler 1993, which gives 1.19 at best and 0.3 at 35 %."""
    north = person.pos_ned[0] + _SLOPE_STEP_M * wp.cos(person.heading_rad)
    east = person.pos_ned[1] + _SLOPE_STEP_M * wp.sin(person.heading_rad)
    slope = (ground_height(w, north, east) + person.pos_ned[2]) / _SLOPE_STEP_M
    return wp.min(wp.exp(-3.5 * (wp.abs(slope + 0.05) - 0.05)), 1.0)  # nobody goes faster than they chose to


@wp.func
def free_course(w: World, person: Person) -> float:
    """The course [rad], turned to the nearer tangent of a tree that is in the way; and once more for the next tree."""
    position = wp.vec2(person.pos_ned[0], person.pos_ned[1])
    once = around_nearest(w.forest, position, person.course_rad, ahead_m(person), person.clearance_m)
    if once == person.course_rad:
        return once
    return around_nearest(w.forest, position, once, ahead_m(person), person.clearance_m)
