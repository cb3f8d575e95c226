"""Navigate's kernels, one thread per environment, in the order of a decision.

act       actions to commands                            (then the rig advances by the delay)
command   commands to setpoints                          (then it advances on, ranges or depths are taken)
judge     the vector, the reward, the end                (rows that end start anew:)
prepare   numbers and seeds of the new episode           (then worlds grow and vehicles take their hovers)
place     wind, sensors and mass, the goal               (then ranges or depths again)
show      the first vector
"""

from typing import Any

import warp as wp

from policies.tasks.episode import StepBuffers, close_step, open_frame
from policies.tasks.flight.episode_draws import draw_angle
from policies.tasks.flight.episode_start import Start, ask_for_world, begin_flight, continuous_action
from policies.tasks.flight.flight_params import FlightParams
from policies.tasks.flight.flown_vehicle import velocity_setpoint
from policies.tasks.flight.own_state import Command, action_command
from policies.tasks.flight.reported import attitude_error, reported_estimate
from policies.tasks.navigate.navigate_params import NavigateParams
from policies.tasks.navigate.observe import write_frame
from policies.tasks.navigate.reward import navigate_outcome, navigate_reward
from policies.tasks.navigate.vehicles import goal_shown, own, touches, vary
from policies.tasks.navigate.walking_goal import follow_speed, walk_vel
from sim.truth import Truth
from sim.world.world import World, ground_height, obstacle_contact

wp.set_module_options({"enable_backward": False})

_ROOM_MAX_M = wp.constant(2.0)  # the largest radius that contact is asked with
_EDGE_M = wp.constant(5.0)  # a goal walks no nearer to the edge of the map
_BEARING_STREAM = wp.constant(6)
_DISTANCE_STREAM = wp.constant(7)
_ERROR_STREAM = wp.constant(10)

MEASURES = ("distance_m", "speed_m_s", "room_m", "path_m", "time_s", "start_distance_m")
"""After each decision, the simulator's truth: distance to the goal, speed, room to trunks and crowns (at most 2 m), the
way flown since the start of the episode, how long it took, and how far the goal was then."""


@wp.struct
class Rules:
    """What the settings choose; the same for all rows."""

    has_rays: int
    has_estimator: int
    decision_s: float


@wp.struct
class NavigateState:
    """All that an episode has beside the rig and its world."""

    flight: wp.array(dtype=FlightParams)
    params: wp.array(dtype=NavigateParams)
    actions: wp.array(dtype=wp.vec4)  # the last
    goals_ned: wp.array(dtype=wp.vec3)
    pos_ned: wp.array(dtype=wp.vec3)  # where the vehicle was at the last decision
    path_m: wp.array(dtype=float)
    start_distance_m: wp.array(dtype=float)
    attitude_errors: wp.array(dtype=wp.quat)  # of the attitude that is told
    ranges_m: wp.array2d(dtype=float)  # (envs, RANGES) as they are shown
    scans_m: wp.array3d(dtype=float)  # (envs, KEPT_SCANS, RANGES) as they were measured, newest first
    scan_poses: wp.array2d(dtype=wp.vec3)  # (envs, KEPT_SCANS) north, east and heading, by the estimate
    measures: wp.array2d(dtype=float)  # (envs, MEASURES)
    is_all: wp.array(dtype=wp.bool)  # every row


@wp.func
def goal_vel(buffers: StepBuffers, rules: Rules, state: NavigateState, i: int) -> wp.vec3:
    """Velocity of a goal that walks [m/s]."""
    time_s = float(buffers.steps[i]) * rules.decision_s
    return walk_vel(state.params[i].walk_m_s, buffers.seed[i], i, buffers.episodes[i] - 1, time_s)


@wp.kernel(enable_backward=False)
def act(buffers: StepBuffers, rules: Rules, rig: Any, state: NavigateState, commands: wp.array(dtype=Command)) -> None:
    i = wp.tid()
    estimate = reported_estimate(rig, i, rules.has_estimator, state.attitude_errors)
    asked = action_command(continuous_action(buffers, i), estimate.q_ned_from_frd)
    kept_m = state.params[i].kept_m
    if kept_m > 0.0:
        limit = follow_speed(state.goals_ned[i] - rig.truth[i].pos_ned, goal_vel(buffers, rules, state, i), kept_m)
        speed = wp.sqrt(asked.vel_ned[0] * asked.vel_ned[0] + asked.vel_ned[1] * asked.vel_ned[1])
        slower = wp.min(limit / wp.max(speed, 1.0e-3), 1.0)
        asked.vel_ned = wp.vec3(slower * asked.vel_ned[0], slower * asked.vel_ned[1], asked.vel_ned[2])
    commands[i] = asked


@wp.kernel(enable_backward=False)
def command(rig: Any, commands: wp.array(dtype=Command)) -> None:
    i = wp.tid()
    rig.autopilot.setpoint[i] = velocity_setpoint(commands[i])


@wp.func
def room_beside(world: World, truth: Truth) -> float:
    """Distance from the vehicle's middle to the nearest trunk or crown [m], at most 2 m."""
    return _ROOM_MAX_M - obstacle_contact(world, truth.pos_ned, _ROOM_MAX_M)[3]


@wp.func
def observe(buffers: StepBuffers, rules: Rules, rig: Any, state: NavigateState, i: int) -> None:
    """The newest frame of the observation."""
    at = open_frame(buffers, i)
    shown = own(rig, i, rules.has_estimator)
    shown.q_ned_from_frd = state.attitude_errors[i] * shown.q_ned_from_frd
    goal_ned = goal_shown(rig, shown, state.goals_ned[i])
    write_frame(rules.has_rays, shown, state.actions[i], goal_ned, state.ranges_m, buffers.observations, i, at)


@wp.kernel(enable_backward=False)
def judge(buffers: StepBuffers, rules: Rules, rig: Any, state: NavigateState, start: Start) -> None:
    i = wp.tid()
    params = state.params[i]
    truth = rig.truth[i]
    last_pos_ned = state.pos_ned[i]
    last_action = state.actions[i]
    action = continuous_action(buffers, i)
    state.actions[i] = action
    state.pos_ned[i] = truth.pos_ned
    state.path_m[i] += wp.length(truth.pos_ned - last_pos_ned)
    goal_ned = state.goals_ned[i]
    distance_m = wp.length(goal_ned - truth.pos_ned)
    progress_m = wp.length(goal_ned - last_pos_ned) - distance_m
    time_s = float(buffers.steps[i] + 1) * rules.decision_s
    room_m = room_beside(rig.worlds[rig.i_world[i]], truth)
    outcome = navigate_outcome(
        params, distance_m, touches(rig, i), truth.height_agl_m, time_s, state.start_distance_m[i]
    )
    reward = navigate_reward(params, truth, progress_m, rules.decision_s, room_m, outcome, action, last_action)
    if params.kept_m > 0.0:
        half = rig.worlds[rig.i_world[i]].terrain.half_size_m - _EDGE_M
        step_ned = rules.decision_s * goal_vel(buffers, rules, state, i)
        north = wp.clamp(goal_ned[0] + step_ned[0], -half, half)
        east = wp.clamp(goal_ned[1] + step_ned[1], -half, half)
        state.goals_ned[i] = wp.vec3(north, east, goal_ned[2])
    state.measures[i, 0] = distance_m
    state.measures[i, 1] = wp.length(truth.vel_ned)
    state.measures[i, 2] = room_m
    state.measures[i, 3] = state.path_m[i]
    state.measures[i, 4] = time_s
    state.measures[i, 5] = state.start_distance_m[i]
    observe(buffers, rules, rig, state, i)
    start.is_starting[i] = close_step(buffers, i, reward, outcome)


@wp.kernel(enable_backward=False)
def prepare(buffers: StepBuffers, state: NavigateState, start: Start) -> None:
    i = wp.tid()
    start.is_growing[i] = False
    if not start.is_starting[i]:
        return
    episode = begin_flight(buffers, start, i)
    params = state.params[i]
    state.actions[i] = wp.vec4()
    if episode % wp.max(int(params.episodes_per_world), 1) == 0:
        ask_for_world(buffers, start, i, episode, params.hill_height_m, params.trees_per_ha)


@wp.kernel(enable_backward=False)
def place(buffers: StepBuffers, rig: Any, state: NavigateState, start: Start) -> None:
    i = wp.tid()
    if not start.is_starting[i]:
        return
    seed = buffers.seed[i]
    episode = buffers.episodes[i] - 1
    params = state.params[i]
    vary(rig, start.makes, state.flight[i], seed, i, episode)
    state.attitude_errors[i] = attitude_error(params.attitude_error_deg, seed, i, episode, _ERROR_STREAM)
    pos_ned = rig.truth[i].pos_ned
    bearing = draw_angle(seed, i, episode, _BEARING_STREAM)
    fraction = draw_angle(seed, i, episode, _DISTANCE_STREAM) / (2.0 * wp.pi) + 0.5
    away_m = params.goal_min_m + fraction * wp.max(params.goal_max_m - params.goal_min_m, 0.0)
    north = away_m * wp.cos(bearing)
    east = away_m * wp.sin(bearing)
    up = ground_height(rig.worlds[rig.i_world[i]], north, east) + params.goal_height_m
    goal_ned = wp.vec3(north, east, -up)
    state.goals_ned[i] = goal_ned
    state.pos_ned[i] = pos_ned
    state.path_m[i] = 0.0
    state.start_distance_m[i] = wp.length(goal_ned - pos_ned)


@wp.kernel(enable_backward=False)
def show(buffers: StepBuffers, rules: Rules, rig: Any, state: NavigateState, start: Start) -> None:
    i = wp.tid()
    if start.is_starting[i]:
        observe(buffers, rules, rig, state, i)
