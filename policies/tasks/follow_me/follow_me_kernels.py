"""FollowMe's kernels, one thread per environment, in the order of a decision.

decide    actions to what they ask for
act       that to setpoints                              (then the rig advances)
walk      the owner, their phone and others, over the same time
look      where the owner truly is from there            (then ranges and images are taken, or sights drawn)
judge     the vector, the reward, the end                (rows that end start anew:)
prepare   numbers and seeds of the new episode           (then worlds grow and vehicles take their hovers)
place     wind, sensors and mass, the owner, their phone (then look, ranges and images again)
show      the first vector
"""

import warp as wp

from common.kernels import TICK_S, TICK_US
from common.rng import draw_tick
from policies.tasks.episode import StepBuffers, close_step_in_time, open_frame
from policies.tasks.flight.episode_draws import PATH_STREAM, draw_angle, draw_seed
from policies.tasks.flight.episode_start import Start, ask_for_world, begin_flight, continuous_action
from policies.tasks.flight.flight_params import FlightParams
from policies.tasks.flight.flown_vehicle import (
    own_state,
    vary_vehicle,
    vehicle_estimate,
    velocity_setpoint,
)
from policies.tasks.flight.own_state import Command, action_command
from policies.tasks.follow_me.cast import (
    BYSTANDERS_MAX,
    bystander_start,
    bystander_step,
    clothes_of,
    drawn_owner,
    owner_of,
    owner_start,
    phone_of,
)
from policies.tasks.follow_me.follow_me_params import FollowParams
from policies.tasks.follow_me.observe import (
    REPORT_LAG_S,
    REPORT_OLD_S,
    TRACKED,
    OwnerReport,
    document_action,
    write_vector,
)
from policies.tasks.follow_me.others import kept_from_others, room_between
from policies.tasks.follow_me.owner_visibility import Sight, lens_in, reach_from, see
from policies.tasks.follow_me.privileged import write_privileged
from policies.tasks.follow_me.reward import document_reward, follow_outcome, follow_reward, is_in_band
from policies.tasks.follow_me.tracked.guarding import guarded
from policies.tasks.follow_me.tracked.keep_off import KeepOff
from policies.tasks.follow_me.tracked.sight_model import Tracked
from policies.tasks.follow_me.tracked.vector import command_fractions, next_command, write_tracked
from sim.advance import RigArrays
from sim.sensors.camera import Lens
from sim.sensors.phone import PhoneModel, PhoneState, phone_start, phone_step
from sim.sensors.sensors import roughened
from sim.truth import has_touched
from sim.world.clothes import Clothes
from sim.world.people import PERSON_DT_S, PERSON_TICKS, Person, PersonModel, person_step

wp.set_module_options({"enable_backward": False})

ACT_TICKS = 5  # parts of a decision, at each of which setpoints may arrive
_STEP_S = wp.constant(PERSON_DT_S)
_STEP_TICKS = wp.constant(PERSON_TICKS)
_TICKS_PER_S = wp.constant(1.0 / TICK_S)
_PART_S = wp.constant(ACT_TICKS * TICK_S)
_REPORT_LAG_S = wp.constant(REPORT_LAG_S)
_PRIVILEGED = wp.constant(-1)
_DISTANCE_STREAM = wp.constant(6)
_BEARING_STREAM = wp.constant(7)
_HEADING_STREAM = wp.constant(8)

MEASURES = (
    "distance_m", "bearing_rad", "is_in_view", "is_collided", "is_in_band", "room_m", "owner_speed_m_s", "speed_m_s",
)  # fmt: skip
"""Of each decision, the simulator's truth: distance to the owner's chest, its bearing from the true heading, whether
the image shows some of the owner, whether anything was touched or the owner came too near, whether the distance is in
the band, room to obstacles and others (at most 2 m), and both speeds."""


@wp.struct
class Rules:
    """What the settings choose; the same for all rows."""

    vector: int  # EGO, EGO_BLIND, DOCUMENT or TRACKED; -1: the truth
    is_documented: int
    has_estimator: int
    has_privileged: int
    is_kept: int  # terrain
    decision_ticks: int
    keep_off: KeepOff


@wp.struct
class FollowState:
    """All that an episode has beside the rig and its world."""

    flight: wp.array(dtype=FlightParams)
    params: wp.array(dtype=FollowParams)
    actions: wp.array(dtype=wp.vec4)  # the last
    asked: wp.array(dtype=Command)  # by them
    people: wp.array(dtype=Person)  # the owners
    bystanders: wp.array2d(dtype=Person)  # (envs, others)
    drawn: wp.array2d(dtype=Person)  # (envs, people): all as cameras can see them
    clothes: wp.array2d(dtype=Clothes)
    person_models: wp.array(dtype=PersonModel)
    phones: wp.array(dtype=PhoneState)
    phone_models: wp.array(dtype=PhoneModel)
    path_seeds: wp.array(dtype=int)
    sights: wp.array(dtype=Sight)
    reaches_m: wp.array(dtype=float)  # least distance to the owner's body during the decision
    unseen_s: wp.array(dtype=float)
    nearness: wp.array2d(dtype=float)  # (envs, RANGES)
    lenses: wp.array(dtype=Lens)
    measures: wp.array2d(dtype=float)  # (envs, MEASURES)
    is_all: wp.array(dtype=wp.bool)  # every row
    usual_person: wp.array(dtype=PersonModel)  # (1,), before an episode's parameters
    usual_clothes: wp.array(dtype=Clothes)  # (1,)
    image_ages_s: wp.array(dtype=float)
    usual_phone: wp.array(dtype=PhoneModel)  # (1,)
    tracked: Tracked


@wp.func
def chosen_action(buffers: StepBuffers, rules: Rules, i: int) -> wp.vec4:
    """The action that lies in the buffers, in [-1, 1]."""
    if rules.is_documented == 1:
        return document_action(buffers.branches[i, 0], buffers.branches[i, 1], buffers.branches[i, 2])
    return continuous_action(buffers, i)


@wp.kernel(enable_backward=False)
def decide(buffers: StepBuffers, rules: Rules, rig: RigArrays, state: FollowState) -> None:
    """What the actions ask for, as a companion makes it of them at once."""
    i = wp.tid()
    state.asked[i] = asked(buffers, rules, rig, state, i)


@wp.kernel(enable_backward=False)
def act(rig: RigArrays, state: FollowState, part: int) -> None:
    """Gives the flight controller what reaches it in this part of the decision."""
    i = wp.tid()
    if int(wp.round(state.params[i].setpoint_lag_s / _PART_S)) == part:
        rig.autopilot.setpoint[i] = velocity_setpoint(state.asked[i])


@wp.kernel(enable_backward=False)
def walk(buffers: StepBuffers, rules: Rules, rig: RigArrays, state: FollowState) -> None:
    i = wp.tid()
    world = rig.worlds[rig.i_world[i]]
    model = state.person_models[i]
    phone_model = state.phone_models[i]
    person = state.people[i]
    phone = state.phones[i]
    seed = state.path_seeds[i]
    truth = rig.truth[i]
    reach_m = float(wp.inf)
    end = draw_tick(rig.tick[i])
    for tick in range(end - rules.decision_ticks, end, _STEP_TICKS):
        place_ned = truth.pos_ned - float(end - tick - _STEP_TICKS) / _TICKS_PER_S * truth.vel_ned
        for k in range(BYSTANDERS_MAX):
            other = bystander_step(world, model, state.bystanders[i, k], person, place_ned, seed, i, k + 1, tick)
            state.bystanders[i, k] = other
            if other.stature_m > 0.0:
                reach_m = wp.min(reach_m, reach_from(place_ned, other))
        person = person_step(world, model, person, seed, i, tick, _STEP_S)
        phone = phone_step(phone_model, phone, person, seed, i, tick + _STEP_TICKS)
        reach_m = wp.min(reach_m, reach_from(place_ned, person))
    state.reaches_m[i] = reach_m
    state.people[i] = person
    state.phones[i] = phone
    draw_people(state, i, float((buffers.steps[i] + 1) * rules.decision_ticks) / _TICKS_PER_S)


@wp.func
def draw_people(state: FollowState, i: int, since_s: float) -> None:
    """Puts a row's people before its camera."""
    state.drawn[i, 0] = drawn_owner(state.people[i], state.params[i], state.path_seeds[i], i, since_s)
    for k in range(BYSTANDERS_MAX):
        state.drawn[i, k + 1] = state.bystanders[i, k]


@wp.kernel(enable_backward=False)
def look(rig: RigArrays, state: FollowState, rows: wp.array(dtype=wp.bool)) -> None:
    i = wp.tid()
    if rows[i]:
        truth = rig.truth[i]
        params = state.params[i]
        sight = see(rig.worlds[rig.i_world[i]], truth, params, state.people[i], state.drawn[i, 0])
        for k in range(BYSTANDERS_MAX):
            sight.room_m = wp.min(sight.room_m, room_between(truth.pos_ned, state.bystanders[i, k]))
        state.sights[i] = sight
        state.lenses[i] = lens_in(truth, params)


@wp.func
def owner_report(phone: PhoneState, model: PhoneModel, tick: int) -> OwnerReport:
    """What the phone's newest report tells at a tick; how late it came nobody knows, and takes it to be the usual."""
    report = OwnerReport()
    true_age_s = float(wp.int64(tick) * wp.int64(TICK_US) - phone.fix.time_us) * 1.0e-6
    age_s = true_age_s - float(model.lag_ticks) / _TICKS_PER_S + _REPORT_LAG_S
    if phone.fix.is_known == 1 and age_s < REPORT_OLD_S:
        report.pos_ned = phone.fix.pos_ned
        report.vel_ned = phone.fix.vel_ned
        report.age_s = age_s
        report.is_known = 1
    return report


@wp.func
def write_tracked_frame(
    buffers: StepBuffers, rules: Rules, rig: RigArrays, state: FollowState, i: int, at: int
) -> None:
    """The newest frame of what a policy without images is told."""
    own = own_state(rig, i, rules.has_estimator)
    write_tracked(
        own,
        state.actions[i],
        state.image_ages_s[i],
        state.tracked.filters[i],
        state.tracked.has_depth[i],
        state.tracked.nearness,
        buffers.observations,
        i,
        at,
    )


@wp.func
def asked(buffers: StepBuffers, rules: Rules, rig: RigArrays, state: FollowState, i: int) -> Command:
    """What the action in the buffers asks for; kept, if the next goes on from it."""
    action = chosen_action(buffers, rules, i)
    q_ned_from_frd = vehicle_estimate(rig, i, rules.has_estimator).q_ned_from_frd
    if rules.vector != TRACKED:
        return action_command(action, q_ned_from_frd)
    command = next_command(state.tracked.commands[i], action, q_ned_from_frd)
    if state.params[i].guard == 1.0:
        own = own_state(rig, i, rules.has_estimator)
        age_s = state.image_ages_s[i]
        people, tracked = state.drawn, state.tracked
        command = guarded(command, own, tracked.filters[i], age_s, tracked.has_depth[i], rules.keep_off)
        command = kept_from_others(command, own, rig.truth[i], people, tracked, age_s, rules.keep_off, i)
    state.tracked.before[i] = state.tracked.commands[i]
    state.tracked.commands[i] = command
    return command


@wp.func
def write_frame(buffers: StepBuffers, rules: Rules, rig: RigArrays, state: FollowState, i: int) -> None:
    """The newest frame of the observation, and what the critic sees."""
    at = open_frame(buffers, i)
    truth = rig.truth[i]
    action = state.actions[i]
    if rules.vector == _PRIVILEGED:
        write_privileged(truth, state.sights[i], state.unseen_s[i], action, state.nearness, buffers.observations, i, at)
    elif rules.vector == TRACKED:
        write_tracked_frame(buffers, rules, rig, state, i, at)
    else:
        own = own_state(rig, i, rules.has_estimator)
        report = owner_report(state.phones[i], state.phone_models[i], draw_tick(rig.tick[i]))
        age_s = state.image_ages_s[i]
        write_vector(rules.vector, own, report, action, age_s, buffers.observations, i, at)
    if rules.has_privileged == 1:
        write_privileged(truth, state.sights[i], state.unseen_s[i], action, state.nearness, buffers.privileged, i, 0)


@wp.func
def write_measures(state: FollowState, rig: RigArrays, i: int, is_collided: bool) -> None:
    """The row of `MEASURES`."""
    sight = state.sights[i]
    state.measures[i, 0] = sight.distance_m
    state.measures[i, 1] = sight.bearing_rad
    state.measures[i, 2] = float(sight.is_in_view)
    state.measures[i, 3] = float(is_collided)
    state.measures[i, 4] = float(is_in_band(state.params[i], sight))
    state.measures[i, 5] = sight.room_m
    state.measures[i, 6] = wp.length(sight.vel_hfrd)
    state.measures[i, 7] = wp.length(rig.truth[i].vel_ned)


@wp.kernel(enable_backward=False)
def judge(buffers: StepBuffers, rules: Rules, rig: RigArrays, state: FollowState, start: Start) -> None:
    i = wp.tid()
    params = state.params[i]
    sight = state.sights[i]
    last_action = state.actions[i]
    action = chosen_action(buffers, rules, i)
    if rules.vector == TRACKED:  # what is asked for, as of all others
        q_ned_from_frd = vehicle_estimate(rig, i, rules.has_estimator).q_ned_from_frd
        last_action = command_fractions(state.tracked.before[i], q_ned_from_frd)
        action = command_fractions(state.tracked.commands[i], q_ned_from_frd)
    state.actions[i] = action
    state.unseen_s[i] = wp.where(
        sight.is_in_view == 1, 0.0, state.unseen_s[i] + float(rules.decision_ticks) / _TICKS_PER_S
    )
    touched = has_touched(rig.truth[i])
    sight.reach_m = state.reaches_m[i]
    outcome = follow_outcome(params, sight, touched, state.unseen_s[i], buffers.steps[i] + 1)
    reward = float(0.0)
    if rules.is_documented == 1:
        reward = document_reward(params, sight, outcome)
    else:
        reward = follow_reward(params, sight, outcome, action, last_action)
    write_measures(state, rig, i, touched or sight.reach_m < params.touch_m)
    write_frame(buffers, rules, rig, state, i)
    start.is_starting[i] = close_step_in_time(buffers, i, reward, outcome)


@wp.kernel(enable_backward=False)
def prepare(buffers: StepBuffers, rules: Rules, state: FollowState, start: Start) -> None:
    i = wp.tid()
    start.is_growing[i] = False
    if not start.is_starting[i]:
        return
    episode = begin_flight(buffers, start, i)
    params = state.params[i]
    state.actions[i] = wp.vec4()
    state.unseen_s[i] = 0.0
    state.path_seeds[i] = draw_seed(buffers.seed[i], i, episode, PATH_STREAM, start.split)
    if rules.is_kept == 0 or episode == 0:
        ask_for_world(buffers, start, i, episode, params.hill_height_m, params.trees_per_ha)


@wp.func
def phone_that_has_reported(model: PhoneModel, person: Person, seed: int, i: int, tick: int) -> PhoneState:
    """The phone of an owner who has been standing there for some time."""
    since = tick - 2 * model.period_ticks - model.lag_ticks
    phone = phone_start(model, seed, i, since)
    for then in range(since, tick, _STEP_TICKS):
        phone = phone_step(model, phone, person, seed, i, then)
    return phone_step(model, phone, person, seed, i, tick)


@wp.kernel(enable_backward=False)
def place(buffers: StepBuffers, rig: RigArrays, state: FollowState, start: Start) -> None:
    i = wp.tid()
    if not start.is_starting[i]:
        return
    seed = buffers.seed[i]
    episode = buffers.episodes[i] - 1
    params = state.params[i]
    vary_vehicle(rig, start.makes, state.flight[i], seed, i, episode)
    rig.sensor_model[i] = roughened(rig.sensor_model[i], params.sensor_roughness)
    state.person_models[i] = owner_of(state.usual_person[0], params)
    state.phone_models[i] = phone_of(state.usual_phone[0], params)
    # ahead, some way to one side, looking anywhere
    truth = rig.truth[i]
    nose = wp.quat_rotate(truth.q_ned_from_frd, wp.vec3(1.0, 0.0, 0.0))
    aside = draw_angle(seed, i, episode, _BEARING_STREAM) * params.start_bearing_deg / 180.0
    bearing = wp.atan2(nose[1], nose[0]) + aside
    fraction = draw_angle(seed, i, episode, _DISTANCE_STREAM) / (2.0 * wp.pi) + 0.5
    distance = params.start_distance_min_m + fraction * (params.start_distance_max_m - params.start_distance_min_m)
    north = truth.pos_ned[0] + distance * wp.cos(bearing)
    east = truth.pos_ned[1] + distance * wp.sin(bearing)
    heading = draw_angle(seed, i, episode, _HEADING_STREAM)
    path_seed = state.path_seeds[i]
    tick = draw_tick(rig.tick[i])
    world = rig.worlds[rig.i_world[i]]
    place_and_heading = wp.vec3(north, east, heading)
    person = owner_start(world, state.person_models[i], params, place_and_heading, path_seed, i, tick)
    phone_model = state.phone_models[i]
    state.people[i] = person
    for k in range(BYSTANDERS_MAX):
        model = state.person_models[i]
        state.bystanders[i, k] = bystander_start(world, model, params, person, path_seed, i, k + 1, tick)
        state.clothes[i, k + 1] = clothes_of(params, state.usual_clothes[0], path_seed, i, k + 1)
    state.clothes[i, 0] = clothes_of(params, state.usual_clothes[0], path_seed, i, 0)
    draw_people(state, i, 0.0)
    state.phones[i] = phone_that_has_reported(phone_model, person, path_seed, i, tick)


@wp.kernel(enable_backward=False)
def show(buffers: StepBuffers, rules: Rules, rig: RigArrays, state: FollowState, start: Start) -> None:
    i = wp.tid()
    if start.is_starting[i]:
        write_frame(buffers, rules, rig, state, i)
