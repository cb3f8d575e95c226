"""One tick of the cascade: setpoint and estimate in, motor commands out, 250 Hz; the outer loops each 5th tick."""

import warp as wp

from autopilot.control.airframe import ControlAirframe
from autopilot.control.allocation import allocate, motor_commands
from autopilot.control.attitude import attitude_from_thrust, rate_setpoint, thrust_turn_rate, turned
from autopilot.control.params import ControlParams
from autopilot.control.position import velocity_setpoint
from autopilot.control.rate import RateState, filter_rates, rate_step, rate_torque
from autopilot.control.trajectory import TrajectoryState, trajectory_at_estimate, trajectory_step
from autopilot.control.velocity import VelocityState, observe, velocity_step
from autopilot.ports import (
    SETPOINT_ATTITUDE,
    SETPOINT_IDLE,
    SETPOINT_RATE,
    SETPOINT_TRAJECTORY,
    Actuators,
    BatterySample,
    Estimate,
    Setpoint,
)
from common.kernels import FRAME_TICKS, GRAVITY_M_S2, TICK_S, vec8
from common.rotation import quat_from_yaw, wrap_pi, yaw_from_quat

wp.set_module_options({"enable_backward": False})

_GRAVITY = wp.constant(GRAVITY_M_S2)
_TICK_S = wp.constant(TICK_S)
_FRAME_TICKS = wp.constant(FRAME_TICKS)
_FRAME_S = wp.constant(TICK_S * FRAME_TICKS)
_VOLTAGE_TIME_S = wp.constant(0.25)  # slower than the loops that load the battery, faster than it empties
_VOLTAGE_SHARE_MIN = wp.constant(0.6)
_UPRIGHT_MIN = wp.constant(0.3)  # cosine of tilt below which thrust no longer holds height
_SLACK = wp.constant(1.0e-4)  # share of the asked torque below which a remainder is rounding


@wp.struct
class ControlState:
    """All the controller remembers between ticks; all zero is the state after power-on."""

    kind: int  # of the last tick's setpoint, to see it change
    was_landed: int
    ramp: float  # share of the greatest thrust allowed, grows at take-off
    voltage_share: float  # filtered battery voltage over the full one, 0: not started
    trajectory: TrajectoryState
    velocity: VelocityState
    rate: RateState
    q_sp_ned_from_frd: wp.quat
    omega_feed_ned: wp.vec3  # [rad/s] turn rate of the attitude setpoint
    yaw_sp: float  # [rad] of attitude setpoints with a yaw rate
    collective_n: float  # achieved in the last tick
    actuators: Actuators


@wp.func
def voltage_step(state: ControlState, airframe: ControlAirframe, battery: BatterySample) -> float:
    """Filtered battery voltage over the full one; 1 without a battery sample."""
    if battery.voltage_v <= 0.0 or airframe.full_voltage_v <= 0.0:
        return 1.0
    share = wp.clamp(battery.voltage_v / airframe.full_voltage_v, _VOLTAGE_SHARE_MIN, 1.05)
    if state.voltage_share == 0.0:
        return share
    return state.voltage_share + (share - state.voltage_share) * _TICK_S / _VOLTAGE_TIME_S


@wp.func
def rotor_thrust(airframe: ControlAirframe, share: float, voltage_share: float) -> float:
    """Thrust [N] of one rotor at a share of its greatest speed and of the full battery voltage."""
    speed = airframe.max_speed_rad_s * voltage_share * share
    return airframe.thrust_n_s2 * speed * speed


@wp.func
def rest(state: ControlState, airframe: ControlAirframe, est: Estimate, is_armed: int) -> ControlState:
    """The state with the rotors stopped, or idling when armed; everything remembered is forgotten."""
    still = ControlState()
    still.voltage_share = state.voltage_share
    still.trajectory = trajectory_at_estimate(est, 0)
    still.was_landed = 1
    command = vec8()
    total = float(0.0)
    if is_armed == 1:
        for i in range(airframe.rotor_count):
            command[i] = airframe.idle_command
        idle_n = rotor_thrust(airframe, airframe.idle_speed_share, state.voltage_share)
        total = float(airframe.rotor_count) * idle_n
    still.collective_n = total
    still.velocity.thrust_model_n = total
    still.actuators.command = command
    still.actuators.traj_pos_ned = est.pos_ned
    still.actuators.traj_yaw = still.trajectory.yaw
    still.actuators.q_sp_ned_from_frd = est.q_ned_from_frd
    return still


@wp.func
def begin(state: ControlState, airframe: ControlAirframe, est: Estimate) -> ControlState:
    """The state in which control of a new kind starts, on the ground or in the air."""
    begun = state
    begun.trajectory = trajectory_at_estimate(est, 1 - state.was_landed)
    begun.yaw_sp = begun.trajectory.yaw
    begun.omega_feed_ned = wp.vec3(0.0, 0.0, 0.0)
    if state.kind == SETPOINT_IDLE and state.was_landed == 0:  # power-on in the air: a simulation started there
        begun.ramp = 1.0
        begun.collective_n = airframe.mass_kg * _GRAVITY
        begun.velocity.thrust_model_n = begun.collective_n
    return begun


@wp.func
def guide(
    params: ControlParams,
    airframe: ControlAirframe,
    state: ControlState,
    est: Estimate,
    sp: Setpoint,
    thrust_max_n: float,
) -> ControlState:
    """The state with trajectory, velocity loop and attitude setpoint advanced by one 50 Hz frame."""
    led = state
    if state.ramp * thrust_max_n < airframe.mass_kg * _GRAVITY:  # not yet light: do not run ahead
        led.trajectory = trajectory_at_estimate(est, 0)
    led.trajectory = trajectory_step(params, led.trajectory, est, sp, _FRAME_S)
    vel_sp_ned = velocity_setpoint(params, led.trajectory, est)
    led.velocity = velocity_step(
        params, airframe, state.velocity, led.trajectory, est, vel_sp_ned, thrust_max_n, state.ramp < 1.0, _FRAME_S
    )
    thrust_ned = led.velocity.thrust_sp_ned
    led.q_sp_ned_from_frd = attitude_from_thrust(thrust_ned, led.trajectory.yaw)
    turn = thrust_turn_rate(thrust_ned, led.trajectory.jerk_ned)
    led.omega_feed_ned = turn + wp.vec3(0.0, 0.0, led.trajectory.yaw_rate)
    return led


@wp.func
def upright_collective(airframe: ControlAirframe, thrust_ned: wp.vec3, est: Estimate) -> float:
    """Collective thrust [N] whose vertical part at the present tilt is the wanted one."""
    upright = wp.quat_rotate(est.q_ned_from_frd, wp.vec3(0.0, 0.0, 1.0))[2]
    if upright < _UPRIGHT_MIN:
        return 0.0
    return airframe.mass_kg * wp.min(-thrust_ned[2] / upright, 1.2 * wp.length(thrust_ned))


@wp.func
def attitude_setpoint(state: ControlState, sp: Setpoint) -> ControlState:
    """The state with the attitude of the setpoint, its heading carried on by yaw rate where that is finite."""
    led = state
    led.q_sp_ned_from_frd = wp.normalize(sp.q_ned_from_frd)
    led.omega_feed_ned = wp.vec3(0.0, 0.0, 0.0)
    if wp.isfinite(sp.yaw_rate):
        led.yaw_sp = wrap_pi(state.yaw_sp + sp.yaw_rate * _TICK_S)
        lean = quat_from_yaw(-yaw_from_quat(led.q_sp_ned_from_frd)) * led.q_sp_ned_from_frd
        led.q_sp_ned_from_frd = quat_from_yaw(led.yaw_sp) * lean
        led.omega_feed_ned = wp.vec3(0.0, 0.0, sp.yaw_rate)
    else:
        led.yaw_sp = yaw_from_quat(led.q_sp_ned_from_frd)
    return led


@wp.func
def actuate(
    params: ControlParams,
    airframe: ControlAirframe,
    state: ControlState,
    omega_sp_frd: wp.vec3,
    collective_n: float,
    rotor_max_n: float,
    is_landed: int,
) -> ControlState:
    """The state with rate loop, allocation and motor commands of this tick."""
    done = state
    shortfall = state.actuators.torque_unallocated_frd
    if is_landed == 0:
        done.rate = rate_step(params, state.rate, omega_sp_frd, shortfall, _TICK_S)
    torque = rate_torque(params, done.rate, omega_sp_frd, airframe.inertia_kg_m2)
    rotor_min_n = rotor_thrust(airframe, airframe.idle_speed_share, state.voltage_share)
    result = allocate(airframe, torque, collective_n, rotor_min_n, rotor_max_n)
    done.collective_n = result.collective_n
    done.actuators.command = motor_commands(airframe, result.thrust_n, state.voltage_share)
    done.actuators.omega_sp_frd = omega_sp_frd
    done.actuators.q_sp_ned_from_frd = state.q_sp_ned_from_frd
    done.actuators.torque_sp_frd = torque
    done.actuators.thrust_sp = collective_n / (float(airframe.rotor_count) * rotor_max_n)
    short = result.torque_short_frd
    for k in range(3):
        if wp.abs(short[k]) < _SLACK * wp.abs(torque[k]):
            short[k] = 0.0
    done.actuators.torque_unallocated_frd = short
    done.actuators.traj_pos_ned = state.trajectory.pos_ned
    done.actuators.traj_vel_ned = state.trajectory.vel_ned
    done.actuators.traj_accel_ned = state.trajectory.accel_ned
    done.actuators.traj_yaw = state.trajectory.yaw
    done.actuators.traj_yaw_rate = state.trajectory.yaw_rate
    return done


@wp.func
def control_tick(
    params: ControlParams,
    airframe: ControlAirframe,
    state: ControlState,
    est: Estimate,
    sp: Setpoint,
    battery: BatterySample,
    tick: int,
) -> ControlState:
    """The controller's state, with `actuators`, after one 4 ms tick."""
    now = state
    now.voltage_share = voltage_step(state, airframe, battery)
    direct = sp.kind == SETPOINT_ATTITUDE or sp.kind == SETPOINT_RATE
    is_idle = sp.is_armed == 0 or sp.kind == SETPOINT_IDLE
    if is_idle or (sp.is_landed == 1 and (not direct or sp.thrust <= 0.0)):
        return rest(now, airframe, est, sp.is_armed)
    is_start = sp.kind != state.kind or state.was_landed == 1
    if is_start:
        now = begin(now, airframe, est)
    now.kind = sp.kind
    now.was_landed = sp.is_landed
    rotor_max_n = rotor_thrust(airframe, 1.0, now.voltage_share)
    thrust_max_n = float(airframe.rotor_count) * rotor_max_n
    now.rate = filter_rates(params, now.rate, est.omega_frd, _TICK_S)
    if now.ramp >= 1.0:
        now.velocity = observe(params, airframe, now.velocity, est, now.collective_n, _TICK_S)
    else:
        now.ramp = wp.min(now.ramp + _TICK_S / wp.max(params.takeoff_ramp_s, _TICK_S), 1.0)
    collective = float(0.0)
    if sp.kind == SETPOINT_TRAJECTORY:
        if tick % _FRAME_TICKS == 0 or is_start:
            now = guide(params, airframe, now, est, sp, thrust_max_n)
        else:
            now.q_sp_ned_from_frd = turned(now.q_sp_ned_from_frd, now.omega_feed_ned, _TICK_S)
        collective = upright_collective(airframe, now.velocity.thrust_sp_ned, est)
    else:
        collective = wp.clamp(sp.thrust, 0.0, 1.0) * thrust_max_n
    omega_sp_frd = sp.omega_frd
    if sp.kind == SETPOINT_ATTITUDE:
        now = attitude_setpoint(now, sp)
    if sp.kind != SETPOINT_RATE:
        omega_sp_frd = rate_setpoint(params, est.q_ned_from_frd, now.q_sp_ned_from_frd, now.omega_feed_ned)
    collective = wp.min(collective, now.ramp * thrust_max_n)
    return actuate(params, airframe, now, omega_sp_frd, collective, rotor_max_n, sp.is_landed)
