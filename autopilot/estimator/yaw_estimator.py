"""The yaw estimator: heading from IMU and GNSS velocity alone, of use when the compass is wrong or missing.

A Gaussian sum filter after P. Riseborough (EKF-GSF of PX4 and ArduPilot). A complementary filter keeps the tilt. Five
Kalman filters of three states (velocity north and east, heading) start at headings a fifth of a turn apart, and each is
weighted by how likely its velocity innovations are: once the vehicle accelerates, one of them explains the velocity.

In: each IMU sample that the horizon passes, each GNSS velocity. Out: heading and its variance. Tilt does not depend on
heading, so one complementary filter, whose level frame has an unknown heading, serves the five; and a velocity change
between two fixes is a sum in that frame, so they are predicted once per fix.
"""

import warp as wp

from autopilot.estimator.state import Ekf, YawEstimator
from autopilot.ports import ImuSample
from common.geodesy import GRAVITY_M_S2
from common.kernels import YAW_MODELS
from common.rotation import quat_from_rotvec, quat_from_yaw, wrap_pi, yaw_from_quat
from common.vectors import clamp3

wp.set_module_options({"enable_backward": False})

# Riseborough's figures, his noises of one 10 ms sample as densities
_TILT_GAIN = wp.constant(0.2)  # [rad/s] of the complementary filter
_BIAS_GAIN = wp.constant(0.04)  # [1/s] of the gyro bias, per tilt correction
_BIAS_LIMIT = wp.constant(0.05)  # [rad/s]
_TRUST_LOSS = wp.constant(2.0)  # the accelerometer shows no tilt from half a g of unknown motion on
_YAW_NSD = wp.constant(1.0e-4)  # [rad²/s]
_VEL_NSD = wp.constant(0.04)  # [m²/s³]
_MAX_RATIO = wp.constant(25.0)  # squared innovation ratio beyond which an innovation is shortened
_MIN_WEIGHT = wp.constant(1.0e-5)  # a heading once ruled out can come back
_STEP_S = wp.constant(0.0199)  # attitude is renewed at 50 Hz
_MAX_FIX_GAP_S = wp.constant(1.0)  # after a longer silence the filters start anew
RATIO_S = wp.constant(2.0)  # over which the squared innovation ratio is averaged
CONVERGED_VAR = wp.constant(0.0685)  # [rad²] (15 deg)²


@wp.func
def has_yaw(est: YawEstimator) -> bool:
    """The vehicle has moved enough for its heading to be known to 15 deg."""
    return est.is_running == 1 and est.yaw_var < CONVERGED_VAR


@wp.func
def start_tilt(est: YawEstimator, q_ned_from_frd: wp.quat, gyro_bias_frd: wp.vec3) -> YawEstimator:
    """The estimator at rest: tilt and bias as the main filter has them, heading unknown."""
    est.q_level_from_frd = q_ned_from_frd
    est.gyro_bias_frd = gyro_bias_frd
    est.delta_angle_frd = wp.vec3()
    est.delta_vel_frd = wp.vec3()
    est.step_s = 0.0
    est.delta_vel_level = wp.vec3()
    est.since_fix_s = 0.0
    est.is_running = 0
    est.running_s = 0.0
    return est


@wp.func
def turn_step(est: YawEstimator) -> YawEstimator:
    """Attitude after the IMU samples summed since the last call, and the velocity gained in the level frame."""
    turn_frd = est.delta_angle_frd - est.gyro_bias_frd * est.step_s
    middle_vel_frd = est.delta_vel_frd + 0.5 * wp.cross(turn_frd, est.delta_vel_frd)
    est.delta_vel_level = est.delta_vel_level + wp.quat_rotate(est.q_level_from_frd, middle_vel_frd)
    est.q_level_from_frd = wp.normalize(est.q_level_from_frd * quat_from_rotvec(turn_frd))
    est.since_fix_s = est.since_fix_s + est.step_s
    est.delta_angle_frd = wp.vec3()
    est.delta_vel_frd = wp.vec3()
    est.step_s = 0.0
    return est


@wp.func
def sum_imu(ekf: Ekf, i: int, imu: ImuSample) -> None:
    """Takes an IMU sample; in place, since the whole estimator is moved at 50 Hz only."""
    ekf.yaw[i].delta_angle_frd += imu.gyro_frd * imu.dt_s
    ekf.yaw[i].delta_vel_frd += imu.accel_frd * imu.dt_s
    ekf.yaw[i].step_s += imu.dt_s
    if ekf.yaw[i].step_s > _STEP_S:
        ekf.yaw[i] = turn_step(ekf.yaw[i])


@wp.func
def correct_tilt(est: YawEstimator, gained_ned: wp.vec3) -> YawEstimator:
    """Tilt and gyro bias moved towards what the accelerometer shows, less the acceleration that GNSS measured.

    Riseborough takes the specific force for gravity's, unless it is far from one g: in a long turn tilt is then wrong
    by several degrees, and heading with it. Once heading is known GNSS tells gravity and acceleration apart; before,
    it tells how little the accelerometer is worth.
    """
    dt_s = est.since_fix_s
    accel_ned = gained_ned / dt_s
    accel_level = wp.vec3(0.0, 0.0, accel_ned[2])
    unexplained = wp.sqrt(accel_ned[0] * accel_ned[0] + accel_ned[1] * accel_ned[1])
    if has_yaw(est):
        accel_level = wp.quat_rotate_inv(quat_from_yaw(est.yaw_level), accel_ned)
        unexplained = 0.0
    gravity_level = accel_level - est.delta_vel_level / dt_s
    excess = wp.max(wp.abs(wp.length(gravity_level) - GRAVITY_M_S2), unexplained)
    trust = 1.0 - wp.min(_TRUST_LOSS * excess / GRAVITY_M_S2, 1.0)
    axis_level = wp.cross(wp.normalize(gravity_level), wp.vec3(0.0, 0.0, 1.0))
    correction = axis_level * (trust * trust * wp.min(_TILT_GAIN * dt_s, 1.0))
    bias_frd = est.gyro_bias_frd - wp.quat_rotate_inv(est.q_level_from_frd, correction) * _BIAS_GAIN
    est.gyro_bias_frd = clamp3(bias_frd, wp.vec3(_BIAS_LIMIT))
    est.q_level_from_frd = wp.normalize(quat_from_rotvec(correction) * est.q_level_from_frd)
    return est


@wp.func
def start_models(est: YawEstimator, vel_north: float, vel_east: float, vel_var: float) -> YawEstimator:
    """Five filters at headings a fifth of a turn apart, equally likely."""
    spacing = 2.0 * wp.pi / float(YAW_MODELS)
    for k in range(YAW_MODELS):
        est.yaw[k] = (float(k) + 0.5) * spacing - wp.pi
        est.vel_north[k] = vel_north
        est.vel_east[k] = vel_east
        est.p_nn[k] = vel_var
        est.p_ee[k] = vel_var
        est.p_yy[k] = 0.25 * spacing * spacing
        est.p_ne[k] = 0.0
        est.p_ny[k] = 0.0
        est.p_ey[k] = 0.0
        est.weight[k] = 1.0 / float(YAW_MODELS)
        est.innov_north[k] = 0.0
        est.innov_east[k] = 0.0
        est.ratio[k] = 2.0
    est.is_running = 1
    est.ratio_lpf = 1.0
    est.main_ratio_lpf = 1.0
    return est


@wp.func
def predict_model(est: YawEstimator, k: int) -> YawEstimator:
    """Filter k moved to the fix: velocity turned to ned with its heading, covariance F P F' + Q."""
    cos_yaw = wp.cos(est.yaw[k])
    sin_yaw = wp.sin(est.yaw[k])
    gained_north = cos_yaw * est.delta_vel_level[0] - sin_yaw * est.delta_vel_level[1]
    gained_east = sin_yaw * est.delta_vel_level[0] + cos_yaw * est.delta_vel_level[1]
    p_ny = est.p_ny[k]
    p_ey = est.p_ey[k]
    p_yy = est.p_yy[k]
    vel_var = _VEL_NSD * est.since_fix_s
    est.vel_north[k] = est.vel_north[k] + gained_north
    est.vel_east[k] = est.vel_east[k] + gained_east
    est.p_nn[k] = est.p_nn[k] - 2.0 * gained_east * p_ny + gained_east * gained_east * p_yy + vel_var
    est.p_ee[k] = est.p_ee[k] + 2.0 * gained_north * p_ey + gained_north * gained_north * p_yy + vel_var
    est.p_ne[k] = est.p_ne[k] + gained_north * p_ny - gained_east * p_ey - gained_north * gained_east * p_yy
    est.p_ny[k] = p_ny - gained_east * p_yy
    est.p_ey[k] = p_ey + gained_north * p_yy
    est.p_yy[k] = p_yy + _YAW_NSD * est.since_fix_s
    return est


@wp.func
def fuse_model(est: YawEstimator, k: int, vel_north: float, vel_east: float, obs_var: float) -> YawEstimator:
    """Filter k after a velocity, its weight multiplied by the likelihood of the innovation."""
    s_nn = est.p_nn[k] + obs_var
    s_ee = est.p_ee[k] + obs_var
    s_ne = est.p_ne[k]
    det = wp.max(s_nn * s_ee - s_ne * s_ne, 1.0e-9)
    north = vel_north - est.vel_north[k]
    east = vel_east - est.vel_east[k]
    est.innov_north[k] = north
    est.innov_east[k] = east
    ratio = (north * north * s_ee - 2.0 * north * east * s_ne + east * east * s_nn) / det
    est.ratio[k] = ratio
    if ratio > _MAX_RATIO:
        shortened = wp.sqrt(_MAX_RATIO / ratio)
        north = north * shortened
        east = east * shortened
        ratio = _MAX_RATIO
    est.weight[k] = est.weight[k] * wp.exp(-0.5 * ratio) / wp.sqrt(det)
    # K = P H' S^-1, row by row
    k_nn = (est.p_nn[k] * s_ee - est.p_ne[k] * s_ne) / det
    k_ne = (est.p_ne[k] * s_nn - est.p_nn[k] * s_ne) / det
    k_en = (est.p_ne[k] * s_ee - est.p_ee[k] * s_ne) / det
    k_ee = (est.p_ee[k] * s_nn - est.p_ne[k] * s_ne) / det
    k_yn = (est.p_ny[k] * s_ee - est.p_ey[k] * s_ne) / det
    k_ye = (est.p_ey[k] * s_nn - est.p_ny[k] * s_ne) / det
    est.vel_north[k] = est.vel_north[k] + k_nn * north + k_ne * east
    est.vel_east[k] = est.vel_east[k] + k_en * north + k_ee * east
    est.yaw[k] = wrap_pi(est.yaw[k] + k_yn * north + k_ye * east)
    p_nn = est.p_nn[k]
    p_ne = est.p_ne[k]
    p_ee = est.p_ee[k]
    p_ny = est.p_ny[k]
    p_ey = est.p_ey[k]
    est.p_yy[k] = wp.max(est.p_yy[k] - k_yn * p_ny - k_ye * p_ey, 1.0e-6)
    est.p_ny[k] = p_ny - k_nn * p_ny - k_ne * p_ey
    est.p_ey[k] = p_ey - k_en * p_ny - k_ee * p_ey
    est.p_nn[k] = wp.max(p_nn - k_nn * p_nn - k_ne * p_ne, 1.0e-6)
    est.p_ne[k] = p_ne - k_nn * p_ne - k_ne * p_ee
    est.p_ee[k] = wp.max(p_ee - k_en * p_ne - k_ee * p_ee, 1.0e-6)
    return est


@wp.func
def combine_models(est: YawEstimator) -> YawEstimator:
    """Weights that sum to 1, and heading and variance of the weighted sum of the five."""
    total = float(0.0)
    for k in range(YAW_MODELS):
        total += est.weight[k]
    floored = float(0.0)
    for k in range(YAW_MODELS):
        est.weight[k] = wp.max(est.weight[k] / wp.max(total, 1.0e-30), _MIN_WEIGHT)
        floored += est.weight[k]
    north = float(0.0)
    east = float(0.0)
    for k in range(YAW_MODELS):
        est.weight[k] = est.weight[k] / floored
        north += est.weight[k] * wp.cos(est.yaw[k])
        east += est.weight[k] * wp.sin(est.yaw[k])
    mean = wp.atan2(east, north)
    variance = float(0.0)
    ratio = float(0.0)
    for k in range(YAW_MODELS):
        apart = wrap_pi(est.yaw[k] - mean)
        variance += est.weight[k] * (est.p_yy[k] + apart * apart)
        ratio += est.weight[k] * est.ratio[k]
    est.yaw_level = mean
    est.yaw_var = variance
    est.ratio_lpf = est.ratio_lpf + wp.min(est.since_fix_s / RATIO_S, 1.0) * (0.5 * ratio - est.ratio_lpf)
    return est


@wp.func
def take_velocity(est: YawEstimator, time_us: wp.int64, vel_ned: wp.vec3, vel_std: float) -> YawEstimator:
    """The estimator after a GNSS velocity, to whose time the IMU samples have been summed."""
    est = turn_step(est)
    obs_var = vel_std * vel_std
    if est.is_running == 0 or est.since_fix_s > _MAX_FIX_GAP_S or est.since_fix_s <= 0.0:
        est = start_models(est, vel_ned[0], vel_ned[1], obs_var)
        est = combine_models(est)
    else:
        for k in range(YAW_MODELS):
            est = predict_model(est, k)
            est = fuse_model(est, k, vel_ned[0], vel_ned[1], obs_var)
        est = combine_models(est)
        est = correct_tilt(est, vel_ned - est.fix_vel_ned)
    est.running_s = est.running_s + est.since_fix_s
    est.fix_time_us = time_us
    est.fix_vel_ned = vel_ned
    est.delta_vel_level = wp.vec3()
    est.since_fix_s = 0.0
    return est


@wp.func
def estimated_yaw(est: YawEstimator) -> float:
    """[rad] heading of the vehicle by the yaw estimator."""
    return wrap_pi(est.yaw_level + yaw_from_quat(est.q_level_from_frd))
