"""One tick of a rover's control law: setpoint and estimate in, steering, throttle and brake out, 250 Hz."""

import warp as wp

from autopilot.ports import (
    SETPOINT_DRIVE,
    SETPOINT_IDLE,
    SETPOINT_TRAJECTORY,
    Actuators,
    BatterySample,
    Estimate,
    Setpoint,
)
from autopilot.vehicles.rover.control_airframe import RoverControlAirframe
from autopilot.vehicles.rover.params import RoverParams
from autopilot.vehicles.rover.path import Motion, PathState, follow_path, horizontal
from autopilot.vehicles.rover.speed import SpeedState, follow_speed, stopped
from autopilot.vehicles.rover.steering import SteeringState, follow_yaw_rate, slewed
from common.kernels import TICK_S, vec8
from common.rotation import quat_from_yaw, wrap_pi, yaw_from_quat

wp.set_module_options({"enable_backward": False})

_TICK_S = wp.constant(TICK_S)
_VOLTAGE_TIME_S = wp.constant(0.25)  # slower than the motor that loads the battery, faster than it empties
_COURSE_M_S = wp.constant(0.05)  # velocity asked for, below which it has no course


@wp.struct
class RoverControlState:
    """All the law remembers between ticks; all zero is the state after power-on."""

    kind: int  # of the last tick's setpoint
    voltage_fraction: float  # filtered battery voltage over the full one, 0: not started
    path: PathState
    speed: SpeedState
    steering: SteeringState
    actuators: Actuators


@wp.func
def voltage_step(fraction: float, airframe: RoverControlAirframe, battery: BatterySample) -> float:
    """Filtered battery voltage over the full one; 1 without a battery sample."""
    if battery.voltage_v <= 0.0 or airframe.full_voltage_v <= 0.0:
        return 1.0
    measured = wp.clamp(battery.voltage_v / airframe.full_voltage_v, 0.5, 1.05)
    if fraction == 0.0:
        return measured
    return fraction + (measured - fraction) * _TICK_S / _VOLTAGE_TIME_S


@wp.func
def asked_motion(
    params: RoverParams, airframe: RoverControlAirframe, state: PathState, est: Estimate, sp: Setpoint, speed: float
) -> tuple[PathState, Motion]:
    """Speed and yaw rate that a setpoint asks for; `speed` is the estimated one along the nose [m/s]."""
    motion = Motion()
    yaw = yaw_from_quat(est.q_ned_from_frd)
    motion.course = yaw
    if sp.kind == SETPOINT_TRAJECTORY and wp.isfinite(sp.pos_ned[0]) and wp.isfinite(sp.pos_ned[1]):
        now, motion = follow_path(params, airframe, state, est, sp, speed)
        return now, motion
    now = PathState()
    if sp.kind == SETPOINT_TRAJECTORY:
        asked = horizontal(sp.vel_ned)
        size = wp.length(asked)
        if not (size > _COURSE_M_S):  # NaN, too: nothing is asked for
            motion.is_stop = 1
            return now, motion
        motion.speed = size
        motion.course = wp.atan2(asked[1], asked[0])
        error = wrap_pi(motion.course - yaw)
        motion.yaw_rate = params.yaw_p * error
        if airframe.is_skid == 1:
            now.is_turning = state.is_turning
            if wp.abs(error) > params.turn_from:
                now.is_turning = 1
            elif wp.abs(error) < params.turn_until:
                now.is_turning = 0
            if now.is_turning == 1:
                motion.speed = 0.0
        elif params.speed_reduction > 0.0:
            slowed = 1.0 - params.speed_reduction * wp.abs(error) / wp.pi
            motion.speed = wp.max(size * slowed, wp.min(size, 0.6))
        return now, motion
    motion.speed = sp.speed
    if wp.isfinite(sp.yaw):
        motion.course = sp.yaw
        motion.yaw_rate = params.yaw_p * wrap_pi(sp.yaw - yaw)
    if wp.isfinite(sp.yaw_rate):
        motion.yaw_rate += sp.yaw_rate
    is_still = sp.speed == 0.0 and (airframe.is_skid == 0 or wp.abs(motion.yaw_rate) < 0.02)
    if is_still:
        motion.is_stop = 1
    return now, motion


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
    command[0] = wp.clamp(middle + steering, -1.0, 1.0)
    command[1] = wp.clamp(middle - steering, -1.0, 1.0)
    return command


@wp.func
def rover_control_tick(  # noqa: PLR0912, PLR0915
    params: RoverParams,
    airframe: RoverControlAirframe,
    state: RoverControlState,
    est: Estimate,
    sp: Setpoint,
    battery: BatterySample,
    tick: int,  # noqa: ARG001
) -> RoverControlState:
    """The law's state, with `actuators`, after one 4 ms tick."""
    now = state
    now.kind = sp.kind
    now.voltage_fraction = voltage_step(state.voltage_fraction, airframe, battery)
    nose_ned = wp.quat_rotate(est.q_ned_from_frd, wp.vec3(1.0, 0.0, 0.0))
    speed = wp.dot(est.vel_ned, nose_ned)
    yaw_rate = est.omega_frd[2]
    motion = Motion()
    motion.course = yaw_from_quat(est.q_ned_from_frd)
    is_idle = sp.is_armed == 0 or sp.kind == SETPOINT_IDLE
    is_idle = is_idle or (sp.kind != SETPOINT_TRAJECTORY and sp.kind != SETPOINT_DRIVE)
    if is_idle:
        now.path = PathState()
        motion.is_stop = 1
    else:
        path, motion = asked_motion(params, airframe, state.path, est, sp, speed)
        now.path = path
    is_open = sp.kind == SETPOINT_DRIVE and not wp.isfinite(sp.speed) and not is_idle
    if is_open:
        now.speed = SpeedState()
        now.speed.speed_sp = speed
        now.speed.throttle = wp.clamp(sp.thrust, -1.0, 1.0)
        if not wp.isfinite(sp.thrust):
            now.speed.throttle = 0.0
    elif motion.is_stop == 1:
        now.speed = stopped(params, airframe, state.speed, speed, _TICK_S)
    else:
        if state.speed.brake == 1.0 or state.kind != sp.kind:  # begins to move, or another loop had the motor
            now.speed = SpeedState()
            now.speed.speed_sp = speed
        now.speed = follow_speed(params, airframe, now.speed, motion.speed, speed, now.voltage_fraction, _TICK_S)
    is_steered = is_open or sp.kind == SETPOINT_DRIVE
    if (
        is_steered
        and not is_idle
        and wp.isfinite(sp.steering)
        and not wp.isfinite(sp.yaw)
        and not wp.isfinite(sp.yaw_rate)
    ):
        now.steering.integral = 0.0
        now.steering.yaw_rate_sp = yaw_rate
        now.steering.steering = slewed(params, state.steering, wp.clamp(sp.steering, -1.0, 1.0), _TICK_S)
    elif motion.is_stop == 1:
        now.steering.integral = 0.0
        now.steering.yaw_rate_sp = 0.0
        if airframe.is_skid == 1:
            now.steering.steering = 0.0
        elif is_idle:
            now.steering.steering = slewed(params, state.steering, 0.0, _TICK_S)
    else:
        way = motion.speed
        if is_open:
            way = now.speed.throttle
        now.steering = follow_yaw_rate(params, airframe, state.steering, motion.yaw_rate, yaw_rate, speed, way, _TICK_S)
    now.actuators = Actuators()
    now.actuators.command = mixed(airframe, now.steering.steering, now.speed.throttle, now.speed.brake)
    if sp.is_armed == 0:
        for k in range(8):
            now.actuators.command[k] = sp.motor_test[k]
        if sp.motor_test[0] == 0.0 and sp.motor_test[1] == 0.0:
            now.actuators.command[2] = 1.0
    now.actuators.thrust_sp = now.speed.throttle
    now.actuators.traj_pos_ned = est.pos_ned
    if now.path.has_place == 1:
        now.actuators.traj_pos_ned = now.path.pos_ned
    now.actuators.traj_vel_ned = nose_ned * now.speed.speed_sp
    now.actuators.traj_accel_ned = nose_ned * now.speed.accel_sp
    now.actuators.traj_yaw = wrap_pi(motion.course)
    now.actuators.traj_yaw_rate = now.steering.yaw_rate_sp
    now.actuators.omega_sp_frd = wp.vec3(0.0, 0.0, now.steering.yaw_rate_sp)
    now.actuators.q_sp_ned_from_frd = quat_from_yaw(motion.course)
    return now
