"""Who is there: the owner, their phone, and people who cross the way; how they walk, what they wear, when they hide.

In: an episode's numbers. Out: the people of its row, owner first, as they truly are and as a camera can see them. Of
training and of flights; a person is stepped at 50 Hz.
"""

import warp as wp

from common.kernels import TICK_S
from common.rng import draw_key
from policies.tasks.follow_me.follow_me_params import FollowParams
from sim.rng_streams import BYSTANDER
from sim.sensors.phone import PhoneModel
from sim.world.clothes import Clothes, any_clothes, hue_colour
from sim.world.footways import clear_of_trunks
from sim.world.people import PERSON_DT_S, Person, PersonModel, person_start, person_step, within_map
from sim.world.world import World, ground_height

wp.set_module_options({"enable_backward": False})

PEOPLE_MAX = 4  # the owner and three others
BYSTANDERS_MAX = wp.constant(PEOPLE_MAX - 1)
_TICKS_PER_S = wp.constant(1.0 / TICK_S)
_STEP_S = wp.constant(PERSON_DT_S)
_LAG_MAX_PERIODS = wp.constant(3)  # fewer than a phone has room for
_RADIANS = wp.constant(3.14159265 / 180.0)
_HIDE_STREAM = wp.constant(9)
_CLOTHES_STREAM = wp.constant(10)
_CROUCH_STREAM = wp.constant(11)
_FOR_GOOD_S = wp.constant(1000.0)
_SEED_STEP = wp.constant(7919)  # between the walks of one row's people
_NEAR_M, _FAR_M = wp.constant(2.0), wp.constant(7.0)  # from the owner, where bystanders start; guess
_PASS_M = wp.constant(1.5)  # how far beside the owner they aim; guess
_GIVES_WAY_M = wp.constant(1.3)  # to a vehicle; guess
_DODGE_M_S = wp.constant(2.5)  # how fast they step aside; guess
_WALKS_M_S = wp.constant(2.0)  # bystanders do not run
_CROUCHED = wp.constant(0.55)  # of the stature; guess
_STANDS_M_S = wp.constant(0.1)
_BRIGHT = wp.constant(0.5)  # of a shirt whose hue is given


@wp.func
def owner_of(model: PersonModel, n: FollowParams) -> PersonModel:
    """How the owner of an episode walks."""
    model.speed_max = n.owner_speed_max
    model.speed_min = wp.min(model.speed_min, n.owner_speed_max)
    model.stop_fraction = n.owner_stop_share
    model.graze_fraction = n.owner_graze_share
    model.course_std_rad = n.owner_course_std_deg * _RADIANS
    return model


@wp.func
def phone_of(model: PhoneModel, n: FollowParams) -> PhoneModel:
    """Their phone."""
    model.period_ticks = wp.max(int(wp.round(n.phone_period_s * _TICKS_PER_S)), 1)
    lag_ticks = int(wp.round(n.phone_lag_s * _TICKS_PER_S))
    model.lag_ticks = wp.min(lag_ticks, _LAG_MAX_PERIODS * model.period_ticks)
    model.pos_std_ned = n.phone_error * model.pos_std_ned
    model.correlated_std_ned = n.phone_error * model.correlated_std_ned
    model.vel_std = n.phone_error * model.vel_std
    model.dropouts_per_tick = n.phone_dropouts_per_min / (60.0 * _TICKS_PER_S)
    model.dropout_min_ticks = n.phone_dropout_scale * model.dropout_min_ticks
    model.dropout_max_ticks = n.phone_dropout_scale * model.dropout_max_ticks
    return model


@wp.func
def is_hidden(n: FollowParams, seed: int, i: int, since_s: float) -> bool:
    """Whether the owner cannot be seen at a time since they set off: once in each span, at a time of its own."""
    if n.owner_hides_per_min <= 0.0 or n.owner_hide_s <= 0.0:
        return False
    span_s = 60.0 / n.owner_hides_per_min
    free_s = wp.max(span_s - n.owner_hide_s, 0.5 * span_s)  # a hiding begins in it
    span = int(since_s / span_s)
    begin_s = span_s * float(span) + free_s * wp.randf(draw_key(seed, i, span, _HIDE_STREAM))
    if since_s >= begin_s and since_s < begin_s + n.owner_hide_s:
        return True
    return n.owner_hide_s >= _FOR_GOOD_S and since_s >= free_s * wp.randf(draw_key(seed, i, 0, _HIDE_STREAM))


@wp.func
def clothes_of(n: FollowParams, usual: Clothes, seed: int, i: int, k: int) -> Clothes:
    """What person k of a row wears: the owner the usual, a given colour, or anything; others anything, or the same."""
    state = draw_key(seed, i, k, _CLOTHES_STREAM)
    fraction = wp.where(k == 0, n.owner_clothes_fraction, 1.0 - n.bystander_likeness)
    who = wp.where(wp.randf(state) < fraction, k, 0)
    if who == 0 and wp.randf(draw_key(seed, i, 0, _CLOTHES_STREAM)) >= n.owner_clothes_fraction:
        if n.owner_hue >= 0.0:
            usual.shirt = hue_colour(n.owner_hue, 0.95, _BRIGHT)
        return usual
    return any_clothes(seed, i, who)


@wp.func
def owner_start(w: World, model: PersonModel, n: FollowParams, place: wp.vec3, seed: int, i: int, tick: int) -> Person:
    """The owner at a place: north [m], east [m], heading [rad]."""
    person = person_start(w, model, place[0], place[1], place[2], seed, i, tick)
    person.stature_m = n.owner_size * person.stature_m
    return person


@wp.func
def bystander_start(
    w: World, model: PersonModel, n: FollowParams, owner: Person, seed: int, i: int, k: int, tick: int
) -> Person:
    """Person k, somewhere round the owner; nobody, if there are fewer."""
    if float(k) > n.bystanders + 0.5:
        return Person()
    state = draw_key(seed, i, k, BYSTANDER)
    way = 6.2831853 * wp.randf(state)
    far_m = _NEAR_M + (_FAR_M - _NEAR_M) * wp.randf(state)
    north = owner.pos_ned[0] + far_m * wp.cos(way)
    east = owner.pos_ned[1] + far_m * wp.sin(way)
    return person_start(w, model, north, east, way, seed + _SEED_STEP * k, i, tick)


@wp.func
def bystander_step(
    w: World,
    model: PersonModel,
    person: Person,
    owner: Person,
    vehicle_ned: wp.vec3,
    seed: int,
    i: int,
    k: int,
    tick: int,
) -> Person:
    """Person k after a step: each plan is to pass the owner closely; they give way to the vehicle."""
    if person.stature_m <= 0.0:
        return person
    model.speed_max = wp.min(model.speed_max, _WALKS_M_S)
    own_seed = seed + _SEED_STEP * k
    out = person_step(w, model, person, own_seed, i, tick, _STEP_S)
    if out.plan_left_s > person.plan_left_s and out.speed_sp > 0.0:
        state = draw_key(own_seed, i, tick, BYSTANDER)
        way = owner.pos_ned + owner.vel_ned - out.pos_ned  # to where they will be in a second
        aside = _PASS_M * (2.0 * wp.randf(state) - 1.0)
        far_m = wp.max(wp.length(wp.vec2(way[0], way[1])), 0.1)
        out.course_rad = wp.atan2(way[1], way[0]) + wp.atan2(aside, far_m)
        out.bend_rad_s = 0.0
    return given_way(w, out, vehicle_ned)


@wp.func
def given_way(w: World, person: Person, vehicle_ned: wp.vec3) -> Person:
    """The person, out of the way of a vehicle that is nearer than they like."""
    away = wp.vec2(person.pos_ned[0] - vehicle_ned[0], person.pos_ned[1] - vehicle_ned[1])
    far_m = wp.max(wp.length(away), 0.01)
    low = person.pos_ned[2] - vehicle_ned[2] < person.stature_m + _GIVES_WAY_M
    if far_m < _GIVES_WAY_M and low:
        step_m = wp.min(_GIVES_WAY_M - far_m, _DODGE_M_S * _STEP_S)
        north = person.pos_ned[0] + step_m * away[0] / far_m
        east = person.pos_ned[1] + step_m * away[1] / far_m
        position = clear_of_trunks(w.forest, within_map(w, north, east))
        person.pos_ned = wp.vec3(position[0], position[1], -ground_height(w, position[0], position[1]))
    return person


@wp.func
def drawn_owner(person: Person, n: FollowParams, seed: int, i: int, since_s: float) -> Person:
    """The owner as a camera can see them: crouched where they stand still, at times; or hidden."""
    if is_hidden(n, seed, i, since_s):
        person.stature_m = 0.0
    elif wp.length(person.vel_ned) < _STANDS_M_S and n.owner_crouch_fraction > 0.0:
        plan = int(since_s / 4.0)
        if wp.randf(draw_key(seed, i, plan, _CROUCH_STREAM)) < n.owner_crouch_fraction:
            person.stature_m = _CROUCHED * person.stature_m
    return person
