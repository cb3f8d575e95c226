"""One tick of the cascade: setpoint and estimate in, motor commands out, 250 Hz; the outer loops each 5th tick."""

import warp as wp

from autopilot.control.battery_voltage import voltage_step
from autopilot.ports import (
    SETPOINT_ATTITUDE,
    SETPOINT_IDLE,
    SETPOINT_LEAN,
    SETPOINT_RATE,
    SETPOINT_TRAJECTORY,
    Actuators,
    BatterySample,
    Estimate,
    Setpoint,
)
from autopilot.vehicles.multirotor.allocation import Allocation, allocate, motor_commands
from autopilot.vehicles.multirotor.attitude import attitude_from_thrust, rate_setpoint, thrust_turn_rate, turned
from autopilot.vehicles.multirotor.control_airframe import ControlAirframe
from autopilot.vehicles.multirotor.params import ControlParams
from autopilot.vehicles.multirotor.position import velocity_setpoint
from autopilot.vehicles.multirotor.rate import RateState, filter_rates, rate_step, rate_torque
from autopilot.vehicles.multirotor.trajectory import (
    TrajectoryState,
    flown_acceleration,
    flown_velocity,
    trajectory_at_estimate,
    trajectory_step,
)
from autopilot.vehicles.multirotor.velocity import VelocityState, observe, velocity_step
from common.geodesy import GRAVITY_M_S2
from common.kernels import FRAME_TICKS, TICK_S, vec8
from common.rotation import quat_from_yaw, wrap_pi, yaw_from_quat
from common.vectors import clamp3

wp.set_module_options({"enable_backward": False})

_GRAVITY = wp.constant(GRAVITY_M_S2)
_TICK_S = wp.constant(TICK_S)
_FRAME_TICKS = wp.constant(FRAME_TICKS)
_FRAME_S = wp.constant(TICK_S * FRAME_TICKS)
_UPRIGHT_MIN = wp.constant(0.3)  # cosine of tilt below which thrust no longer holds height
_SLACK = wp.constant(1.0e-4)  # fraction of the asked torque below which a remainder is rounding


@wp.struct
class Aim:
    """What the attitude loop follows."""

    q_ned_from_frd: wp.quat
    omega_ned: wp.vec3  # [rad/s] rate at which the attitude itself turns
    yaw: float  # [rad] heading carried on by attitude setpoints with a yaw rate


@wp.struct
class ControlState:
    """All the controller remembers between ticks; all zero is the state after power-on."""

    kind: int  # of the last tick's setpoint, to see it change
    was_landed: int
    ramp: float  # fraction of the greatest thrust allowed, grows at take-off
    voltage_fraction: float  # filtered battery voltage over the full one, 0: not started
    trajectory: TrajectoryState
    velocity: VelocityState
    rate: RateState
    aim: Aim
    collective_n: float  # achieved in the last tick
    actuators: Actuators


@wp.func
def rotor_thrust(airframe: ControlAirframe, fraction: float, voltage_fraction: float) -> float:
    """Thrust [N] of one rotor at a fraction of its greatest speed and of the full battery voltage."""
    speed = airframe.max_speed_rad_s * voltage_fraction * fraction
    return airframe.thrust_n_s2 * speed * speed


@wp.func
def rest(voltage_fraction: float, airframe: ControlAirframe, est: Estimate, sp: Setpoint) -> ControlState:
    """The state with the rotors stopped or tested, or idling when armed; everything else remembered is forgotten."""
    still = ControlState()
    still.voltage_fraction = voltage_fraction
    still.trajectory = trajectory_at_estimate(est, 0)
    still.was_landed = 1
    still.actuators.command = sp.motor_test
    if sp.is_armed == 1:
        command = vec8()
        for i in range(airframe.rotor_count):
            command[i] = airframe.idle_command
        still.actuators.command = command
        idle_n = rotor_thrust(airframe, airframe.idle_speed_fraction, voltage_fraction)
        still.collective_n = float(airframe.rotor_count) * idle_n
        still.velocity.thrust_model_n = still.collective_n
    still.actuators.traj_pos_ned = est.pos_ned
    still.actuators.traj_yaw = still.trajectory.yaw
    still.actuators.q_sp_ned_from_frd = est.q_ned_from_frd
    return still


@wp.func
def upright_collective(airframe: ControlAirframe, thrust_ned: wp.vec3, est: Estimate) -> float:
    """Collective thrust [N] whose vertical part at the present tilt is the wanted one."""
    q = est.q_ned_from_frd
    upright = 1.0 - 2.0 * (q[0] * q[0] + q[1] * q[1])  # cosine of the tilt
    if upright < _UPRIGHT_MIN:
        return 0.0
    return airframe.mass_kg * wp.min(-thrust_ned[2] / upright, 1.2 * wp.length(thrust_ned))


@wp.func
def aim_of_thrust(thrust_ned: wp.vec3, trajectory: TrajectoryState) -> Aim:
    """The attitude that points a thrust setpoint, turning as the trajectory's jerk and yaw rate turn it."""
    aim = Aim()
    aim.q_ned_from_frd = attitude_from_thrust(thrust_ned, trajectory.yaw)
    aim.omega_ned = thrust_turn_rate(thrust_ned, trajectory.jerk_ned) + wp.vec3(0.0, 0.0, trajectory.yaw_rate)
    aim.yaw = trajectory.yaw
    return aim


@wp.func
def aim_of_attitude(params: ControlParams, yaw: float, sp: Setpoint) -> Aim:
    """The attitude of the setpoint; with a finite yaw rate its heading is `yaw` [rad] carried on at that rate."""
    aim = Aim()
    aim.q_ned_from_frd = wp.normalize(sp.q_ned_from_frd)
    aim.yaw = yaw_from_quat(aim.q_ned_from_frd)
    if wp.isfinite(sp.yaw_rate):
        lean = quat_from_yaw(-aim.yaw) * aim.q_ned_from_frd
        rate = wp.clamp(sp.yaw_rate, -params.rate_max_yaw, params.rate_max_yaw)
        aim.yaw = wrap_pi(yaw + rate * _TICK_S)
        aim.q_ned_from_frd = quat_from_yaw(aim.yaw) * lean
        aim.omega_ned = wp.vec3(0.0, 0.0, rate)
    return aim


@wp.func
def aim_of_lean(trajectory: TrajectoryState, sp: Setpoint) -> Aim:
    """The lean of the setpoint at the heading of the trajectory."""
    aim = Aim()
    q = wp.normalize(sp.q_ned_from_frd)
    aim.yaw = trajectory.yaw
    aim.q_ned_from_frd = quat_from_yaw(aim.yaw) * quat_from_yaw(-yaw_from_quat(q)) * q
    aim.omega_ned = wp.vec3(0.0, 0.0, trajectory.yaw_rate)
    return aim


@wp.func
def thrust_along(q_ned_from_frd: wp.quat, up: float) -> wp.vec3:
    """The thrust [m/s²] along body up, at an attitude, whose upward part is `up`."""
    axis = wp.quat_rotate(q_ned_from_frd, wp.vec3(0.0, 0.0, -1.0))
    return axis * (up / wp.max(-axis[2], _UPRIGHT_MIN))


@wp.func
def actuators_of(
    airframe: ControlAirframe,
    trajectory: TrajectoryState,
    torque_frd: wp.vec3,
    thrust_fraction: float,
    result: Allocation,
    voltage_fraction: float,
) -> Actuators:
    """Motor commands of an allocation and the setpoints behind it; the attitude and rate setpoints stay unset."""
    actuators = Actuators()
    actuators.command = motor_commands(airframe, result.thrust_n, voltage_fraction)
    actuators.torque_sp_frd = torque_frd
    actuators.thrust_sp = thrust_fraction
    short = result.torque_short_frd
    for k in range(3):
        if wp.abs(short[k]) < _SLACK * wp.abs(torque_frd[k]):
            short[k] = 0.0
    actuators.torque_unallocated_frd = short
    actuators.traj_pos_ned = trajectory.pos_ned
    actuators.traj_vel_ned = flown_velocity(trajectory)
    actuators.traj_accel_ned = flown_acceleration(trajectory)
    actuators.traj_yaw = trajectory.yaw
    actuators.traj_yaw_rate = trajectory.yaw_rate
    return actuators


@wp.func
def started(
    airframe: ControlAirframe, state: ControlState, est: Estimate, sp: Setpoint, voltage_fraction: float
) -> ControlState:
    """The state at the beginning of an active tick: the trajectory starts afresh where control of a kind begins."""
    now = state
    now.voltage_fraction = voltage_fraction
    now.kind = sp.kind
    now.was_landed = sp.is_landed
    if sp.kind != state.kind or state.was_landed == 1:
        now.trajectory = trajectory_at_estimate(est, 1 - state.was_landed)
        now.aim.yaw = now.trajectory.yaw
    if state.kind == SETPOINT_IDLE and state.was_landed == 0:  # power-on in the air: a simulation started there
        now.ramp = 1.0
        now.collective_n = airframe.mass_kg * _GRAVITY
        now.velocity.thrust_model_n = now.collective_n
    return now


@wp.func
def is_light(airframe: ControlAirframe, ramp: float, thrust_max_n: float) -> bool:
    """Whether the thrust allowed so far at take-off could carry the vehicle: until then the ground holds it."""
    return ramp * thrust_max_n >= airframe.mass_kg * _GRAVITY


@wp.func
def outer_loops(
    params: ControlParams,
    airframe: ControlAirframe,
    state: ControlState,
    est: Estimate,
    sp: Setpoint,
    thrust_max_n: float,
) -> ControlState:
    """The state with trajectory, position and velocity loop advanced by a 50 Hz frame."""
    now = state
    if not is_light(airframe, now.ramp, thrust_max_n):  # the trajectory does not run ahead
        now.trajectory = trajectory_at_estimate(est, 0)
    now.trajectory = trajectory_step(params, now.trajectory, est, sp, _FRAME_S)
    vel_sp_ned = velocity_setpoint(params, now.trajectory, est)
    now.velocity = velocity_step(
        params, airframe, now.velocity, now.trajectory, est, vel_sp_ned, thrust_max_n, now.ramp < 1.0, _FRAME_S
    )
    if sp.kind == SETPOINT_LEAN:
        now.aim = aim_of_lean(now.trajectory, sp)
        now.velocity.thrust_sp_ned = thrust_along(now.aim.q_ned_from_frd, -now.velocity.thrust_sp_ned[2])
    else:
        now.aim = aim_of_thrust(now.velocity.thrust_sp_ned, now.trajectory)
    return now


@wp.func
def inner_loops(
    params: ControlParams,
    airframe: ControlAirframe,
    state: ControlState,
    est: Estimate,
    sp: Setpoint,
    collective_n: float,
    rotor_max_n: float,
) -> ControlState:
    """The state with attitude and rate loop, allocation and motor commands of this tick."""
    now = state
    omega_sp_frd = clamp3(sp.omega_frd, wp.vec3(params.rate_max_roll, params.rate_max_pitch, params.rate_max_yaw))
    if sp.kind != SETPOINT_RATE:
        omega_sp_frd = rate_setpoint(params, est.q_ned_from_frd, now.aim.q_ned_from_frd, now.aim.omega_ned)
    if sp.is_landed == 0 and is_light(airframe, now.ramp, float(airframe.rotor_count) * rotor_max_n):
        now.rate = rate_step(params, now.rate, omega_sp_frd, now.actuators.torque_unallocated_frd, _TICK_S)
    torque_frd = rate_torque(params, now.rate, omega_sp_frd, airframe.inertia_kg_m2)
    rotor_min_n = rotor_thrust(airframe, airframe.idle_speed_fraction, now.voltage_fraction)
    result = allocate(airframe, torque_frd, collective_n, rotor_min_n, rotor_max_n)
    now.collective_n = result.collective_n
    thrust_fraction = collective_n / (float(airframe.rotor_count) * rotor_max_n)
    now.actuators = actuators_of(airframe, now.trajectory, torque_frd, thrust_fraction, result, now.voltage_fraction)
    now.actuators.omega_sp_frd = omega_sp_frd
    now.actuators.q_sp_ned_from_frd = now.aim.q_ned_from_frd
    return now


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
    """The controller's state, with `actuators`, after one 4 ms tick.

    Inside branches the state is changed field by field: Warp copies a whole struct where a branch assigns it.
    """
    voltage_fraction = voltage_step(state.voltage_fraction, airframe.full_voltage_v, battery)
    is_direct = sp.kind == SETPOINT_ATTITUDE or sp.kind == SETPOINT_RATE
    is_idle = sp.is_armed == 0 or sp.kind == SETPOINT_IDLE
    if is_idle or (sp.is_landed == 1 and (not is_direct or sp.thrust <= 0.0)):
        return rest(voltage_fraction, airframe, est, sp)

    rotor_max_n = rotor_thrust(airframe, 1.0, voltage_fraction)
    thrust_max_n = float(airframe.rotor_count) * rotor_max_n
    now = started(airframe, state, est, sp, voltage_fraction)
    now.rate = filter_rates(params, now.rate, est.omega_frd, _TICK_S)
    if now.ramp >= 1.0:
        now.velocity = observe(params, airframe, now.velocity, est, now.collective_n, _TICK_S)
    else:
        now.ramp = wp.min(now.ramp + _TICK_S / wp.max(params.takeoff_ramp_s, _TICK_S), 1.0)

    collective_n = wp.clamp(sp.thrust, 0.0, 1.0) * thrust_max_n
    if sp.kind == SETPOINT_TRAJECTORY or sp.kind == SETPOINT_LEAN:
        if tick % _FRAME_TICKS == 0 or sp.kind != state.kind or state.was_landed == 1:
            outer = outer_loops(params, airframe, now, est, sp, thrust_max_n)
            now.trajectory = outer.trajectory
            now.velocity = outer.velocity
            now.aim = outer.aim
        else:
            now.aim.q_ned_from_frd = turned(now.aim.q_ned_from_frd, now.aim.omega_ned, _TICK_S)
        collective_n = upright_collective(airframe, now.velocity.thrust_sp_ned, est)
    elif sp.kind == SETPOINT_ATTITUDE:
        now.aim = aim_of_attitude(params, now.aim.yaw, sp)
    else:
        now.aim.q_ned_from_frd = est.q_ned_from_frd
    collective_n = wp.min(collective_n, now.ramp * thrust_max_n)
    return inner_loops(params, airframe, now, est, sp, collective_n, rotor_max_n)
