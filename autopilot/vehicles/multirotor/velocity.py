"""Velocity loop: PID to acceleration, minus the observed disturbance, to a thrust vector within limits, 50 Hz.

The disturbance observer compares the accelerometer with the thrust the rotors should make (Smeur, de Croon and Chu
2018, "Cascaded incremental nonlinear dynamic inversion for MAV disturbance rejection", with the filtered difference
subtracted instead of an increment): wind, wrong mass and air density are met before they become a velocity error.
The integral then only meets what the accelerometer cannot see, such as a tilt error.
"""

import warp as wp

from autopilot.control.pid import clamp_horizontal, low_pass_fraction
from autopilot.ports import Estimate
from autopilot.vehicles.multirotor.attitude import rate_lags_s
from autopilot.vehicles.multirotor.control_airframe import ControlAirframe
from autopilot.vehicles.multirotor.params import ControlParams
from autopilot.vehicles.multirotor.trajectory import FOLLOW_ACCEL, TrajectoryState, flown_acceleration
from common.geodesy import GRAVITY_M_S2

wp.set_module_options({"enable_backward": False})

_GRAVITY = wp.constant(GRAVITY_M_S2)
_INTEGRAL_MAX_XY = wp.constant(4.0)  # [m/s²] guess: 22 deg of lean
_INTEGRAL_MAX_Z = wp.constant(4.0)
_DISTURBANCE_MAX_XY = wp.constant(6.0)  # [m/s²] guess: drag at about 20 m/s
_DISTURBANCE_MAX_Z = wp.constant(4.0)  # bounds what contact with the ground is taken for
_HORIZONTAL_FRACTION_MIN = wp.constant(0.3)  # of the greatest thrust, kept for going sideways (as PX4's 0.3)


@wp.struct
class VelocityState:
    integral_ned: wp.vec3  # [m/s²]
    accel_ned: wp.vec3  # low-passed measured acceleration
    disturbance_ned: wp.vec3  # [m/s²] acceleration that does not come from thrust or gravity
    thrust_model_n: float  # collective thrust after motor lag
    thrust_sp_ned: wp.vec3  # [m/s²] thrust over mass, points up when hovering


@wp.func
def observe(
    params: ControlParams,
    airframe: ControlAirframe,
    state: VelocityState,
    est: Estimate,
    collective_n: float,
    dt_s: float,
) -> VelocityState:
    """The state with acceleration and disturbance observed, each tick; `collective_n` is what the rotors make."""
    seen = state
    seen.thrust_model_n = state.thrust_model_n + (collective_n - state.thrust_model_n) * dt_s / (
        dt_s + airframe.motor_time_s
    )
    other_frd = est.accel_frd + wp.vec3(0.0, 0.0, state.thrust_model_n / airframe.mass_kg)
    other_ned = wp.quat_rotate(est.q_ned_from_frd, other_frd)
    fraction = low_pass_fraction(params.disturbance_cutoff_hz, dt_s)
    if params.disturbance_cutoff_hz > 0.0:
        disturbance = state.disturbance_ned + (other_ned - state.disturbance_ned) * fraction
        disturbance = clamp_horizontal(disturbance, _DISTURBANCE_MAX_XY)
        disturbance[2] = wp.clamp(disturbance[2], -_DISTURBANCE_MAX_Z, _DISTURBANCE_MAX_Z)
        seen.disturbance_ned = disturbance
    else:
        seen.disturbance_ned = wp.vec3(0.0, 0.0, 0.0)
    fraction = low_pass_fraction(params.accel_cutoff_hz, dt_s)
    seen.accel_ned = state.accel_ned + (est.accel_ned - state.accel_ned) * fraction
    return seen


@wp.func
def limit_thrust(thrust_ned: wp.vec3, lean_max: float, least: float, most: float) -> wp.vec3:
    """The thrust vector [m/s²] within tilt and size, height before sideways.

    Args:
        thrust_ned: wanted, z negative is up.
        lean_max: tangent of the greatest tilt.
        least: smallest upward part.
        most: greatest size.
    """
    up = wp.clamp(-thrust_ned[2], least, most)
    level_max = wp.sqrt(wp.max(most * most - up * up, 0.0))
    reserve = _HORIZONTAL_FRACTION_MIN * most
    level = wp.sqrt(thrust_ned[0] * thrust_ned[0] + thrust_ned[1] * thrust_ned[1])
    if level_max < reserve and level > level_max:
        up = wp.min(up, wp.max(wp.sqrt(most * most - reserve * reserve), _GRAVITY))  # climbing gives way, not height
        level_max = wp.sqrt(wp.max(most * most - up * up, 0.0))
    return clamp_horizontal(wp.vec3(thrust_ned[0], thrust_ned[1], -up), wp.min(level_max, lean_max * up))


@wp.func
def velocity_step(
    params: ControlParams,
    airframe: ControlAirframe,
    state: VelocityState,
    trajectory: TrajectoryState,
    est: Estimate,
    vel_sp_ned: wp.vec3,
    thrust_max_n: float,
    is_ramping: bool,
    dt_s: float,
) -> VelocityState:
    """The state with a new thrust setpoint; the integral stops where the limits take something away.

    Level velocity is compared with what it can be by now: the lean, and so its acceleration, follows as late as rates.
    """
    feed = flown_acceleration(trajectory)
    error = vel_sp_ned - wp.cw_mul(rate_lags_s(params), feed) - est.vel_ned
    for k in range(3):
        if trajectory.mode[k] == FOLLOW_ACCEL:
            error[k] = 0.0
    gain_p = wp.vec3(params.vel_p_xy, params.vel_p_xy, params.vel_p_z)
    gain_i = wp.vec3(params.vel_i_xy, params.vel_i_xy, params.vel_i_z)
    gain_d = wp.vec3(params.vel_d_xy, params.vel_d_xy, params.vel_d_z)
    feed = feed + wp.cw_mul(gain_d, feed - state.accel_ned)
    accel_sp = feed + wp.cw_mul(gain_p, error) + state.integral_ned - state.disturbance_ned
    wanted = accel_sp - wp.vec3(0.0, 0.0, _GRAVITY)
    most = params.thrust_max * thrust_max_n / airframe.mass_kg
    least = params.thrust_min * thrust_max_n / airframe.mass_kg
    after = state
    lean_max = params.tilt_max
    if is_ramping:
        lean_max = params.tilt_max_ramp
    after.thrust_sp_ned = limit_thrust(wanted, wp.tan(lean_max), least, most)
    short = wanted - after.thrust_sp_ned
    if not is_ramping:
        for k in range(3):
            if error[k] * short[k] <= 0.0 or wp.abs(short[k]) < 1.0e-3:
                after.integral_ned[k] = state.integral_ned[k] + gain_i[k] * error[k] * dt_s
        after.integral_ned = clamp_horizontal(after.integral_ned, _INTEGRAL_MAX_XY)
        after.integral_ned[2] = wp.clamp(after.integral_ned[2], -_INTEGRAL_MAX_Z, _INTEGRAL_MAX_Z)
    return after
