"""One tick of a plane's control law: setpoint and estimate in, surfaces, throttle, nose wheel and brake out.

Rates and attitude run at each tick of 250 Hz; guidance and energy each fifth. What the elements of a trajectory mean to
a plane: a position with a path start is a line, also beyond the position, with its height between those of both; one
without is circled; a horizontal velocity is a course; `cruise_speed` is an airspeed; a finite `thrust` is the throttle,
as in a flare. SETPOINT_DRIVE is on the runway: wings level, `yaw` held by nose wheel and rudder, a negative `thrust`
brakes.
"""

import warp as wp

from autopilot.control.battery_voltage import voltage_step
from autopilot.control.pid import finite_or
from autopilot.ports import (
    SETPOINT_ATTITUDE,
    SETPOINT_DRIVE,
    SETPOINT_LEAN,
    SETPOINT_RATE,
    SETPOINT_STICKS,
    SETPOINT_TRAJECTORY,
    Actuators,
    BatterySample,
    Estimate,
    Setpoint,
)
from autopilot.vehicles.plane.attitude import body_rates, surfaces
from autopilot.vehicles.plane.control_airframe import PlaneControlAirframe
from autopilot.vehicles.plane.energy import EnergyGoal, EnergyState, energy_step
from autopilot.vehicles.plane.guidance import to_circle, to_course, to_line
from autopilot.vehicles.plane.motion import Asked, Measured, measured
from autopilot.vehicles.plane.params import PlaneParams
from common.geodesy import GRAVITY_M_S2
from common.kernels import FRAME_TICKS, TICK_S
from common.rotation import quat_from_yaw, wrap_pi

wp.set_module_options({"enable_backward": False})

_TICK_S = wp.constant(TICK_S)
_FRAME_TICKS = wp.constant(FRAME_TICKS)
_FRAME_S = wp.constant(TICK_S * FRAME_TICKS)
_GRAVITY = wp.constant(GRAVITY_M_S2)
_COURSE_M_S = wp.constant(0.1)  # a slower velocity has no course
_LEVEL_M_S = wp.constant(0.05)  # a slower climb holds the height
_LINE_M = wp.constant(0.5)  # a shorter line is none
_BANK_RATE = wp.constant(1.57)  # [rad/s] of the bank asked for: PX4's FW_PN_R_SLEW_MAX


@wp.struct
class PlaneControlState:
    """All the law remembers between ticks; all zero is the state after power-on."""

    kind: int  # of the last tick's setpoint
    was_armed: int
    voltage_fraction: float  # filtered battery voltage over the full one, 0: not started
    has_height: int  # `height` is held
    height: float  # [m]
    energy: EnergyState
    asked: Asked
    integral: wp.vec3
    actuators: Actuators


@wp.struct
class Way:
    """What a setpoint asks for over ground and in height."""

    across: float  # [m/s²] to the right
    height: float  # [m] NaN: by climb
    climb: float  # [m/s]


@wp.func
def way_of(params: PlaneParams, sp: Setpoint, here: Measured) -> Way:
    """A trajectory as a plane takes it."""
    way = Way()
    way.height = -sp.pos_ned[2]
    way.climb = finite_or(-sp.vel_ned[2], 0.0)
    place = wp.vec2(sp.pos_ned[0], sp.pos_ned[1])
    start = wp.vec2(sp.path_start_ned[0], sp.path_start_ned[1])
    if wp.isfinite(place[0]) and wp.isfinite(place[1]):
        line = place - start
        length = wp.length(line)
        if length > _LINE_M:  # not where the start is free
            along = line / length
            way.across = to_line(params, here, start, along)
            if wp.isfinite(way.height) and wp.isfinite(sp.path_start_ned[2]):
                rise = (way.height + sp.path_start_ned[2]) / length
                passed = wp.dot(along, here.pos_ned - start)
                if passed < length:
                    way.height = -sp.path_start_ned[2] + rise * wp.max(passed, 0.0)
                    way.climb = wp.where(passed > 0.0, rise * wp.dot(along, here.vel_ned), 0.0)
        else:
            radius = wp.where(sp.pass_radius != 0.0, sp.pass_radius, params.loiter_radius)
            way.across = to_circle(params, here, place, radius)
    elif wp.isfinite(sp.vel_ned[0]) and wp.isfinite(sp.vel_ned[1]):
        course = wp.vec2(sp.vel_ned[0], sp.vel_ned[1])
        if wp.length(course) > _COURSE_M_S:
            way.across = to_course(params, here, wp.normalize(course))
    return way


@wp.func
def roll_of(q: wp.quat) -> float:
    """Bank [rad] of an attitude."""
    return wp.atan2(2.0 * (q[3] * q[0] + q[1] * q[2]), 1.0 - 2.0 * (q[0] * q[0] + q[1] * q[1]))


@wp.func
def pitch_of(q: wp.quat) -> float:
    """Pitch [rad] of an attitude."""
    return wp.asin(wp.clamp(2.0 * (q[3] * q[1] - q[2] * q[0]), -1.0, 1.0))


@wp.func
def steered(params: PlaneParams, state: PlaneControlState, sp: Setpoint, here: Measured) -> PlaneControlState:
    """A trajectory, or a bank with a climb rate: guidance and energy a frame later."""
    now = state
    way = Way()
    bank = roll_of(sp.q_ned_from_frd)
    if sp.kind == SETPOINT_TRAJECTORY:
        way = way_of(params, sp, here)
        bank = wp.atan(way.across / _GRAVITY)
    else:
        way.height = wp.nan
        way.climb = finite_or(-sp.vel_ned[2], 0.0)
    is_level = not wp.isfinite(way.height) and wp.abs(way.climb) < _LEVEL_M_S
    if is_level:
        if state.has_height == 0:
            now.height = here.height
        way.height = now.height
    now.has_height = wp.where(is_level, 1, 0)
    bank = wp.clamp(bank, -params.roll_limit, params.roll_limit)
    step = _BANK_RATE * _FRAME_S
    now.asked.roll = wp.clamp(bank, state.asked.roll - step, state.asked.roll + step)
    goal = EnergyGoal()
    goal.height = way.height
    goal.climb = way.climb
    goal.airspeed = wp.clamp(finite_or(sp.cruise_speed, params.airspeed_trim), params.airspeed_min, params.airspeed_max)
    goal.throttle = wp.nan
    goal.pitch_min = params.pitch_min
    goal.pitch_max = params.pitch_max
    if sp.kind == SETPOINT_TRAJECTORY and wp.isfinite(sp.thrust):
        goal.throttle = sp.thrust
        goal.pitch_min = params.flare_pitch_min
        goal.pitch_max = params.flare_pitch_max
    goal.bank = now.asked.roll
    now.energy = energy_step(params, state.energy, here, goal, _FRAME_S)
    now.asked.pitch = now.energy.pitch
    now.asked.throttle = now.energy.throttle
    now.actuators.traj_pos_ned = wp.vec3(sp.pos_ned[0], sp.pos_ned[1], -finite_or(way.height, here.height))
    now.actuators.traj_vel_ned = wp.vec3(here.vel_ned[0], here.vel_ned[1], -now.energy.climb_sp)
    now.actuators.traj_yaw = wp.atan2(here.vel_ned[1], here.vel_ned[0])
    if not wp.isfinite(sp.pos_ned[0]) or not wp.isfinite(sp.pos_ned[1]):
        now.actuators.traj_pos_ned[0] = here.pos_ned[0]
        now.actuators.traj_pos_ned[1] = here.pos_ned[1]
    return now


@wp.func
def outer(
    params: PlaneParams, state: PlaneControlState, sp: Setpoint, est: Estimate, here: Measured
) -> PlaneControlState:
    """The state with the outer loops advanced by a frame: bank, pitch and throttle asked for."""
    now = state
    if sp.kind != state.kind or state.was_armed == 0:
        now.asked.roll = here.roll
        if sp.kind != SETPOINT_TRAJECTORY and sp.kind != SETPOINT_LEAN:
            now.energy = EnergyState()
        now.has_height = 0
    now.actuators = Actuators()
    now.actuators.traj_pos_ned = est.pos_ned
    now.actuators.traj_vel_ned = est.vel_ned
    now.actuators.traj_yaw = here.yaw
    if sp.kind == SETPOINT_TRAJECTORY or sp.kind == SETPOINT_LEAN:
        return steered(params, now, sp, here)
    throttle = finite_or(sp.thrust, params.throttle_idle)
    now.asked.throttle = wp.clamp(throttle, 0.0, params.throttle_max)
    now.asked.roll = 0.0
    now.asked.pitch = params.runway_pitch
    if sp.kind == SETPOINT_ATTITUDE:
        now.asked.roll = wp.clamp(roll_of(sp.q_ned_from_frd), -params.roll_limit, params.roll_limit)
        now.asked.pitch = wp.clamp(pitch_of(sp.q_ned_from_frd), params.pitch_min, params.pitch_max)
    elif sp.kind != SETPOINT_DRIVE and sp.kind != SETPOINT_RATE and sp.kind != SETPOINT_STICKS:
        now.asked.throttle = params.throttle_idle
    return now


@wp.func
def commanded(params: PlaneParams, state: PlaneControlState, sp: Setpoint, here: Measured) -> PlaneControlState:
    """The state with the outputs of this tick."""
    now = state
    rate_sp = body_rates(params, here, now.asked)
    if sp.kind == SETPOINT_RATE:
        for k in range(3):
            rate_sp[k] = finite_or(sp.omega_frd[k], 0.0)
    elif sp.kind == SETPOINT_ATTITUDE and wp.isfinite(sp.yaw_rate):
        rate_sp[2] += sp.yaw_rate
    turn, integral = surfaces(params, here, rate_sp, state.integral, sp.is_landed, _TICK_S)
    now.integral = integral
    brake = float(0.0)
    wheel = turn[2]
    if sp.kind == SETPOINT_STICKS:
        turn = wp.vec3(sp.omega_frd[0], sp.omega_frd[1], sp.omega_frd[2])
        wheel = turn[2]
        now.integral = wp.vec3()
    elif sp.kind == SETPOINT_DRIVE:
        wheel = wp.clamp(params.wheel_p * wrap_pi(sp.yaw - here.yaw) - params.wheel_d * here.omega_frd[2], -1.0, 1.0)
        turn[2] = wheel
        brake = wp.clamp(-finite_or(sp.thrust, 0.0), 0.0, 1.0)
    elif sp.is_landed == 1:
        turn = wp.vec3()
        wheel = 0.0
        brake = 1.0
    now.actuators.command[0] = turn[0]
    now.actuators.command[1] = turn[1]
    now.actuators.command[2] = wp.clamp(now.asked.throttle / state.voltage_fraction, 0.0, 1.0)
    now.actuators.command[3] = turn[2]
    now.actuators.command[4] = wheel
    now.actuators.command[5] = brake
    now.actuators.thrust_sp = now.asked.throttle
    now.actuators.omega_sp_frd = rate_sp
    half = 0.5 * now.asked.pitch
    q_pitch = wp.quat(0.0, wp.sin(half), 0.0, wp.cos(half))
    q_roll = wp.quat(wp.sin(0.5 * now.asked.roll), 0.0, 0.0, wp.cos(0.5 * now.asked.roll))
    now.actuators.q_sp_ned_from_frd = quat_from_yaw(here.yaw) * q_pitch * q_roll
    return now


@wp.func
def disarmed(state: PlaneControlState, est: Estimate, sp: Setpoint) -> PlaneControlState:
    """The state with the motor off and the brake on, or the motor tested; all else but the filters is forgotten."""
    still = PlaneControlState()
    still.kind = sp.kind
    still.voltage_fraction = state.voltage_fraction
    still.actuators.command = sp.motor_test
    still.actuators.command[5] = 1.0
    still.actuators.traj_pos_ned = est.pos_ned
    still.actuators.q_sp_ned_from_frd = est.q_ned_from_frd
    return still


@wp.func
def plane_control_tick(
    params: PlaneParams,
    airframe: PlaneControlAirframe,
    state: PlaneControlState,
    est: Estimate,
    sp: Setpoint,
    battery: BatterySample,
    tick: int,
) -> PlaneControlState:
    """The law's state, with `actuators`, after one 4 ms tick."""
    now = state
    now.voltage_fraction = voltage_step(state.voltage_fraction, airframe.full_voltage_v, battery)
    if sp.is_armed == 0:
        return disarmed(now, est, sp)
    here = measured(params, est)
    if tick % _FRAME_TICKS == 0 or sp.kind != state.kind or state.was_armed == 0:
        now = outer(params, now, sp, est, here)
    now = commanded(params, now, sp, here)
    now.kind = sp.kind
    now.was_armed = 1
    return now
