"""Heading by the yaw estimator: alignment in flight without a magnetometer, and the emergency reset with a wrong one.

In: each good GNSS fix, before it is fused. Where heading is not known, it is set once the yaw estimator has converged.
Where it is, and differs from the yaw estimator's by more than both can explain, it is set too; the magnetometer is
faulty then and not fused until it agrees again. Velocity, position, biases and wind were wrong with heading: they start
anew.
"""

import warp as wp

from autopilot.estimator.align import WIND_STD
from autopilot.estimator.delay import MAX_AGE_S
from autopilot.estimator.fuse import seconds_since, set_variance
from autopilot.estimator.health import is_doubted
from autopilot.estimator.params import GPS_CTRL_VEL, EstimatorParams
from autopilot.estimator.sources.gnss import (
    gnss_is_good,
    gnss_pos_std,
    gnss_vel_is_good,
    gnss_vel_std,
    set_gnss_axis,
)
from autopilot.estimator.state import ACCEL_BIAS, ATT, GNSS_RING, GYRO_BIAS, VEL, WIND, Ekf
from autopilot.estimator.yaw_estimator import RATIO_S, estimated_yaw, has_yaw, start_tilt, take_velocity
from autopilot.ports import GnssSample
from common.rotation import quat_from_yaw, wrap_pi, yaw_from_quat

wp.set_module_options({"enable_backward": False})

_LEAST_ERROR = wp.constant(0.2618)  # [rad] 15 deg
_SIGMAS = wp.constant(4.0)
_WORSE = wp.constant(3.0)  # ratios of the two are alike, within 2.2, where heading is right, and 5 where it is wrong
_MAX_RATIO = wp.constant(3.0)  # 1 expected; an accelerometer that is wrong by 2 m/s² leads to 5 and more
_SETTLED_S = wp.constant(10.0)  # guess: for a tilt taken in motion
_DISAGREE_S = wp.constant(1.0)
_STARVED_ERROR = wp.constant(0.436)  # [rad] 25 deg, while GNSS velocity is rejected (PX4)
_STARVED_S = wp.constant(1.0)  # (PX4)
_TILT_STD = wp.constant(0.05)  # [rad] what a wrong heading did to the tilt; guess
_GYRO_BIAS_STD = wp.constant(0.01)  # [rad/s] and to the gyro bias; guess


@wp.func
def set_heading(ekf: Ekf, i: int, params: EstimatorParams, sample: GnssSample) -> None:
    """Heading set to the yaw estimator's, velocity and position to the fix; all that hung on heading starts anew."""
    cov = ekf.covariance
    nominal = ekf.rows[i].nominal
    turn = wrap_pi(estimated_yaw(ekf.yaw[i]) - yaw_from_quat(nominal.q_ned_from_frd))
    nominal.q_ned_from_frd = wp.normalize(quat_from_yaw(turn) * nominal.q_ned_from_frd)
    nominal.yaw_jump = nominal.yaw_jump + turn
    nominal.vel_jump_ned = nominal.vel_jump_ned + sample.vel_ned - nominal.vel_ned
    nominal.vel_ned = sample.vel_ned
    nominal.accel_bias_frd = wp.vec3()
    nominal.wind_ned = wp.vec3()
    nominal.reset_count += 1
    vel_std = gnss_vel_std(params, sample)
    for axis in range(3):
        set_variance(cov, i, ATT + axis, _TILT_STD * _TILT_STD)
        set_variance(cov, i, VEL + axis, vel_std * vel_std)
        set_variance(cov, i, GYRO_BIAS + axis, _GYRO_BIAS_STD * _GYRO_BIAS_STD)
        set_variance(cov, i, ACCEL_BIAS + axis, params.accel_bias_init * params.accel_bias_init)
    set_variance(cov, i, ATT + 2, ekf.yaw[i].yaw_var)
    set_variance(cov, i, WIND, WIND_STD * WIND_STD)
    set_variance(cov, i, WIND + 1, WIND_STD * WIND_STD)
    if ekf.rows[i].external_pos.is_active == 0:
        pos_std = gnss_pos_std(params, sample)
        for axis in range(2):
            nominal = set_gnss_axis(params, cov, i, nominal, sample, axis, sample.pos_ned[axis], pos_std * pos_std)
        ekf.rows[i].wander_time_us = sample.time_us
    ekf.rows[i].nominal = nominal
    ekf.rows[i].is_yaw_aligned = 1
    ekf.yaw[i].disagree_s = 0.0
    ekf.yaw[i].main_ratio_lpf = 1.0


@wp.func
def main_ratio(ekf: Ekf, i: int, sample: GnssSample, vel_std: float) -> float:
    """Squared horizontal innovations of the main filter over their variances, halved: 1 expected."""
    innov_ned = sample.vel_ned - ekf.rows[i].nominal.vel_ned
    ratio = float(0.0)
    for axis in range(2):
        innov_var = ekf.covariance[i, VEL + axis][VEL + axis] + vel_std * vel_std
        ratio += innov_ned[axis] * innov_ned[axis] / innov_var
    return 0.5 * ratio


@wp.func
def is_settled(ekf: Ekf, i: int) -> bool:
    """The yaw estimator knows a heading that explains GNSS velocity, by a tilt that has had time to come right."""
    has_tilt = ekf.rows[i].alignment.is_moving == 0 or ekf.yaw[i].running_s > _SETTLED_S
    return has_yaw(ekf.yaw[i]) and has_tilt and ekf.yaw[i].ratio_lpf < _MAX_RATIO


@wp.func
def heading_is_wrong(ekf: Ekf, i: int, sample: GnssSample, step_s: float) -> bool:
    """Heading is wrong beyond doubt, for a while or while GNSS velocity is rejected.

    Beyond doubt: it differs by more than both can explain, and the yaw estimator explains GNSS velocity better by far.
    """
    turn = wp.abs(wrap_pi(estimated_yaw(ekf.yaw[i]) - yaw_from_quat(ekf.rows[i].nominal.q_ned_from_frd)))
    sigma = wp.sqrt(ekf.yaw[i].yaw_var + ekf.covariance[i, ATT + 2][ATT + 2])
    is_worse = ekf.yaw[i].main_ratio_lpf > _WORSE * ekf.yaw[i].ratio_lpf
    if is_worse and turn > wp.max(_LEAST_ERROR, _SIGMAS * sigma) and not is_doubted(ekf.rows[i]):
        ekf.yaw[i].disagree_s += step_s
    else:
        ekf.yaw[i].disagree_s = 0.0
    starved_s = seconds_since(sample.time_us, ekf.rows[i].gnss_vel.fused_time_us)
    is_starved = is_worse and turn > _STARVED_ERROR and starved_s > _STARVED_S
    return ekf.yaw[i].disagree_s > _DISAGREE_S or is_starved


@wp.func
def take_heading(ekf: Ekf, i: int, params: EstimatorParams, now_us: wp.int64) -> None:
    """The oldest waiting fix, once the horizon has passed it, moves the yaw estimator, which may set heading."""
    sample = ekf.gnss_ring[i, ekf.rows[i].gnss_inbox.tail % GNSS_RING]
    is_late = seconds_since(now_us, sample.time_us) > MAX_AGE_S
    if sample.time_us > now_us or is_late or not gnss_is_good(params, sample):
        return
    if (params.gnss_ctrl & GPS_CTRL_VEL) == 0 or not gnss_vel_is_good(params, sample):
        return
    if ekf.rows[i].stillness.is_still == 1:
        nominal = ekf.rows[i].nominal
        ekf.yaw[i] = start_tilt(ekf.yaw[i], nominal.q_ned_from_frd, nominal.gyro_bias_frd)
        return
    step_s = ekf.yaw[i].since_fix_s
    vel_std = gnss_vel_std(params, sample)
    gain = wp.min(step_s / RATIO_S, 1.0)
    ekf.yaw[i].main_ratio_lpf += gain * (main_ratio(ekf, i, sample, vel_std) - ekf.yaw[i].main_ratio_lpf)
    ekf.yaw[i] = take_velocity(ekf.yaw[i], sample.time_us, sample.vel_ned, vel_std)
    if not is_settled(ekf, i) or ekf.rows[i].external_yaw.is_active == 1:
        return
    if ekf.rows[i].is_yaw_aligned == 0:
        set_heading(ekf, i, params, sample)
    elif heading_is_wrong(ekf, i, sample, step_s):
        if ekf.rows[i].mag.is_active == 1:
            ekf.rows[i].is_mag_faulty = 1
        set_heading(ekf, i, params, sample)
