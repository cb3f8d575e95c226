"""Rate loop: PID from body rates to torque, derivative on the filtered measurement, 250 Hz."""

import warp as wp

from autopilot.control.pid import integrate_unless_short, low_pass_fraction
from autopilot.vehicles.multirotor.params import ControlParams

wp.set_module_options({"enable_backward": False})


@wp.struct
class RateState:
    integral_frd: wp.vec3  # [rad/s²]
    omega_frd: wp.vec3  # [rad/s] low-passed
    omega_dot_frd: wp.vec3  # [rad/s²] low-passed
    is_started: int  # 0: take the next measurement as it is


@wp.func
def filter_rates(params: ControlParams, state: RateState, omega_frd: wp.vec3, dt_s: float) -> RateState:
    """The state with rates and their derivative low-passed."""
    seen = state
    if state.is_started == 0:
        seen.omega_frd = omega_frd
        seen.omega_dot_frd = wp.vec3(0.0, 0.0, 0.0)
        seen.is_started = 1
        return seen
    smooth_frd = state.omega_frd + (omega_frd - state.omega_frd) * low_pass_fraction(params.gyro_cutoff_hz, dt_s)
    slope = (smooth_frd - state.omega_frd) / dt_s
    seen.omega_frd = smooth_frd
    fraction = low_pass_fraction(params.gyro_rate_cutoff_hz, dt_s)
    seen.omega_dot_frd = state.omega_dot_frd + (slope - state.omega_dot_frd) * fraction
    return seen


@wp.func
def rate_step(
    params: ControlParams, state: RateState, omega_sp_frd: wp.vec3, shortfall_frd: wp.vec3, dt_s: float
) -> RateState:
    """The state with the integral advanced; `shortfall_frd` is the torque the last allocation did not achieve."""
    gain = wp.vec3(params.rate_i_tilt, params.rate_i_tilt, params.rate_i_yaw)
    limit = wp.vec3(params.rate_integral_max_tilt, params.rate_integral_max_tilt, params.rate_integral_max_yaw)
    after = state
    after.integral_frd = integrate_unless_short(
        state.integral_frd, omega_sp_frd - state.omega_frd, gain, shortfall_frd, limit, dt_s
    )
    return after


@wp.func
def rate_torque(params: ControlParams, state: RateState, omega_sp_frd: wp.vec3, inertia_kg_m2: wp.vec3) -> wp.vec3:
    """Torque [N m], frd: inertia times the PID's angular acceleration, plus the gyroscopic term."""
    gain_p = wp.vec3(params.rate_p_tilt, params.rate_p_tilt, params.rate_p_yaw)
    gain_d = wp.vec3(params.rate_d_tilt, params.rate_d_tilt, params.rate_d_yaw)
    accel = wp.cw_mul(gain_p, omega_sp_frd - state.omega_frd) + state.integral_frd
    accel = accel - wp.cw_mul(gain_d, state.omega_dot_frd)
    momentum = wp.cw_mul(inertia_kg_m2, state.omega_frd)
    return wp.cw_mul(inertia_kg_m2, accel) + wp.cross(state.omega_frd, momentum)
