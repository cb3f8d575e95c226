"""Calibration: what the drivers read, less the offsets measured at rest, turned into the vehicle's frame.

In: raw samples. Out: samples as the estimator uses them; at the rate of the samples. Offsets and the turn of the board
are parameters (CAL_*, SENS_BOARD_*), written by the calibrations of `commander/sensor_calibration.py` or by hand.
"""

import warp as wp

from autopilot.estimator.params import EstimatorParams
from autopilot.ports import Samples

wp.set_module_options({"enable_backward": False})


@wp.func
def board_attitude(params: EstimatorParams) -> wp.quat:
    """The turn from the board's frame to the vehicle's: yaw, pitch, roll."""
    x = wp.vec3(1.0, 0.0, 0.0)
    y = wp.vec3(0.0, 1.0, 0.0)
    z = wp.vec3(0.0, 0.0, 1.0)
    yaw = wp.quat_from_axis_angle(z, params.board_yaw)
    pitch = wp.quat_from_axis_angle(y, params.board_pitch)
    return yaw * pitch * wp.quat_from_axis_angle(x, params.board_roll)


@wp.func
def calibrated(params: EstimatorParams, samples: Samples) -> Samples:
    """The samples without what calibration has found."""
    clean = samples
    gyro = samples.imu.gyro_frd - wp.vec3(params.gyro_offset_x, params.gyro_offset_y, params.gyro_offset_z)
    accel = samples.imu.accel_frd - wp.vec3(params.accel_offset_x, params.accel_offset_y, params.accel_offset_z)
    field = samples.mag.field_frd_gauss - wp.vec3(params.mag_offset_x, params.mag_offset_y, params.mag_offset_z)
    if params.mag_yaw != 0.0:
        field = wp.quat_rotate(wp.quat_from_axis_angle(wp.vec3(0.0, 0.0, 1.0), params.mag_yaw), field)
    if params.board_roll != 0.0 or params.board_pitch != 0.0 or params.board_yaw != 0.0:
        turn = board_attitude(params)
        gyro = wp.quat_rotate(turn, gyro)
        accel = wp.quat_rotate(turn, accel)
        field = wp.quat_rotate(turn, field)
    clean.imu.gyro_frd = gyro
    clean.imu.accel_frd = accel
    clean.mag.field_frd_gauss = field
    return clean
