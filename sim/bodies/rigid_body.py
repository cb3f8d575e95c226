"""What the rigid bodies of all classes share: rest, truth, being held, attitude after a turn, air, first-order lags.

A `State` of a class has what all have under the names of `Truth`, and the charge of its battery.
"""

from typing import Any

import warp as wp

from common.geodesy import GRAVITY_M_S2
from common.rotation import quat_from_yaw
from sim.battery import BatteryModel
from sim.truth import Truth

wp.set_module_options({"enable_backward": False})

_SEA_LEVEL_DENSITY_KG_M3 = wp.constant(1.225)  # ISO 2533 standard atmosphere
_GRAVITY_NED = wp.constant(wp.vec3(0.0, 0.0, GRAVITY_M_S2))


@wp.func
def turn_less_one(rotvec_frd: wp.vec3) -> wp.quat:
    """The rotation by a vector of less than 0.1 rad, less that by none: series of the exponential, exact to float32."""
    square = wp.dot(rotvec_frd, rotvec_frd)
    half_sinc = 0.5 - square / 48.0
    return wp.quat(half_sinc * rotvec_frd[0], half_sinc * rotvec_frd[1], half_sinc * rotvec_frd[2], -0.125 * square)


@wp.func
def turned_by(q_ned_from_frd: wp.quat, rotvec_frd: wp.vec3) -> wp.quat:
    """Attitude after a body rotation vector of less than 0.1 rad."""
    return wp.normalize(q_ned_from_frd + q_ned_from_frd * turn_less_one(rotvec_frd))


@wp.func
def moved(state: Any, accel_ned: wp.vec3, dt: float) -> Any:
    """A `State` after dt [s] of an acceleration and of its mean rate `gyro_frd`.

    Position, velocity and attitude are Kahan's sums: what single precision has added to each is taken off in the next
    step. A step is so small beside where the vehicle is that its rounding would move it by centimetres in minutes.
    """
    shift_ned = dt * (state.vel_ned + (0.5 * dt) * accel_ned) - state.pos_rounding_ned
    pos_ned = state.pos_ned + shift_ned
    state.pos_rounding_ned = (pos_ned - state.pos_ned) - shift_ned
    state.pos_ned = pos_ned
    gain_ned = dt * accel_ned - state.vel_rounding_ned
    vel_ned = state.vel_ned + gain_ned
    state.vel_rounding_ned = (vel_ned - state.vel_ned) - gain_ned
    state.vel_ned = vel_ned
    q = state.q_ned_from_frd
    change = q * turn_less_one(dt * state.gyro_frd) + (0.5 * (1.0 - wp.dot(q, q))) * q - state.q_rounding
    q_ned_from_frd = q + change
    state.q_rounding = (q_ned_from_frd - q) - change
    state.q_ned_from_frd = q_ned_from_frd
    return state


@wp.func
def rested(state: Any, battery: BatteryModel, pos_ned: wp.vec3, yaw_rad: float) -> Any:
    """A new `State` level and still at pos_ned, its battery full."""
    state.pos_ned = pos_ned
    state.q_ned_from_frd = quat_from_yaw(yaw_rad)
    state.accel_frd = -_GRAVITY_NED
    state.battery_charge_c = battery.capacity_c
    state.battery_voltage_v = battery.full_v
    return state


@wp.func
def held(state: Any, dt: float) -> Any:
    """A `State` after dt [s] in somebody's hands, in its place and turned at omega_frd."""
    state.vel_ned = wp.vec3()
    state.gyro_frd = state.omega_frd
    state.accel_frd = wp.quat_rotate_inv(state.q_ned_from_frd, -_GRAVITY_NED)
    state.q_ned_from_frd = turned_by(state.q_ned_from_frd, state.omega_frd * dt)
    return state


@wp.func
def truth_of(state: Any) -> Truth:
    """What others may read of a `State`, but for motors, wheels and pitot tube."""
    truth = Truth()
    truth.pos_ned = state.pos_ned
    truth.vel_ned = state.vel_ned
    truth.q_ned_from_frd = state.q_ned_from_frd
    truth.omega_frd = state.omega_frd
    truth.accel_frd = state.accel_frd
    truth.gyro_frd = state.gyro_frd
    truth.height_agl_m = state.height_agl_m
    truth.battery_voltage_v = state.battery_voltage_v
    truth.battery_current_a = state.battery_current_a
    truth.is_on_ground = state.is_on_ground
    truth.is_crashed = state.is_crashed
    truth.impact_speed = state.impact_speed
    return truth


@wp.func
def hull_drag(drag_area_frd: wp.vec3, air_vel_frd: wp.vec3, density_ratio: float) -> wp.vec3:
    """Force [N] on a hull: -½ rho (c_d A) |v| v along each axis; the density is over that at sea level."""
    pressure = -0.5 * _SEA_LEVEL_DENSITY_KG_M3 * density_ratio * wp.length(air_vel_frd)
    return pressure * wp.cw_mul(drag_area_frd, air_vel_frd)


@wp.func
def lag_gain(time_constant_s: float, dt: float) -> float:
    """Fraction of the way to its target a first-order lag goes in dt: the bilinear form of 1 - exp(-dt / tau)."""
    return 2.0 * dt / (2.0 * time_constant_s + dt)


def density_ratio_at(alt_amsl_m: float) -> float:
    """Air density over that at sea level (ISO 2533, troposphere)."""
    ratio: float = (1.0 - 2.25577e-5 * alt_amsl_m) ** 4.25588
    return ratio
