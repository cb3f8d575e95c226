"""One tick of a rover's control law: setpoint and estimate in, steering, throttle and brake out.

The yaw rate is filtered at each tick of 250 Hz; the loops run each fifth: a rover is slower than an aircraft.
"""

import warp as wp

from autopilot.control.battery_voltage import voltage_step
from autopilot.control.pid import low_pass_fraction
from autopilot.ports import (
    SETPOINT_DRIVE,
    SETPOINT_TRAJECTORY,
    Actuators,
    BatterySample,
    Estimate,
    Setpoint,
)
from autopilot.vehicles.rover.control_airframe import RoverControlAirframe
from autopilot.vehicles.rover.course import take_course
from autopilot.vehicles.rover.manoeuvre import PathState
from autopilot.vehicles.rover.motion import Asked, Measured, measured
from autopilot.vehicles.rover.params import RoverParams
from autopilot.vehicles.rover.path import follow_path
from autopilot.vehicles.rover.speed import SpeedState, follow_speed, open_throttle
from autopilot.vehicles.rover.steering import SteeringState, follow_yaw_rate, slewed
from common.kernels import FRAME_TICKS, TICK_S, vec8
from common.rotation import quat_from_yaw, wrap_pi

wp.set_module_options({"enable_backward": False})

_TICK_S = wp.constant(TICK_S)
_FRAME_TICKS = wp.constant(FRAME_TICKS)
_FRAME_S = wp.constant(TICK_S * FRAME_TICKS)
YAW_RATE_CUTOFF_HZ = wp.constant(15.0)  # below the shaking of wheels and motor


@wp.struct
class RoverControlState:
    """All the law remembers between ticks; all zero is the state after power-on."""

    kind: int  # of the last tick's setpoint
    was_armed: int
    voltage_fraction: float  # filtered battery voltage over the full one, 0: not started
    yaw_rate: float  # [rad/s] filtered
    path: PathState
    speed: SpeedState
    steering: SteeringState
    actuators: Actuators


@wp.func
def asked_velocity(params: RoverParams, sp: Setpoint, here: Measured) -> Asked:
    """A velocity over ground: its course, forward; one below the standstill threshold is a stop."""
    asked = Asked()
    asked.course = here.yaw
    size = wp.sqrt(sp.vel_ned[0] * sp.vel_ned[0] + sp.vel_ned[1] * sp.vel_ned[1])
    if not (size >= params.stop_speed):  # NaN, too
        asked.is_stop = 1
        return asked
    asked.speed = wp.min(size, wp.max(params.speed_limit, 0.0))
    asked.course = wp.atan2(sp.vel_ned[1], sp.vel_ned[0])
    return asked


@wp.func
def asked_drive(params: RoverParams, airframe: RoverControlAirframe, sp: Setpoint, here: Measured) -> Asked:
    """Along the nose: a speed, and a course with or without a yaw rate, or a yaw rate alone."""
    asked = Asked()
    asked.course = here.yaw
    asked.speed = sp.speed
    if wp.abs(sp.speed) < params.stop_speed:
        asked.speed = 0.0
    if wp.isfinite(sp.yaw):
        asked.course = sp.yaw
        if wp.isfinite(sp.yaw_rate):
            asked.yaw_rate = sp.yaw_rate
        return asked
    asked.is_rate = 1
    if wp.isfinite(sp.yaw_rate):
        asked.yaw_rate = sp.yaw_rate
    if asked.speed == 0.0 and (airframe.is_skid == 0 or wp.abs(asked.yaw_rate) < params.still_yaw_rate):
        asked.is_stop = 1
    return asked


@wp.func
def ask(
    params: RoverParams, airframe: RoverControlAirframe, state: PathState, here: Measured, sp: Setpoint
) -> tuple[PathState, Asked]:
    """What a setpoint asks for; the course already taken to a yaw rate and the speed for it."""
    path = PathState()
    asked = Asked()
    asked.course = here.yaw
    if sp.kind == SETPOINT_TRAJECTORY:
        if wp.isfinite(sp.pos_ned[0]) and wp.isfinite(sp.pos_ned[1]):
            path, asked = follow_path(params, airframe, state, here, sp, _FRAME_S)
        else:
            asked = asked_velocity(params, sp, here)
    elif sp.kind == SETPOINT_DRIVE:
        asked = asked_drive(params, airframe, sp, here)
    else:
        asked.is_stop = 1
    if asked.is_stop == 0 and asked.is_rate == 0:
        asked, is_turning = take_course(params, airframe, asked, here, state.is_turning)
        path.is_turning = is_turning
    return path, asked


@wp.func
def with_room(sp: Setpoint, speed: float) -> float:
    """A speed along the nose [m/s], no faster than what stands in the way allows."""
    if sp.ahead_max != 0.0:
        speed = wp.min(speed, wp.max(sp.ahead_max, 0.0))
    if sp.back_max != 0.0:
        speed = wp.max(speed, -wp.max(sp.back_max, 0.0))
    return speed


@wp.func
def mixed(airframe: RoverControlAirframe, steering: float, throttle: float, brake: float) -> vec8:
    """The commands of the outputs; of a skid-steer rover the sides, the turn kept where both would be too fast."""
    command = vec8()
    command[2] = brake
    if airframe.is_skid == 0:
        command[0] = steering
        command[1] = throttle
        return command
    room = 1.0 - wp.abs(steering)
    middle = wp.clamp(throttle, -room, room)
    command[0] = middle + steering
    command[1] = middle - steering
    return command


@wp.func
def steering_step(
    params: RoverParams,
    airframe: RoverControlAirframe,
    state: SteeringState,
    here: Measured,
    sp: Setpoint,
    asked: Asked,
    speed_sp: float,
) -> SteeringState:
    """The steering after a frame: as a client sets it, left as it is where the vehicle stands, or by the yaw rate."""
    now = state
    is_direct = sp.kind == SETPOINT_DRIVE and wp.isfinite(sp.steering) and not wp.isfinite(sp.yaw)
    if is_direct and not wp.isfinite(sp.yaw_rate):
        now.integral = 0.0
        now.yaw_rate_sp = here.yaw_rate
        now.steering = slewed(params, state, wp.clamp(sp.steering, -1.0, 1.0), _FRAME_S)
        return now
    if asked.is_stop == 1 and (airframe.is_skid == 1 or wp.abs(here.speed) < params.stop_speed):
        now.yaw_rate_sp = 0.0
        if airframe.is_skid == 1:
            now.integral = 0.0
            now.steering = 0.0
        return now
    return follow_yaw_rate(params, airframe, state, here, asked.yaw_rate, speed_sp, _FRAME_S)


@wp.func
def loops(
    params: RoverParams, airframe: RoverControlAirframe, state: RoverControlState, est: Estimate, sp: Setpoint
) -> RoverControlState:
    """The state with all loops advanced by a frame."""
    now = state
    here = measured(airframe, est, state.yaw_rate)
    if sp.kind != state.kind or state.was_armed == 0:
        now.path = PathState()
        if state.was_armed == 0:
            now.speed.speed_sp = here.speed
    path, asked = ask(params, airframe, now.path, here, sp)
    now.path = path
    is_open = sp.kind == SETPOINT_DRIVE and not wp.isfinite(sp.speed)
    goal = wp.where(asked.is_stop == 1, 0.0, asked.speed)
    if is_open:
        is_turned = wp.abs(sp.steering) > 0.0 or wp.abs(asked.yaw_rate) > 0.0
        now.speed = open_throttle(params, sp.thrust, here.speed, airframe.is_skid == 0 or not is_turned)
        goal = wp.where(wp.abs(sp.thrust) > 0.0, sp.thrust, here.speed)
    else:
        goal = with_room(sp, goal)
        is_straight = wp.abs(asked.yaw_rate) < params.still_yaw_rate
        is_stopped = asked.is_stop == 1 or (goal == 0.0 and asked.speed != 0.0 and is_straight)
        may_park = airframe.is_skid == 0 or is_stopped
        now.speed = follow_speed(params, airframe, now.speed, here, goal, now.voltage_fraction, may_park, _FRAME_S)
    now.steering = steering_step(params, airframe, now.steering, here, sp, asked, goal)
    actuators = Actuators()
    actuators.command = mixed(airframe, now.steering.steering, now.speed.throttle, now.speed.brake)
    actuators.thrust_sp = now.speed.throttle
    actuators.traj_pos_ned = est.pos_ned
    if now.path.has_place == 1:
        actuators.traj_pos_ned = wp.vec3(now.path.pos_ned[0], now.path.pos_ned[1], est.pos_ned[2])
    actuators.traj_vel_ned = here.nose_ned * now.speed.speed_sp
    actuators.traj_accel_ned = here.nose_ned * now.speed.accel_sp
    actuators.traj_yaw = wrap_pi(asked.course)
    actuators.traj_yaw_rate = now.steering.yaw_rate_sp
    actuators.omega_sp_frd = wp.vec3(0.0, 0.0, now.steering.yaw_rate_sp)
    actuators.q_sp_ned_from_frd = quat_from_yaw(asked.course - here.yaw) * est.q_ned_from_frd
    now.actuators = actuators
    return now


@wp.func
def disarmed(state: RoverControlState, est: Estimate, sp: Setpoint) -> RoverControlState:
    """The state with the motor off and the brake on, or a motor tested; all else but the filters is forgotten."""
    still = RoverControlState()
    still.kind = sp.kind
    still.voltage_fraction = state.voltage_fraction
    still.yaw_rate = state.yaw_rate
    still.actuators.command = sp.motor_test
    if sp.motor_test[0] == 0.0 and sp.motor_test[1] == 0.0:
        still.actuators.command[2] = 1.0
    still.actuators.traj_pos_ned = est.pos_ned
    still.actuators.q_sp_ned_from_frd = est.q_ned_from_frd
    return still


@wp.func
def rover_control_tick(
    params: RoverParams,
    airframe: RoverControlAirframe,
    state: RoverControlState,
    est: Estimate,
    sp: Setpoint,
    battery: BatterySample,
    tick: int,
) -> RoverControlState:
    """The law's state, with `actuators`, after one 4 ms tick."""
    now = state
    now.voltage_fraction = voltage_step(state.voltage_fraction, airframe.full_voltage_v, battery)
    turning = wp.quat_rotate(est.q_ned_from_frd, est.omega_frd)[2]
    now.yaw_rate = state.yaw_rate + (turning - state.yaw_rate) * low_pass_fraction(YAW_RATE_CUTOFF_HZ, _TICK_S)
    if sp.is_armed == 0:
        return disarmed(now, est, sp)
    if tick % _FRAME_TICKS == 0 or sp.kind != state.kind or state.was_armed == 0:
        after = loops(params, airframe, now, est, sp)
        now.path = after.path
        now.speed = after.speed
        now.steering = after.steering
        now.actuators = after.actuators
    now.kind = sp.kind
    now.was_armed = 1
    return now
