"""Alignment: from power-on to a first attitude, heading and height.

Averages accelerometer, gyro, magnetometer and barometer for half a second at rest. Tilt comes from the accelerometer,
gyro bias from the mean rate, heading from the levelled field, the height reference from the pressure. A vehicle that
will not stand still (a log that starts in flight) is aligned after a while all the same, with wider bounds.
"""

import warp as wp

from autopilot.estimator.fuse import set_slow_variance, set_sum_variance, set_variance
from autopilot.estimator.params import MAG_TYPE_NONE, EstimatorParams
from autopilot.estimator.sources.baro import baro_height
from autopilot.estimator.sources.mag import is_disturbed, start_mag
from autopilot.estimator.state import (
    ACCEL_BIAS,
    ATT,
    BODY,
    EARTH,
    GYRO_BIAS,
    POS,
    SLOW_COUNT,
    TERRAIN,
    VEL,
    WIND,
    Alignment,
    Nominal,
    Stillness,
)
from autopilot.ports import ImuSample, Samples
from common.kernels import TICK_S, vec24

wp.set_module_options({"enable_backward": False})

_AVERAGE_S = wp.constant(0.5)
_PATIENCE_S = wp.constant(2.0)  # for rest, and for a first sample of barometer and magnetometer
_MAG_SAMPLES = wp.constant(5)
_BARO_SAMPLES = wp.constant(5)
_MOVING_TILT_STD = wp.constant(0.3)  # [rad] guess: aligned in motion
_VEL_STD = wp.constant(0.1)  # [m/s] aligned at rest
_MOVING_VEL_STD = wp.constant(10.0)  # [m/s]
_MOVING_POS_STD = wp.constant(1000.0)  # [m] powered on in flight, it may be anywhere; guess
_HEIGHT_STD = wp.constant(0.1)  # [m] height counts from where it boots, wherever that is
WIND_STD = wp.constant(5.0)  # [m/s] guess
_TERRAIN_STD = wp.constant(0.1)  # [m] it stands there


@wp.func
def average(align: Alignment, still: Stillness, imu: ImuSample, samples: Samples) -> Alignment:
    """The sums with the newest samples; they start anew with each motion while there is patience."""
    align.waited_s = align.waited_s + imu.dt_s
    align.is_moving = 1
    if still.still_s > 0.0 and still.is_rolling == 0:
        align.is_moving = 0
    if align.is_moving == 1 and align.waited_s < _PATIENCE_S:
        align.time_s = 0.0
        align.accel_frd = wp.vec3()
        align.gyro_frd = wp.vec3()
    align.time_s = align.time_s + imu.dt_s
    align.accel_frd = align.accel_frd + imu.accel_frd * imu.dt_s
    align.gyro_frd = align.gyro_frd + imu.gyro_frd * imu.dt_s
    if samples.mag.time_us != align.mag_time_us:
        align.mag_time_us = samples.mag.time_us
        align.mag_frd = align.mag_frd + samples.mag.field_frd_gauss
        align.mag_count += 1
    if samples.baro.time_us != align.baro_time_us:
        align.baro_time_us = samples.baro.time_us
        align.baro_height = align.baro_height + baro_height(samples.baro.pressure_pa)
        align.baro_count += 1
    return align


@wp.func
def is_aligned(align: Alignment) -> bool:
    """Enough was averaged, or patience has ended."""
    is_complete = align.mag_count >= _MAG_SAMPLES and align.baro_count >= _BARO_SAMPLES
    return align.time_s > _AVERAGE_S and (is_complete or align.waited_s > _PATIENCE_S)


@wp.func
def level_attitude(accel_frd: wp.vec3) -> wp.quat:
    """Attitude of heading zero whose down axis is opposite to a specific force at rest."""
    roll = wp.atan2(-accel_frd[1], -accel_frd[2])
    pitch = wp.atan2(accel_frd[0], wp.sqrt(accel_frd[1] * accel_frd[1] + accel_frd[2] * accel_frd[2]))
    q_roll = wp.quat(wp.sin(0.5 * roll), 0.0, 0.0, wp.cos(0.5 * roll))
    q_pitch = wp.quat(0.0, wp.sin(0.5 * pitch), 0.0, wp.cos(0.5 * pitch))
    return wp.normalize(q_pitch * q_roll)


@wp.func
def start_covariance(params: EstimatorParams, cov: wp.array2d(dtype=vec24), i: int, align: Alignment) -> None:
    """Variances after alignment; heading and field are set when the magnetometer starts."""
    tilt_std = params.tilt_init
    vel_std = _VEL_STD
    pos_std = params.boot_std
    gyro_bias_std = params.gyro_noise * wp.sqrt(TICK_S / align.time_s)
    if align.is_moving == 1:
        tilt_std = wp.max(tilt_std, _MOVING_TILT_STD)
        vel_std = _MOVING_VEL_STD
        pos_std = _MOVING_POS_STD
        gyro_bias_std = params.gyro_bias_init
    for axis in range(3):
        set_variance(cov, i, ATT + axis, tilt_std * tilt_std)
        set_variance(cov, i, VEL + axis, vel_std * vel_std)
        set_variance(cov, i, POS + axis, pos_std * pos_std)
        set_variance(cov, i, GYRO_BIAS + axis, gyro_bias_std * gyro_bias_std)
        set_variance(cov, i, ACCEL_BIAS + axis, params.accel_bias_init * params.accel_bias_init)
        set_variance(cov, i, EARTH + axis, 0.01)  # (0.1 gauss)²
        set_variance(cov, i, BODY + axis, params.body_field_init * params.body_field_init)
    set_variance(cov, i, ATT + 2, wp.pi * wp.pi / 3.0)  # uniform over the circle
    set_variance(cov, i, POS + 2, _HEIGHT_STD * _HEIGHT_STD)
    set_variance(cov, i, WIND, WIND_STD * WIND_STD)
    set_variance(cov, i, WIND + 1, WIND_STD * WIND_STD)
    set_sum_variance(cov, i, TERRAIN, POS + 2, _TERRAIN_STD * _TERRAIN_STD)
    for j in range(SLOW_COUNT):
        set_slow_variance(cov, i, j, 0.0)  # no fix, no pressure yet


@wp.func
def aligned_nominal(params: EstimatorParams, cov: wp.array2d(dtype=vec24), i: int, align: Alignment) -> Nominal:
    """The first nominal state: at the origin, on its feet."""
    nominal = Nominal()
    nominal.q_ned_from_frd = level_attitude(align.accel_frd)
    nominal.pos_ned = wp.vec3(0.0, 0.0, -params.rest_height)
    if align.is_moving == 0:
        nominal.gyro_bias_frd = align.gyro_frd / align.time_s
    start_covariance(params, cov, i, align)
    if align.mag_count >= _MAG_SAMPLES and params.mag_type != MAG_TYPE_NONE:
        field_frd = align.mag_frd / float(align.mag_count)
        if not is_disturbed(params, nominal.q_ned_from_frd, field_frd):
            nominal = start_mag(params, cov, i, nominal, field_frd)
    return nominal
