"""The fused sensors: their rows, and where their samples are received, fused at the horizon, and missed.

Adding one adds a row to `FUSED_SENSORS` and a line to each function below, which call its file in `sources`.
"""

from collections.abc import Container

import warp as wp

from autopilot.estimator.delay import is_waiting
from autopilot.estimator.health import listen
from autopilot.estimator.params import EstimatorParams
from autopilot.estimator.sensor_spec import SensorSpec
from autopilot.estimator.sources.baro import BARO, baro_time, receive_baro, take_baro
from autopilot.estimator.sources.gnss import GNSS, gnss_time, receive_gnss, take_gnss
from autopilot.estimator.sources.heading import take_heading
from autopilot.estimator.sources.heights import compare_heights
from autopilot.estimator.sources.mag import MAG, mag_time, receive_mag, take_mag
from autopilot.estimator.sources.range import RANGE, range_time, receive_range, take_range
from autopilot.estimator.sources.wheels import WHEELS, receive_wheels, take_wheels, wheels_time
from autopilot.estimator.state import Ekf
from autopilot.ports import Samples

wp.set_module_options({"enable_backward": False})

FUSED_SENSORS: tuple[SensorSpec, ...] = (GNSS, BARO, MAG, RANGE, WHEELS)

COMPARE_SAMPLES = wp.constant(64)  # heights are compared four times a second


def sensors_of(parameters: Container[str]) -> tuple[SensorSpec, ...]:
    """The fused sensors that a vehicle with these parameters has or may have."""
    return tuple(sensor for sensor in FUSED_SENSORS if not sensor.parameter or sensor.parameter in parameters)


@wp.func
def without_nan(ekf: Ekf, i: int, samples: Samples) -> Samples:
    """The samples; a new one of a slow sensor that is no number has not come: no filter would ever forget it."""
    samples.gnss.time_us = gnss_time(ekf.rows[i].gnss_inbox, samples.gnss)
    samples.baro.time_us = baro_time(ekf.rows[i].baro_inbox, samples.baro)
    samples.mag.time_us = mag_time(ekf.rows[i].mag_inbox, samples.mag)
    samples.range.time_us = range_time(ekf.rows[i].range_inbox, samples.range)
    samples.wheels.time_us = wheels_time(ekf.rows[i].wheels_inbox, samples.wheels)
    return samples


@wp.func
def receive_samples(ekf: Ekf, i: int, samples: Samples) -> None:
    """New samples of the slow sensors are put into their rings."""
    is_still = ekf.rows[i].stillness.is_still == 1
    vel_ned = ekf.rows[i].nominal.vel_ned
    omega_frd = samples.imu.gyro_frd - ekf.rows[i].nominal.gyro_bias_frd
    receive_gnss(ekf, i, samples.gnss, is_still, vel_ned)
    receive_baro(ekf, i, samples.baro, is_still, vel_ned)
    receive_mag(ekf, i, samples.mag, is_still, omega_frd)
    receive_range(ekf, i, samples.range, is_still, vel_ned)
    receive_wheels(ekf, i, samples.wheels, is_still)


@wp.func
def take_samples(ekf: Ekf, i: int, params: EstimatorParams, now_us: wp.int64, gyro_frd: wp.vec3) -> None:
    """Fuses the samples that the horizon passes."""
    if is_waiting(ekf.rows[i].gnss_inbox):
        take_heading(ekf, i, params, now_us)
        take_gnss(ekf, i, params, now_us)
    if is_waiting(ekf.rows[i].baro_inbox):
        take_baro(ekf, i, params, now_us)
    if ekf.rows[i].imu_tail % COMPARE_SAMPLES == 0:
        compare_heights(ekf, i, params)
    if is_waiting(ekf.rows[i].mag_inbox):
        take_mag(ekf, i, params, now_us, gyro_frd)
    if is_waiting(ekf.rows[i].range_inbox):
        take_range(ekf, i, params, now_us)
    if is_waiting(ekf.rows[i].wheels_inbox):
        take_wheels(ekf, i, params, now_us, gyro_frd)


@wp.func
def listen_sensors(ekf: Ekf, i: int, now_us: wp.int64) -> None:
    """Switches silent and frozen sensors off."""
    ekf.rows[i].gnss_pos = listen(ekf.rows[i].gnss_pos, ekf.rows[i].gnss_inbox, now_us)
    ekf.rows[i].gnss_vel = listen(ekf.rows[i].gnss_vel, ekf.rows[i].gnss_inbox, now_us)
    ekf.rows[i].gnss_height = listen(ekf.rows[i].gnss_height, ekf.rows[i].gnss_inbox, now_us)
    ekf.rows[i].baro = listen(ekf.rows[i].baro, ekf.rows[i].baro_inbox, now_us)
    ekf.rows[i].mag = listen(ekf.rows[i].mag, ekf.rows[i].mag_inbox, now_us)
    ekf.rows[i].range = listen(ekf.rows[i].range, ekf.rows[i].range_inbox, now_us)
    ekf.rows[i].wheels = listen(ekf.rows[i].wheels, ekf.rows[i].wheels_inbox, now_us)
    ekf.rows[i].wheel_side = listen(ekf.rows[i].wheel_side, ekf.rows[i].wheels_inbox, now_us)


@wp.func
def drop_waiting(ekf: Ekf, i: int) -> None:
    """Empties the rings."""
    ekf.rows[i].gnss_inbox.tail = ekf.rows[i].gnss_inbox.head
    ekf.rows[i].baro_inbox.tail = ekf.rows[i].baro_inbox.head
    ekf.rows[i].mag_inbox.tail = ekf.rows[i].mag_inbox.head
    ekf.rows[i].range_inbox.tail = ekf.rows[i].range_inbox.head
    ekf.rows[i].wheels_inbox.tail = ekf.rows[i].wheels_inbox.head
