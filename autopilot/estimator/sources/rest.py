"""Rest: while the IMU shows a vehicle that stands still, its velocity is zero.

Holds tilt and biases together from alignment until GNSS takes over, and again after landing. Stops with motion.
"""

import warp as wp

from autopilot.estimator.fuse import fuse_state, judge, mark_fused, seconds_since
from autopilot.estimator.params import EstimatorParams
from autopilot.estimator.state import VEL, Aid, Ekf, Nominal, Stillness
from autopilot.ports import ImuSample
from common.kernels import GRAVITY_M_S2, vec24

wp.set_module_options({"enable_backward": False})

_STD = wp.constant(0.1)  # [m/s]
_GATE_SIGMA = wp.constant(5.0)
_PERIOD_S = wp.constant(0.0399)
_MAX_SPEED = wp.constant(0.5)  # [m/s] faster by its own estimate: a smooth cruise, not rest
_AVERAGE_S = wp.constant(0.1)  # time constant of the running means
_STILL_AFTER_S = wp.constant(0.4)
# guess: between a BMI088 at rest (gyro 0.005 rad/s, accelerometer 0.05 m/s², three axes) and a hovering airframe
_MAX_GYRO_VAR = wp.constant(4.0e-4)  # [(rad/s)²]
_MAX_ACCEL_VAR = wp.constant(0.02)  # [(m/s²)²]
_MAX_RATE = wp.constant(0.05)  # [rad/s] bias included
_MAX_GRAVITY_ERROR = wp.constant(0.5)  # [m/s²]


@wp.func
def observe_stillness(still: Stillness, imu: ImuSample) -> Stillness:
    """Running means and variances of the IMU, and what they say."""
    if wp.length_sq(still.accel_mean_frd) == 0.0:
        still.gyro_mean_frd = imu.gyro_frd
        still.accel_mean_frd = imu.accel_frd
    gain = wp.min(imu.dt_s / _AVERAGE_S, 1.0)
    gyro_change = imu.gyro_frd - still.gyro_mean_frd
    accel_change = imu.accel_frd - still.accel_mean_frd
    still.gyro_mean_frd = still.gyro_mean_frd + gain * gyro_change
    still.accel_mean_frd = still.accel_mean_frd + gain * accel_change
    still.gyro_var = still.gyro_var + gain * (wp.length_sq(gyro_change) - still.gyro_var)
    still.accel_var = still.accel_var + gain * (wp.length_sq(accel_change) - still.accel_var)
    is_quiet = (
        still.gyro_var < _MAX_GYRO_VAR
        and still.accel_var < _MAX_ACCEL_VAR
        and wp.length_sq(still.gyro_mean_frd) < _MAX_RATE * _MAX_RATE
        and wp.abs(wp.length(still.accel_mean_frd) - GRAVITY_M_S2) < _MAX_GRAVITY_ERROR
    )
    if is_quiet:
        still.still_s = still.still_s + imu.dt_s
    else:
        still.still_s = 0.0
    still.is_still = 0
    if still.still_s > _STILL_AFTER_S:
        still.is_still = 1
    return still


@wp.func
def rest_is_due(aid: Aid, nominal: Nominal, time_us: wp.int64) -> bool:
    """The estimate does not speak against rest, and the last zero-velocity update is a while ago."""
    return (
        wp.length_sq(nominal.vel_ned) < _MAX_SPEED * _MAX_SPEED
        and seconds_since(time_us, aid.judged_time_us) > _PERIOD_S
    )


@wp.func
def fuse_rest(
    params: EstimatorParams, cov: wp.array2d(dtype=vec24), i: int, nominal: Nominal, aid: Aid, time_us: wp.int64
) -> tuple[Nominal, Aid]:
    """Zero velocity in three axes."""
    var = _STD * _STD
    innov = -nominal.vel_ned
    innov_var = wp.vec3(cov[i, VEL][VEL] + var, cov[i, VEL + 1][VEL + 1] + var, cov[i, VEL + 2][VEL + 2] + var)
    aid = judge(aid, time_us, innov, innov_var, 3, _GATE_SIGMA)
    aid.is_active = 1
    if aid.test_ratio <= 1.0:
        for axis in range(3):
            nominal = fuse_state(params, cov, i, nominal, VEL + axis, -nominal.vel_ned[axis], var)
        aid = mark_fused(aid)
    return nominal, aid


@wp.func
def take_rest(ekf: Ekf, i: int, params: EstimatorParams, now_us: wp.int64) -> None:
    """Fuses zero velocity if the vehicle stands still."""
    if rest_is_due(ekf.rows[i].rest, ekf.rows[i].nominal, now_us):
        nominal, aid = fuse_rest(params, ekf.covariance, i, ekf.rows[i].nominal, ekf.rows[i].rest, now_us)
        ekf.rows[i].nominal = nominal
        ekf.rows[i].rest = aid
