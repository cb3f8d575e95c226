"""Prediction: the nominal state moves with each IMU sample, the covariance every few samples.

In: one IMU sample as it passes the delayed horizon. Out: the nominal state at its time, and the process noise of a
covariance step. Earth rotation is left out: 7e-5 rad/s, a hundredth of what the gyro bias absorbs.
"""

import warp as wp

from autopilot.estimator.params import EstimatorParams
from autopilot.estimator.state import ACCEL_BIAS, ATT, BODY, EARTH, GYRO_BIAS, TERRAIN, VEL, WIND, Nominal
from autopilot.ports import ImuSample
from common.geodesy import GRAVITY_M_S2
from common.kernels import TICK_S, vec24
from common.rotation import quat_from_rotvec

wp.set_module_options({"enable_backward": False})

# Variances above which an unobserved state is left alone: it could not become less certain in any useful sense.
_MAX_WIND_VAR = wp.constant(100.0)  # (10 m/s)²
_MAX_TERRAIN_VAR = wp.constant(1.0e4)  # (100 m)²

# What an accelerometer's errors in a hard manoeuvre do to velocity: the density grows with the level's square. If
# velocity counted as known, what is wrong of it would become a bias as soon as that is learned again.
MANOEUVRE_ACCEL_NSD = wp.constant(0.02)  # [m²/s³] at level 1; guess: 2 m/s of a blow are gone in seconds


@wp.func
def delta_velocity_ned(q_ned_from_frd: wp.quat, delta_angle_frd: wp.vec3, delta_vel_frd: wp.vec3) -> wp.vec3:
    """Specific force integrated over a sample, turned to ned with the attitude half way through it."""
    return wp.quat_rotate(q_ned_from_frd, delta_vel_frd + 0.5 * wp.cross(delta_angle_frd, delta_vel_frd))


@wp.func
def predict_nominal(nominal: Nominal, imu: ImuSample) -> Nominal:
    """The nominal state one IMU sample later (strapdown equations)."""
    delta_angle_frd = (imu.gyro_frd - nominal.gyro_bias_frd) * imu.dt_s
    delta_vel_frd = (imu.accel_frd - nominal.accel_bias_frd) * imu.dt_s
    delta_vel_ned = delta_velocity_ned(nominal.q_ned_from_frd, delta_angle_frd, delta_vel_frd)
    vel_before_ned = nominal.vel_ned
    nominal.vel_ned = vel_before_ned + delta_vel_ned + wp.vec3(0.0, 0.0, GRAVITY_M_S2 * imu.dt_s)
    nominal.pos_ned = nominal.pos_ned + (vel_before_ned + nominal.vel_ned) * (0.5 * imu.dt_s)
    nominal.q_ned_from_frd = wp.normalize(nominal.q_ned_from_frd * quat_from_rotvec(delta_angle_frd))
    return nominal


@wp.func
def manoeuvre_level(params: EstimatorParams, before: float, force: float, rate: float, dt_s: float) -> float:
    """The decaying maximum of specific force and angular rate, each over EKF2_ABL_ACCLIM and EKF2_ABL_GYRLIM (PX4).

    Above 1 the accelerometer's clipping, its scale errors and its distance from the centre of turn would be taken for a
    bias, which is kept long after.

    Args:
        params: of the vehicle.
        before: the maximum so far.
        force: [m/s²] mean over the step, so that vibration averages out.
        rate: [rad/s] mean over the step.
        dt_s: of the step.
    """
    level = wp.max(force / params.manoeuvre_accel, rate / params.manoeuvre_rate)
    return wp.max(level, before * (1.0 - wp.min(dt_s / params.manoeuvre_tau_s, 1.0)))


@wp.func
def process_variance(
    params: EstimatorParams, cov: wp.array2d(dtype=vec24), i: int, vel_ned: wp.vec3, dt_s: float
) -> vec24:
    """Variance that each error gains in `dt_s`; noises of one 4 ms sample act as white noise of that density."""
    added = vec24()
    gyro_var = params.gyro_noise * params.gyro_noise * TICK_S * dt_s
    accel_var = params.accel_noise * params.accel_noise * TICK_S * dt_s
    gyro_bias_var = params.gyro_bias_walk * params.gyro_bias_walk * dt_s
    accel_bias_var = params.accel_bias_walk * params.accel_bias_walk * dt_s
    earth_var = params.earth_field_walk * params.earth_field_walk * dt_s
    body_var = params.body_field_walk * params.body_field_walk * dt_s
    for axis in range(3):
        added[ATT + axis] = gyro_var
        added[VEL + axis] = accel_var
        added[GYRO_BIAS + axis] = gyro_bias_var
        added[ACCEL_BIAS + axis] = accel_bias_var
        added[EARTH + axis] = earth_var
        added[BODY + axis] = body_var
    if cov[i, WIND][WIND] < _MAX_WIND_VAR:
        added[WIND] = params.wind_walk * params.wind_walk * dt_s
        added[WIND + 1] = added[WIND]
    if cov[i, TERRAIN][TERRAIN] < _MAX_TERRAIN_VAR:
        slope_var = params.terrain_gradient * params.terrain_gradient
        speed_sq = vel_ned[0] * vel_ned[0] + vel_ned[1] * vel_ned[1]
        added[TERRAIN] = (params.terrain_walk * params.terrain_walk + slope_var * speed_sq) * dt_s
    return added
