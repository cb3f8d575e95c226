"""The delayed horizon: rings in which samples wait until the horizon passes them, and the output predictor.

Fusing at a horizon that lies behind the latest sensor lets every measurement meet the state of its own time. The
output predictor carries the state from the horizon to the newest IMU sample.
"""

import warp as wp

from autopilot.estimator.params import EstimatorParams
from autopilot.estimator.predict import delta_velocity_ned
from autopilot.estimator.state import IMU_RING, Inbox, Nominal, Output, OutputSample
from autopilot.ports import Estimate, ImuSample
from common.geodesy import GRAVITY_M_S2
from common.rotation import quat_from_rotvec

wp.set_module_options({"enable_backward": False})

MAX_AGE_S = wp.constant(0.3)  # a sample later than that behind the horizon is too old to be carried forward
_MAX_STEPS = wp.constant(3)  # horizon steps per tick: catches up after a gap
_MIN_DT_S = wp.constant(1.0e-4)
_MAX_DT_S = wp.constant(0.1)  # a longer gap in a log would be integrated with a rate that is no longer true
_MAX_STEP_S = wp.constant(0.5)  # a longer silence says nothing about repeats
_TAU_ATT_S = wp.constant(0.1)  # guess: short against the controller's attitude loop seen by it as a disturbance


@wp.func
def bounded_sample(imu: ImuSample) -> ImuSample:
    """The sample with a usable interval."""
    imu.dt_s = wp.clamp(imu.dt_s, _MIN_DT_S, _MAX_DT_S)
    return imu


@wp.func
def is_number(imu: ImuSample) -> bool:
    """Nothing in the sample is NaN or infinite."""
    return wp.isfinite(imu.gyro_frd) and wp.isfinite(imu.accel_frd) and wp.isfinite(imu.dt_s)


@wp.func
def receive(
    inbox: Inbox,
    time_us: wp.int64,
    ring_size: int,
    is_repeat: bool,
    is_still: bool,
    rate: wp.vec3,
    stuck_after: int,
    stuck_moved: float,
) -> Inbox:
    """The inbox after a new sample, which the caller puts into slot `head % ring_size` first.

    Equal values in a row mean stuck in a sensor that showed its noise at rest. In one that did not (its resolution is
    coarser than its noise, or it was not at rest since power-on) they mean stuck once the vehicle has moved on.

    Args:
        inbox: of the sensor.
        time_us: of the sample.
        ring_size: slots; the oldest waiting sample is dropped when all are taken.
        is_repeat: the sample repeats the value of the one before.
        is_still: the vehicle stands still.
        rate: per second, at which what the sensor sees now changes by the estimate.
        stuck_after: equal values in a row that may mean stuck; a stuck sensor's waiting samples are dropped.
        stuck_moved: integral of `rate` within which no sensor of use repeats its value.
    """
    step_s = wp.clamp(float(time_us - inbox.arrived_time_us) * 1.0e-6, 0.0, _MAX_STEP_S)
    inbox.arrived_time_us = time_us
    inbox.head += 1
    if inbox.head - inbox.tail > ring_size:
        inbox.tail = inbox.head - ring_size
    if is_repeat:
        inbox.repeat_count += 1
        inbox.change_count = 0
        inbox.moved = inbox.moved + rate * step_s
    else:
        inbox.repeat_count = 0
        inbox.change_count += 1
        inbox.moved = wp.vec3()
        inbox.is_stuck = 0
    if not is_still:
        inbox.change_count = 0
    if inbox.change_count >= stuck_after:
        inbox.resolves_noise = 1
    has_moved = wp.length(inbox.moved) > stuck_moved
    if inbox.repeat_count + 1 >= stuck_after and not is_still and (inbox.resolves_noise == 1 or has_moved):
        inbox.is_stuck = 1
    if inbox.is_stuck == 1:
        inbox.tail = inbox.head
    return inbox


@wp.func
def is_waiting(inbox: Inbox) -> bool:
    """At least one sample waits."""
    return inbox.tail < inbox.head


@wp.func
def due_count(imu_ring: wp.array2d(dtype=ImuSample), i: int, head: int, tail: int, horizon_time_us: wp.int64) -> int:
    """IMU samples that the horizon has reached, at most _MAX_STEPS."""
    count = int(0)
    for k in range(_MAX_STEPS):
        if count == k and tail + k < head:
            if imu_ring[i, (tail + k) % IMU_RING].time_us <= horizon_time_us:
                count = k + 1
    return count


@wp.func
def output_attitude(output: Output) -> wp.quat:
    """Attitude at the newest IMU sample."""
    return wp.normalize(output.q_correction * output.q_raw)


@wp.func
def integrate_output(output: Output, nominal: Nominal, imu: ImuSample) -> Output:
    """The integrals after the newest IMU sample, with the biases as now known."""
    delta_angle_frd = (imu.gyro_frd - nominal.gyro_bias_frd) * imu.dt_s
    delta_vel_frd = (imu.accel_frd - nominal.accel_bias_frd) * imu.dt_s
    delta_vel_ned = delta_velocity_ned(output_attitude(output), delta_angle_frd, delta_vel_frd)
    vel_before_ned = output.vel_raw_ned
    output.vel_raw_ned = vel_before_ned + delta_vel_ned + wp.vec3(0.0, 0.0, GRAVITY_M_S2 * imu.dt_s)
    mean_vel_ned = 0.5 * (vel_before_ned + output.vel_raw_ned) + output.vel_correction_ned
    output.pos_raw_ned = output.pos_raw_ned + mean_vel_ned * imu.dt_s
    output.q_raw = wp.normalize(output.q_raw * quat_from_rotvec(delta_angle_frd))
    return output


@wp.func
def correct_output(
    params: EstimatorParams, output: Output, at_horizon: OutputSample, nominal: Nominal, dt_s: float
) -> Output:
    """The corrections after they moved towards the state at the horizon, with the time constants of the parameters."""
    q_then = output.q_correction * at_horizon.q_raw
    q_error = nominal.q_ned_from_frd * wp.quat_inverse(q_then)
    sign = 2.0
    if q_error[3] < 0.0:
        sign = -2.0
    # twice the vector part is the rotation vector to third order; resets do not pass through here
    att_error_ned = wp.vec3(q_error[0], q_error[1], q_error[2]) * sign
    step = att_error_ned * wp.min(dt_s / _TAU_ATT_S, 1.0)
    output.q_correction = wp.normalize(quat_from_rotvec(step) * output.q_correction)
    vel_error_ned = nominal.vel_ned - (at_horizon.vel_raw_ned + output.vel_correction_ned)
    pos_error_ned = nominal.pos_ned - (at_horizon.pos_raw_ned + output.pos_correction_ned)
    output.vel_correction_ned = output.vel_correction_ned + vel_error_ned * wp.min(dt_s / params.tau_vel_s, 1.0)
    output.pos_correction_ned = output.pos_correction_ned + pos_error_ned * wp.min(dt_s / params.tau_pos_s, 1.0)
    return output


@wp.func
def jump_output(output: Output, nominal: Nominal) -> Output:
    """The corrections after a reset of the nominal state: the output jumps with it."""
    output.pos_correction_ned = output.pos_correction_ned + nominal.pos_jump_ned
    output.vel_correction_ned = output.vel_correction_ned + nominal.vel_jump_ned
    yaw = quat_from_rotvec(wp.vec3(0.0, 0.0, nominal.yaw_jump))
    output.q_correction = wp.normalize(yaw * output.q_correction)
    return output


@wp.func
def start_output(nominal: Nominal) -> Output:
    """An output predictor that agrees with the nominal state."""
    output = Output()
    output.q_raw = nominal.q_ned_from_frd
    output.vel_raw_ned = nominal.vel_ned
    output.pos_raw_ned = nominal.pos_ned
    output.q_correction = wp.quat_identity()
    return output


@wp.func
def output_sample(output: Output) -> OutputSample:
    """The raw integrals, for the ring."""
    sample = OutputSample()
    sample.q_raw = output.q_raw
    sample.vel_raw_ned = output.vel_raw_ned
    sample.pos_raw_ned = output.pos_raw_ned
    return sample


@wp.func
def with_jump(estimate: Estimate, nominal: Nominal) -> Estimate:
    """The estimate with the jumps of the latest reset."""
    estimate.pos_reset_ned = nominal.pos_jump_ned
    estimate.vel_reset_ned = nominal.vel_jump_ned
    estimate.yaw_reset = nominal.yaw_jump
    return estimate


@wp.func
def predicted_estimate(estimate: Estimate, nominal: Nominal, output: Output, imu: ImuSample) -> Estimate:
    """The estimate at the newest IMU sample; flags, deviations and jumps stay."""
    estimate.time_us = imu.time_us
    estimate.omega_frd = imu.gyro_frd - nominal.gyro_bias_frd
    estimate.accel_frd = imu.accel_frd - nominal.accel_bias_frd
    estimate.q_ned_from_frd = output_attitude(output)
    estimate.vel_ned = output.vel_raw_ned + output.vel_correction_ned
    estimate.pos_ned = output.pos_raw_ned + output.pos_correction_ned
    gravity_ned = wp.vec3(0.0, 0.0, GRAVITY_M_S2)
    estimate.accel_ned = wp.quat_rotate(estimate.q_ned_from_frd, estimate.accel_frd) + gravity_ned
    estimate.gyro_bias_frd = nominal.gyro_bias_frd
    estimate.accel_bias_frd = nominal.accel_bias_frd
    estimate.wind_ned = nominal.wind_ned
    estimate.terrain_d = nominal.terrain_d
    estimate.reset_count = nominal.reset_count
    return estimate


@wp.func
def raw_estimate(imu: ImuSample) -> Estimate:
    """What is known before alignment: the IMU itself."""
    estimate = Estimate()
    estimate.time_us = imu.time_us
    estimate.omega_frd = imu.gyro_frd
    estimate.accel_frd = imu.accel_frd
    estimate.q_ned_from_frd = wp.quat_identity()
    return estimate
