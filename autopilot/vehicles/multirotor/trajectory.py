"""The setpoint trajectory: smooth position, velocity and acceleration towards what the setpoint asks, 50 Hz.

NaN frees an element. Per axis: a finite position is a goal (with a finite velocity: a moving one), else a finite
velocity is followed (zero: brake, then hold the position), else a finite acceleration; nothing finite means hold.
A finite path start makes the way to the position a straight line. Motion is planned along and across the way,
each within speed, acceleration and jerk limits; up and down have their own.

Where the vehicle cannot follow, time on the trajectory slows down and stops; a vehicle carried further away than
MPC_XY_ERR_MAX draws the trajectory along, and the way to the goal begins anew from there.
"""

import warp as wp

from autopilot.control.pid import clamp_horizontal, finite_or
from autopilot.control.profile import (
    AxisLimits,
    Motion,
    flipped,
    step_to_acceleration,
    step_to_position,
    step_to_velocity,
)
from autopilot.ports import Estimate, Setpoint
from autopilot.vehicles.multirotor.params import ControlParams
from common.rotation import wrap_pi, yaw_from_quat

wp.set_module_options({"enable_backward": False})

FOLLOW_ACCEL = wp.constant(0)
FOLLOW_VELOCITY = wp.constant(1)
FOLLOW_POSITION = wp.constant(2)

_EXTRAPOLATE_S = wp.constant(0.3)  # a moving goal not renewed for longer stands still (offboard streams run at 10 Hz)
_GOAL_MOVED = wp.constant(1.0e-3)  # [m] or [m/s]
_STOPPED_M_S = wp.constant(0.3)  # slower than this a braked vehicle takes its place as the position to hold
_DIRECTION_MIN = wp.constant(0.05)  # [m] or [m/s] below which the old direction of motion is kept
_PATH_MIN_M = wp.constant(0.1)


@wp.struct
class TrajectoryState:
    pos_ned: wp.vec3
    vel_ned: wp.vec3  # per time on the trajectory, as is the acceleration
    accel_ned: wp.vec3
    time_fraction: wp.vec3  # fraction of time that passed on the trajectory in the last step, per ned axis
    jerk_ned: wp.vec3  # per time of the vehicle, mean over the last step
    along_ned: wp.vec3  # horizontal direction of motion to the present goal
    goal_ned: wp.vec3  # the last goal asked for, each element a position, velocity or acceleration as `mode` says
    goal_now_ned: wp.vec3  # the same, a moving position carried on between setpoints
    goal_age_s: float
    mode: wp.vec3i  # FOLLOW_* of each axis
    is_locked_xy: int  # braked: the position is held although the position is free
    is_locked_z: int
    yaw: float
    yaw_rate: float
    yaw_goal: float
    reset_count: int


@wp.func
def trajectory_at_estimate(est: Estimate, is_moving: int) -> TrajectoryState:
    """The trajectory that starts at the estimate, with the estimated velocity if the vehicle moves."""
    state = TrajectoryState()
    state.pos_ned = est.pos_ned
    state.goal_ned = wp.vec3(wp.nan, wp.nan, wp.nan)
    state.goal_now_ned = est.pos_ned
    if is_moving == 1:
        state.vel_ned = est.vel_ned
    state.time_fraction = wp.vec3(1.0, 1.0, 1.0)
    state.along_ned = wp.vec3(1.0, 0.0, 0.0)
    state.yaw = yaw_from_quat(est.q_ned_from_frd)
    state.yaw_goal = state.yaw
    state.reset_count = est.reset_count
    return state


@wp.func
def flown_velocity(state: TrajectoryState) -> wp.vec3:
    """Velocity [m/s], ned, of the trajectory per time of the vehicle."""
    return wp.cw_mul(state.time_fraction, state.vel_ned)


@wp.func
def flown_acceleration(state: TrajectoryState) -> wp.vec3:
    """Acceleration [m/s²], ned, of the trajectory per time of the vehicle, at a constant fraction of time."""
    return wp.cw_mul(state.time_fraction, wp.cw_mul(state.time_fraction, state.accel_ned))


@wp.func
def within_speeds(params: ControlParams, vel_ned: wp.vec3) -> wp.vec3:
    """The velocity shortened to the vehicle's speed limits."""
    limited = clamp_horizontal(vel_ned, params.speed_max_xy)
    limited[2] = wp.clamp(limited[2], -params.speed_max_up, params.speed_max_down)
    return limited


@wp.func
def shift_by_reset(params: ControlParams, state: TrajectoryState, est: Estimate) -> TrajectoryState:
    """The trajectory moved along with a jump of the estimate, so that the vehicle is not kicked."""
    moved = state
    if est.reset_count != state.reset_count:
        moved.pos_ned = state.pos_ned + est.pos_reset_ned
        moved.vel_ned = within_speeds(params, state.vel_ned + est.vel_reset_ned)
        moved.yaw = wrap_pi(state.yaw + est.yaw_reset)
        moved.yaw_goal = wrap_pi(state.yaw_goal + est.yaw_reset)
        moved.reset_count = est.reset_count
    return moved


@wp.func
def follow_mode(pos: float, vel: float, accel: float) -> int:
    """What an axis of the setpoint asks to follow; nothing finite is a velocity of zero."""
    if wp.isfinite(pos):
        return FOLLOW_POSITION
    if wp.isfinite(vel):
        return FOLLOW_VELOCITY
    if wp.isfinite(accel):
        return FOLLOW_ACCEL
    return FOLLOW_VELOCITY


@wp.func
def is_path(sp: Setpoint) -> bool:
    """Whether the setpoint asks for a straight line of some length."""
    way = sp.pos_ned - sp.path_start_ned
    length = wp.length(way)
    return wp.isfinite(length) and length > _PATH_MIN_M


@wp.func
def axis_limits(params: ControlParams, sp: Setpoint, axis_ned: wp.vec3, is_cruise: bool, jerk: float) -> AxisLimits:
    """Limits along a direction, from those of the horizontal and the vertical."""
    speed_xy = params.speed_max_xy
    speed_up = params.speed_max_up
    speed_down = params.speed_max_down
    if is_cruise:
        speed_xy = wp.min(wp.max(finite_or(sp.cruise_speed, params.cruise_speed), 0.1), speed_xy)
        speed_up = wp.min(wp.max(finite_or(sp.climb_speed, params.climb_speed), 0.1), speed_up)
        speed_down = wp.min(wp.max(finite_or(sp.descend_speed, params.descend_speed), 0.1), speed_down)
    level = wp.max(wp.sqrt(axis_ned[0] * axis_ned[0] + axis_ned[1] * axis_ned[1]), 1.0e-3)
    steep = wp.max(wp.abs(axis_ned[2]), 1.0e-3)
    limits = AxisLimits()
    limits.jerk = jerk
    limits.speed_positive = wp.min(speed_xy / level, speed_down / steep)
    limits.speed_negative = wp.min(speed_xy / level, speed_up / steep)
    limits.accel_positive = wp.min(params.accel_max_xy / level, params.accel_max_down / steep)
    limits.accel_negative = wp.min(params.accel_max_xy / level, params.accel_max_up / steep)
    if axis_ned[2] < 0.0:  # the positive direction climbs
        return flipped(limits)
    return limits


@wp.func
def move_along(
    params: ControlParams,
    sp: Setpoint,
    state: TrajectoryState,
    axis_ned: wp.vec3,
    mode: int,
    goal_vel_ned: wp.vec3,
    vel_exit: float,
    jerk: float,
    dt_s: float,
) -> Motion:
    """One step of the motion along an axis; a moving goal is approached in its own frame."""
    vel = wp.dot(state.vel_ned, axis_ned)
    accel = wp.dot(state.accel_ned, axis_ned)
    if mode == FOLLOW_VELOCITY:
        limits = axis_limits(params, sp, axis_ned, False, jerk)
        return step_to_velocity(vel, accel, wp.dot(state.goal_now_ned, axis_ned), limits, dt_s)
    if mode == FOLLOW_ACCEL:
        limits = axis_limits(params, sp, axis_ned, False, jerk)
        return step_to_acceleration(vel, accel, wp.dot(state.goal_now_ned, axis_ned), limits, dt_s)
    goal_speed = wp.length(goal_vel_ned)
    distance = wp.dot(state.goal_now_ned - state.pos_ned, axis_ned)
    if goal_speed < _GOAL_MOVED:
        limits = axis_limits(params, sp, axis_ned, True, jerk)
        return step_to_position(distance, vel, accel, vel_exit, limits, dt_s)
    limits = axis_limits(params, sp, axis_ned, False, jerk)
    limits.speed_positive = wp.max(limits.speed_positive - goal_speed, 0.3)
    limits.speed_negative = wp.max(limits.speed_negative - goal_speed, 0.3)
    goal_vel = wp.dot(goal_vel_ned, axis_ned)
    motion = step_to_position(distance, vel - goal_vel, accel, 0.0, limits, dt_s)
    motion.moved = motion.moved + goal_vel * dt_s
    motion.vel = motion.vel + goal_vel
    return motion


@wp.func
def goal_of(sp: Setpoint, mode: wp.vec3i) -> wp.vec3:
    """What each axis follows, in the unit of its mode; 0 where nothing is finite."""
    goal = wp.vec3(0.0, 0.0, 0.0)
    for k in range(3):
        if mode[k] == FOLLOW_POSITION:
            goal[k] = sp.pos_ned[k]
        elif mode[k] == FOLLOW_VELOCITY:
            goal[k] = finite_or(sp.vel_ned[k], 0.0)
        else:
            goal[k] = sp.accel_ned[k]
    return goal


@wp.func
def goal_velocity(sp: Setpoint, mode: wp.vec3i, age_s: float, speed_max: float) -> wp.vec3:
    """Velocity of a moving position goal; zero once it has not been renewed for a while."""
    vel = wp.vec3(0.0, 0.0, 0.0)
    if age_s < _EXTRAPOLATE_S:
        for k in range(3):
            if mode[k] == FOLLOW_POSITION:
                vel[k] = finite_or(sp.vel_ned[k], 0.0)
    speed = wp.length(vel)
    if speed > speed_max:
        vel = vel * (speed_max / speed)
    return vel


@wp.func
def take_goal(state: TrajectoryState, sp: Setpoint, speed_max: float, dt_s: float) -> TrajectoryState:
    """The state with modes and goal of the setpoint, a moving goal carried on, the direction of motion to it."""
    taken = state
    taken.mode = wp.vec3i(
        follow_mode(sp.pos_ned[0], sp.vel_ned[0], sp.accel_ned[0]),
        follow_mode(sp.pos_ned[1], sp.vel_ned[1], sp.accel_ned[1]),
        follow_mode(sp.pos_ned[2], sp.vel_ned[2], sp.accel_ned[2]),
    )
    goal = goal_of(sp, taken.mode)
    if taken.mode == state.mode and wp.length(goal - state.goal_ned) < _GOAL_MOVED:
        taken.goal_age_s = state.goal_age_s + dt_s
        if taken.goal_age_s < _EXTRAPOLATE_S:
            taken.goal_now_ned = state.goal_now_ned + goal_velocity(sp, taken.mode, taken.goal_age_s, speed_max) * dt_s
        else:
            taken.goal_now_ned = goal
        return taken
    taken.goal_ned = goal
    taken.goal_now_ned = goal
    taken.goal_age_s = 0.0
    way = goal - state.accel_ned
    if taken.mode[0] == FOLLOW_POSITION:
        way = goal - state.pos_ned
    if taken.mode[0] == FOLLOW_VELOCITY:
        way = goal - state.vel_ned
    way[2] = 0.0
    length = wp.length(way)
    if taken.mode[0] != taken.mode[1]:
        taken.along_ned = wp.vec3(1.0, 0.0, 0.0)
    elif length > _DIRECTION_MIN:
        taken.along_ned = way / length
    return taken


@wp.func
def anchored(state: TrajectoryState, est: Estimate) -> TrajectoryState:
    """The state in which free elements follow the estimate, and a braked vehicle keeps its place from now on."""
    held = state
    is_still = state.vel_ned[0] == 0.0 and state.vel_ned[1] == 0.0 and state.accel_ned[0] == 0.0
    is_braked = state.goal_now_ned[0] == 0.0 and state.goal_now_ned[1] == 0.0 and state.accel_ned[1] == 0.0
    both_velocity = state.mode[0] == FOLLOW_VELOCITY and state.mode[1] == FOLLOW_VELOCITY
    slow = est.vel_ned[0] * est.vel_ned[0] + est.vel_ned[1] * est.vel_ned[1] < _STOPPED_M_S * _STOPPED_M_S
    was_locked_xy = state.is_locked_xy
    was_locked_z = state.is_locked_z
    held.is_locked_xy = 0
    held.is_locked_z = 0
    if both_velocity and is_still and is_braked and (slow or was_locked_xy == 1):
        held.is_locked_xy = 1
    is_still_z = state.vel_ned[2] == 0.0 and state.accel_ned[2] == 0.0 and state.goal_now_ned[2] == 0.0
    if state.mode[2] == FOLLOW_VELOCITY and is_still_z and (wp.abs(est.vel_ned[2]) < _STOPPED_M_S or was_locked_z == 1):
        held.is_locked_z = 1
    for k in range(3):
        locked = was_locked_xy
        if k == 2:
            locked = was_locked_z
        if state.mode[k] != FOLLOW_POSITION and locked == 0:
            held.pos_ned[k] = est.pos_ned[k]
        if state.mode[k] == FOLLOW_ACCEL:
            held.vel_ned[k] = est.vel_ned[k]
    return held


@wp.func
def follows_position(state: TrajectoryState, axis: int) -> bool:
    """Whether the position loop closes on this ned axis."""
    if axis == 2:
        return state.mode[2] == FOLLOW_POSITION or state.is_locked_z == 1
    return state.mode[axis] == FOLLOW_POSITION or state.is_locked_xy == 1


@wp.func
def waiting(state: TrajectoryState, est: Estimate, lag_max_m: float, is_one_way: bool) -> TrajectoryState:
    """The state with its fraction of time, and drawn along by a vehicle further away than `lag_max_m`, at rest there.

    Up and down wait for themselves, so that a vehicle blown aside at take-off still climbs; but a path is one way.
    """
    waits = state
    lag = wp.vec3(0.0, 0.0, 0.0)
    for k in range(3):
        if follows_position(state, k):
            lag[k] = state.pos_ned[k] - est.pos_ned[k]
    level = wp.sqrt(lag[0] * lag[0] + lag[1] * lag[1])
    away = wp.vec3(level, level, wp.abs(lag[2]))
    if is_one_way:
        away = wp.vec3(1.0, 1.0, 1.0) * wp.length(lag)
    for k in range(3):
        waits.time_fraction[k] = 1.0
        if follows_position(state, k):
            waits.time_fraction[k] = wp.clamp(2.0 - 2.0 * away[k] / lag_max_m, 0.0, 1.0)
        if state.mode[k] == FOLLOW_POSITION and away[k] > lag_max_m:
            waits.pos_ned[k] = est.pos_ned[k] + lag[k] * lag_max_m / away[k]
            waits.vel_ned[k] = 0.0
            waits.accel_ned[k] = 0.0
    return waits


@wp.func
def braking_speed(distance: float, decel: float, gain: float) -> float:
    """The speed from which a constant deceleration, and near the goal a linear approach, ends at the goal."""
    near = decel / (gain * gain)
    if distance < near:
        return gain * distance
    return wp.sqrt(2.0 * decel * (distance - 0.5 * near))


@wp.func
def yaw_step(params: ControlParams, state: TrajectoryState, sp: Setpoint, dt_s: float) -> TrajectoryState:
    """The yaw setpoint turned towards its goal the short way, within rate and acceleration; or at a rate alone."""
    turned = state
    feed = wp.clamp(finite_or(sp.yaw_rate, 0.0), -params.rate_max_yaw, params.rate_max_yaw)
    rate_max = wp.max(params.yaw_rate_auto, wp.abs(feed))
    accel = params.yaw_accel_auto
    rate = feed
    if wp.isfinite(sp.yaw) or not wp.isfinite(sp.yaw_rate):
        turned.yaw_goal = finite_or(sp.yaw, state.yaw_goal)
        away = wrap_pi(turned.yaw_goal - state.yaw)
        speed = braking_speed(wp.abs(away), 0.8 * accel, 0.2 / dt_s)  # room for the time step
        rate = feed + wp.sign(away) * speed
    rate = wp.clamp(rate, -rate_max, rate_max)
    turned.yaw_rate = state.yaw_rate + wp.clamp(rate - state.yaw_rate, -accel * dt_s, accel * dt_s)
    if not wp.isfinite(sp.yaw) and wp.isfinite(sp.yaw_rate):  # somebody steers: it starts and stops at once
        fraction = dt_s / (dt_s + params.yaw_rate_time_s)
        turned.yaw_rate = state.yaw_rate + (rate - state.yaw_rate) * fraction
    turned.yaw = wrap_pi(state.yaw + 0.5 * (state.yaw_rate + turned.yaw_rate) * dt_s)
    if not wp.isfinite(sp.yaw) and wp.isfinite(sp.yaw_rate):
        turned.yaw_goal = turned.yaw
    return turned


@wp.func
def trajectory_step(
    params: ControlParams, state: TrajectoryState, est: Estimate, sp: Setpoint, frame_s: float
) -> TrajectoryState:
    """The trajectory `frame_s` later."""
    now = shift_by_reset(params, state, est)
    now = take_goal(now, sp, 0.9 * params.speed_max_xy, frame_s)
    now = waiting(anchored(now, est), est, params.lag_max_m, is_path(sp))
    dt_s = now.time_fraction * frame_s
    goal_vel = goal_velocity(sp, now.mode, now.goal_age_s, 0.9 * params.speed_max_xy)
    along = now.along_ned
    across = wp.vec3(-along[1], along[0], 0.0)
    third = wp.vec3(0.0, 0.0, 1.0)
    jerk = params.jerk_direct
    exit_speed = float(0.0)
    if is_path(sp):
        along = wp.normalize(sp.pos_ned - sp.path_start_ned)
        aside = wp.vec3(0.0, 0.0, 1.0)
        if wp.abs(along[2]) > 0.999:  # straight up or down
            aside = wp.vec3(0.0, 1.0, 0.0)
        across = wp.normalize(wp.cross(aside, along))
        third = wp.cross(along, across)
        jerk = params.jerk_path
        exit_speed = wp.max(finite_or(sp.exit_speed, 0.0), 0.0)
    first = move_along(params, sp, now, along, now.mode[0], goal_vel, exit_speed, jerk, dt_s[0])
    second = move_along(params, sp, now, across, now.mode[1], goal_vel, 0.0, jerk, dt_s[1])
    height = move_along(params, sp, now, third, now.mode[2], goal_vel, 0.0, jerk, dt_s[2])
    accel = along * first.accel + across * second.accel + third * height.accel
    before_ned = flown_acceleration(now)
    now.accel_ned = accel
    now.jerk_ned = (flown_acceleration(now) - before_ned) / frame_s
    now.pos_ned = now.pos_ned + along * first.moved + across * second.moved + third * height.moved
    now.vel_ned = along * first.vel + across * second.vel + third * height.vel
    return yaw_step(params, now, sp, frame_s)
