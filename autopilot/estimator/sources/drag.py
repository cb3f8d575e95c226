"""Drag: the specific force across the thrust axis of what hovers is air drag, and so observes the wind.

In: specific force averaged over 40 ms. Model: -(m u + rho / (2 b) |u| u) along body x and y, u the speed through air
(PX4 names: m propeller drag EKF2_MCOEF, b ballistic coefficient EKF2_BCOEF_X, _Y). Only wind is corrected, unless
EKF2_DRAG_CTRL is 2 and nothing else measures velocity. Runs in the air only.
"""

import warp as wp

from autopilot.estimator.fuse import fuse, fuse_part, judge, mark_fused, seconds_since
from autopilot.estimator.generated import drag_products
from autopilot.estimator.health import DEAD_RECKONING_AFTER_S
from autopilot.estimator.params import EstimatorParams
from autopilot.estimator.sources.mag import body_axis_ned
from autopilot.estimator.state import WIND, Aid, DragSum, Ekf, Nominal
from common.kernels import vec24

wp.set_module_options({"enable_backward": False})

_PERIOD_S = wp.constant(0.0399)  # ten samples of 4 ms
_AIR_DENSITY = wp.constant(1.225)  # kg/m³, ISO 2533 sea level
_GATE_SIGMA = wp.constant(5.0)
_AIRBORNE_HEIGHT_M = wp.constant(1.0)  # above the last place of rest
_AIRBORNE_SPEED = wp.constant(2.0)  # [m/s]


@wp.func
def drag_is_due(drag: DragSum) -> bool:
    """An average is complete."""
    return drag.time_s > _PERIOD_S


@wp.func
def is_airborne(drag: DragSum, nominal: Nominal) -> bool:
    """The vehicle has left the position where it last stood still."""
    return (
        nominal.pos_ned[2] < drag.ground_d - _AIRBORNE_HEIGHT_M
        or wp.length_sq(nominal.vel_ned) > _AIRBORNE_SPEED * _AIRBORNE_SPEED
    )


@wp.func
def fuse_drag(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    aid: Aid,
    drag: DragSum,
    time_us: wp.int64,
    corrects_velocity: bool,
) -> tuple[Nominal, Aid]:
    """Body x and y, which pass or fail together."""
    var = params.drag_noise * params.drag_noise
    accel_frd = drag.accel_frd / drag.time_s
    rot = wp.quat_to_matrix(nominal.q_ned_from_frd)
    innov = wp.vec3()
    innov_var = wp.vec3(1.0, 1.0, 1.0)
    for axis in range(2):
        square = drag_square(params, axis)
        axis_ned = body_axis_ned(rot, axis)
        vel_air_ned = nominal.vel_ned - nominal.wind_ned
        speed = wp.dot(axis_ned, vel_air_ned)
        predicted = nominal.accel_bias_frd[axis] - (params.drag_linear + square * wp.abs(speed)) * speed
        _ph, _ph_slow, hph = drag_products(
            cov, i, axis_ned, axis, vel_air_ned, params.drag_linear, square, wp.abs(speed)
        )
        innov[axis] = accel_frd[axis] - predicted
        innov_var[axis] = hph + var
    aid = judge(aid, time_us, innov, innov_var, 2, _GATE_SIGMA)
    aid.is_active = 1
    if aid.test_ratio <= 1.0:
        for axis in range(2):
            square = drag_square(params, axis)
            axis_ned = body_axis_ned(wp.quat_to_matrix(nominal.q_ned_from_frd), axis)
            vel_air_ned = nominal.vel_ned - nominal.wind_ned
            speed = wp.dot(axis_ned, vel_air_ned)
            ph, ph_slow, hph = drag_products(
                cov, i, axis_ned, axis, vel_air_ned, params.drag_linear, square, wp.abs(speed)
            )
            predicted = nominal.accel_bias_frd[axis] - (params.drag_linear + square * wp.abs(speed)) * speed
            axis_innov = accel_frd[axis] - predicted
            if corrects_velocity:
                nominal = fuse(params, cov, i, nominal, ph, ph_slow, axis_innov, hph + var)
            else:
                nominal = fuse_part(params, cov, i, nominal, ph, ph_slow, axis_innov, hph + var, WIND, 2)
        aid = mark_fused(aid)
    return nominal, aid


@wp.func
def drag_square(params: EstimatorParams, axis: int) -> float:
    """[1/m] factor of |u| u along body x (0) or y (1)."""
    ballistic = params.drag_ballistic_x
    if axis == 1:
        ballistic = params.drag_ballistic_y
    square = float(0.0)
    if ballistic > 1.0:
        square = 0.5 * _AIR_DENSITY / ballistic
    return square


@wp.func
def take_drag(ekf: Ekf, i: int, params: EstimatorParams, now_us: wp.int64) -> None:
    """Fuses the averaged specific force in the air, and starts the next average."""
    drag_sum = ekf.rows[i].drag_sum
    if ekf.rows[i].stillness.is_still == 1:
        drag_sum.ground_d = ekf.rows[i].nominal.pos_ned[2]
    if is_airborne(drag_sum, ekf.rows[i].nominal):
        is_starved = seconds_since(now_us, ekf.rows[i].gnss_vel.fused_time_us) > DEAD_RECKONING_AFTER_S
        if ekf.rows[i].external_pos.is_active == 1 or ekf.rows[i].external_vel.is_active == 1:
            is_starved = False
        corrects_velocity = params.drag_ctrl == 2 and is_starved
        nominal, aid = fuse_drag(
            params, ekf.covariance, i, ekf.rows[i].nominal, ekf.rows[i].drag, drag_sum, now_us, corrects_velocity
        )
        ekf.rows[i].nominal = nominal
        ekf.rows[i].drag = aid
    else:
        ekf.rows[i].drag.is_active = 0
    drag_sum.accel_frd = wp.vec3()
    drag_sum.time_s = 0.0
    ekf.rows[i].drag_sum = drag_sum
