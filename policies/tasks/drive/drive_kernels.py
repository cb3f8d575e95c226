"""Drive's kernels, one thread per environment, in the order of a decision.

act       actions to setpoints                           (then the rig advances)
judge     ranges, the vector, the reward, the end        (rows that end start anew:)
prepare   numbers and seeds of the new episode           (then worlds grow and vehicles stand in them)
place     air, sensors, mass and tyres, the goal, the first vector
"""

import warp as wp

from autopilot.ports import SETPOINT_DRIVE, Setpoint
from common.rng import draw_tick
from common.rotation import wrap_pi, yaw_from_quat
from policies.tasks.drive.drive_params import DriveParams
from policies.tasks.drive.goals import course_goal, spot_goal, way_left_m, way_out
from policies.tasks.drive.observe import DriveCommand, drive_command, own_drive, write_frame
from policies.tasks.drive.reward import drive_outcome, drive_reward
from policies.tasks.episode import StepBuffers, close_step, open_frame
from policies.tasks.flight.driven_vehicle import RoverArrays, vary_rover
from policies.tasks.flight.episode_start import Start, ask_for_world, begin_flight
from policies.tasks.flight.flight_params import FlightParams
from policies.tasks.flight.flown_vehicle import free_setpoint
from policies.tasks.flight.moved_ranges import Sectors
from policies.tasks.flight.reported import attitude_error, level_pose, reported_estimate, show_late
from sim.sensors.ground_ring import ring_ranges
from sim.truth import Truth
from sim.world.world import World, obstacle_contact, world_at

wp.set_module_options({"enable_backward": False})

_HALF_WIDTH_M = wp.constant(0.22)  # of the hull
_END_M = wp.constant(0.15)  # from its middle to those of the circles at its ends
_ROOM_MAX_M = wp.constant(1.0)
_ERROR_STREAM = wp.constant(41)

MEASURES = ("distance_m", "heading_error_rad", "speed_m_s", "room_m", "way_left_m", "time_s", "start_way_m")
"""After each decision, the simulator's truth: distance and heading from the goal's, speed, room round the hull (at most
1 m), the way that is left, the time since the start and the way that was left then."""


@wp.struct
class DriveRules:
    """What the settings choose; the same for all rows."""

    has_estimator: int
    spot_count: int  # in a row of the car park, 0: a course
    decision_s: float
    sectors: Sectors


@wp.struct
class DriveState:
    """All that an episode has beside the rig and its world."""

    flight: wp.array(dtype=FlightParams)
    params: wp.array(dtype=DriveParams)
    actions: wp.array(dtype=wp.vec2)  # the last
    goals: wp.array(dtype=wp.vec3)  # north, east, heading
    outs: wp.array(dtype=float)  # of goals: see `way_left_m`
    left_m: wp.array(dtype=float)  # of the way, at the last decision
    start_left_m: wp.array(dtype=float)
    attitude_errors: wp.array(dtype=wp.quat)  # of the attitude that is told
    ranges_m: wp.array2d(dtype=float)  # (envs, SECTORS) as they are shown
    scans_m: wp.array3d(dtype=float)  # (envs, KEPT_SCANS, SECTORS) as they were measured, newest first
    scan_poses: wp.array2d(dtype=wp.vec3)  # (envs, KEPT_SCANS) north, east and heading, by the estimate
    measures: wp.array2d(dtype=float)  # (envs, MEASURES)


@wp.func
def drive_setpoint(command: DriveCommand) -> Setpoint:
    """As of an offboard client's velocity along the nose and yaw rate."""
    setpoint = free_setpoint(SETPOINT_DRIVE)
    setpoint.speed = command.speed
    setpoint.yaw_rate = command.yaw_rate
    return setpoint


@wp.func
def action_of(buffers: StepBuffers, i: int) -> wp.vec2:
    """The two continuous actions that lie in the buffers, in [-1, 1]."""
    return wp.vec2(wp.clamp(buffers.continuous[i, 0], -1.0, 1.0), wp.clamp(buffers.continuous[i, 1], -1.0, 1.0))


@wp.func
def true_pose(truth: Truth) -> wp.vec3:
    """North, east and heading."""
    return wp.vec3(truth.pos_ned[0], truth.pos_ned[1], yaw_from_quat(truth.q_ned_from_frd))


@wp.func
def world_now(rig: RoverArrays, i: int) -> World:
    """The world of a vehicle, the movers where they are."""
    return world_at(rig.worlds[rig.i_world[i]], draw_tick(rig.tick[i]))


@wp.func
def room_round(world: World, truth: Truth) -> float:
    """Distance [m] from the hull, taken for two circles, to the nearest thing, at most 1 m."""
    deepest = float(0.0)
    for end in range(2):
        ahead = wp.vec3((2.0 * float(end) - 1.0) * _END_M, 0.0, 0.0)
        place_ned = truth.pos_ned + wp.quat_rotate(truth.q_ned_from_frd, ahead)
        deepest = wp.max(deepest, obstacle_contact(world, place_ned, _HALF_WIDTH_M + _ROOM_MAX_M)[3])
    return _ROOM_MAX_M - deepest


@wp.func
def show_frame(
    buffers: StepBuffers, rules: DriveRules, rig: RoverArrays, state: DriveState, is_first: int, i: int
) -> None:
    """The newest frame of the observation; `is_first` as an episode begins."""
    truth = rig.truth[i]
    tick = draw_tick(rig.tick[i])
    place = wp.vec2(truth.pos_ned[0], truth.pos_ned[1])
    heading = yaw_from_quat(truth.q_ned_from_frd)
    ring_ranges(world_now(rig, i), place, heading, state.params[i].range_noise, rig.seed[i], tick, state.ranges_m, i)
    reported = reported_estimate(rig, i, rules.has_estimator, state.attitude_errors)
    scans_m, lag_s = state.scans_m, state.params[i].scan_lag_s
    show_late(lag_s, is_first, level_pose(reported), rules.sectors, scans_m, state.scan_poses, state.ranges_m, i)
    at = open_frame(buffers, i)
    write_frame(own_drive(reported), state.actions[i], state.goals[i], state.ranges_m, buffers.observations, i, at)


@wp.kernel(enable_backward=False)
def act(buffers: StepBuffers, rig: RoverArrays) -> None:
    i = wp.tid()
    rig.autopilot.setpoint[i] = drive_setpoint(drive_command(action_of(buffers, i)))


@wp.kernel(enable_backward=False)
def judge(buffers: StepBuffers, rules: DriveRules, rig: RoverArrays, state: DriveState, start: Start) -> None:
    i = wp.tid()
    params = state.params[i]
    truth = rig.truth[i]
    last_action = state.actions[i]
    action = action_of(buffers, i)
    state.actions[i] = action
    pose = true_pose(truth)
    goal = state.goals[i]
    distance_m = wp.length(wp.vec2(goal[0] - pose[0], goal[1] - pose[1]))
    turn_rad = wrap_pi(goal[2] - pose[2])
    left_m = way_left_m(pose, goal, state.outs[i])
    time_s = float(buffers.steps[i] + 1) * rules.decision_s
    room_m = room_round(world_now(rig, i), truth)
    outcome = drive_outcome(params, truth, distance_m, turn_rad, left_m, state.start_left_m[i], time_s)
    speed_m_s = wp.length(truth.vel_ned)
    progress_m = state.left_m[i] - left_m
    reward = drive_reward(params, progress_m, speed_m_s, room_m, outcome, action, last_action)
    state.left_m[i] = left_m
    state.measures[i, 0] = distance_m
    state.measures[i, 1] = turn_rad
    state.measures[i, 2] = speed_m_s
    state.measures[i, 3] = room_m
    state.measures[i, 4] = left_m
    state.measures[i, 5] = time_s
    state.measures[i, 6] = state.start_left_m[i]
    show_frame(buffers, rules, rig, state, 0, i)
    start.is_starting[i] = close_step(buffers, i, reward, outcome)


@wp.kernel(enable_backward=False)
def prepare(buffers: StepBuffers, state: DriveState, start: Start) -> None:
    i = wp.tid()
    start.is_growing[i] = False
    if not start.is_starting[i]:
        return
    episode = begin_flight(buffers, start, i)
    params = state.params[i]
    state.actions[i] = wp.vec2()
    if episode % wp.max(int(params.episodes_per_world), 1) == 0:
        ask_for_world(buffers, start, i, episode, params.hill_height_m, params.trees_per_ha)
        world = start.world_params[i]
        world.wall_count = int(params.wall_count)
        world.mover_count = int(params.mover_count)
        start.world_params[i] = world


@wp.kernel(enable_backward=False)
def place(buffers: StepBuffers, rules: DriveRules, rig: RoverArrays, state: DriveState, start: Start) -> None:
    i = wp.tid()
    if not start.is_starting[i]:
        return
    seed = buffers.seed[i]
    episode = buffers.episodes[i] - 1
    params = state.params[i]
    friction, rolling = params.friction_scale, params.rolling_scale
    vary_rover(rig, start.makes, state.flight[i], friction, rolling, seed, i, episode)
    world = world_now(rig, i)
    goal = course_goal(world, params.goal_min_m, params.goal_max_m, seed, i, episode)
    out = float(0.0)
    if rules.spot_count > 0:
        goal = spot_goal(world, start.world_seeds[i], rules.spot_count, seed, i, episode)
        out = way_out(goal, start.world_seeds[i])
    state.goals[i] = goal
    state.outs[i] = out
    left_m = way_left_m(true_pose(rig.truth[i]), goal, out)
    state.left_m[i] = left_m
    state.start_left_m[i] = left_m
    state.attitude_errors[i] = attitude_error(params.attitude_error_deg, seed, i, episode, _ERROR_STREAM)
    show_frame(buffers, rules, rig, state, 1, i)
