"""The estimator: an error-state Kalman filter (Solà 2017, "Quaternion kinematics for the error-state Kalman filter").

In: the newest samples, each tick. Out: `EstimatorState.estimate`, predicted to the newest IMU sample, at 250 Hz.
Inside: samples wait until the horizon, EKF2_DELAY_MAX behind, has passed their time; the filter runs there; the output
predictor carries its state to now. `estimator_step` is the whole filter in time order.
"""

from typing import Any

import warp as wp

from autopilot.estimator.airspeed import checked, with_airspeed
from autopilot.estimator.align import aligned_nominal, average, is_aligned
from autopilot.estimator.calibration import calibrated
from autopilot.estimator.delay import (
    bounded_sample,
    correct_output,
    due_count,
    integrate_output,
    is_number,
    is_waiting,
    jump_output,
    output_sample,
    predicted_estimate,
    raw_estimate,
    start_output,
    with_jump,
)
from autopilot.estimator.generated import predict_covariance
from autopilot.estimator.health import (
    DOUBTED_ACCEL_NSD,
    flags,
    is_doubted,
    is_sound,
    with_deviations,
    with_doubt,
)
from autopilot.estimator.params import EstimatorParams, estimator_params
from autopilot.estimator.predict import MANOEUVRE_ACCEL_NSD, manoeuvre_level, predict_nominal, process_variance
from autopilot.estimator.sensors import (
    FUSED_SENSORS,
    drop_waiting,
    listen_sensors,
    receive_samples,
    take_samples,
    without_nan,
)
from autopilot.estimator.sources.baro import start_baro
from autopilot.estimator.sources.drag import drag_is_due, take_drag
from autopilot.estimator.sources.external import listen_external, receive_external, take_external
from autopilot.estimator.sources.rest import observe_stillness, take_rest
from autopilot.estimator.state import (
    COV_ROWS,
    EXTERNAL_RING,
    IMU_RING,
    PHASE_ALIGNING,
    PHASE_RUNNING,
    VEL,
    Alignment,
    Ekf,
    EstimatorState,
    OutputSample,
    YawEstimator,
)
from autopilot.estimator.yaw_estimator import start_tilt, sum_imu
from autopilot.ports import (
    ExternalSample,
    ImuSample,
    Samples,
)
from common.geodesy import GRAVITY_M_S2
from common.kernels import vec24
from common.warp_start import start_warp

wp.set_module_options({"enable_backward": False})

SOUNDNESS_SAMPLES = wp.constant(256)  # the covariance is looked over once a second; at once if the state is no number
WATCH_SAMPLES = wp.constant(4)  # flags and deviations are renewed at 62 Hz
COUNTED_SAMPLES = wp.constant(1 << 30)  # 50 days; counted anew then: a multiple of the ring and of the three above


@wp.func
def predict(ekf: Ekf, i: int, params: EstimatorParams, imu: ImuSample) -> None:
    """Moves the nominal state by one IMU sample, and the covariance when enough of them have come together."""
    vel_before_ned = ekf.rows[i].nominal.vel_ned
    nominal = predict_nominal(ekf.rows[i].nominal, imu)
    nominal.pos_jump_ned = wp.vec3()
    nominal.vel_jump_ned = wp.vec3()
    nominal.yaw_jump = 0.0
    gravity_ned = wp.vec3(0.0, 0.0, GRAVITY_M_S2 * imu.dt_s)
    delta_vel_ned = ekf.rows[i].step_delta_vel_ned + nominal.vel_ned - vel_before_ned - gravity_ned
    delta_angle_frd = ekf.rows[i].step_delta_angle_frd + (imu.gyro_frd - nominal.gyro_bias_frd) * imu.dt_s
    step_s = ekf.rows[i].step_dt_s + imu.dt_s
    if step_s > params.predict_s - 0.5 * imu.dt_s:
        added_var = process_variance(params, ekf.covariance, i, nominal.vel_ned, step_s)
        force, rate = wp.length(delta_vel_ned) / step_s, wp.length(delta_angle_frd) / step_s
        level = manoeuvre_level(params, ekf.rows[i].manoeuvre_level, force, rate, step_s)
        ekf.rows[i].manoeuvre_level = level
        nominal.holds_accel_bias = 0
        unknown_nsd = float(0.0)
        if is_doubted(ekf.rows[i]):
            unknown_nsd = DOUBTED_ACCEL_NSD
        elif level > 1.0:
            nominal.holds_accel_bias = 1
            unknown_nsd = MANOEUVRE_ACCEL_NSD * level * level
        for axis in range(3):
            added_var[VEL + axis] = added_var[VEL + axis] + unknown_nsd * step_s
        rot = wp.quat_to_matrix(nominal.q_ned_from_frd)
        predict_covariance(ekf.covariance, i, rot, delta_vel_ned, step_s, added_var)
        step_s = 0.0
        delta_vel_ned = wp.vec3()
        delta_angle_frd = wp.vec3()
    ekf.rows[i].nominal = nominal
    ekf.rows[i].step_delta_vel_ned = delta_vel_ned
    ekf.rows[i].step_delta_angle_frd = delta_angle_frd
    ekf.rows[i].step_dt_s = step_s
    ekf.rows[i].drag_sum.accel_frd += imu.accel_frd * imu.dt_s
    ekf.rows[i].drag_sum.time_s += imu.dt_s


@wp.func
def horizon_step(ekf: Ekf, i: int, params: EstimatorParams) -> None:
    """Moves the horizon by one IMU sample and fuses what it passes."""
    slot = ekf.rows[i].imu_tail % IMU_RING
    imu = ekf.imu_ring[i, slot]
    now_us = imu.time_us
    ekf.rows[i].imu_tail += 1
    ekf.rows[i].horizon_time_us = now_us
    if ekf.rows[i].phase != PHASE_RUNNING:
        return
    lenient = with_doubt(params, is_doubted(ekf.rows[i]))
    resets_before = ekf.rows[i].nominal.reset_count
    predict(ekf, i, lenient, imu)
    sum_imu(ekf, i, imu)
    take_samples(ekf, i, lenient, now_us, imu.gyro_frd)
    if is_waiting(ekf.rows[i].external_inbox):
        take_external(ekf, i, lenient, now_us)
    if params.drag_ctrl > 0 and drag_is_due(ekf.rows[i].drag_sum):
        take_drag(ekf, i, lenient, now_us)
    if ekf.rows[i].stillness.is_still == 1:
        take_rest(ekf, i, lenient, now_us)
    if ekf.rows[i].stillness.still_s == 0.0:
        ekf.yaw[i].has_moved = 1
    has_jumped = wp.length(ekf.rows[i].nominal.pos_jump_ned) > 0.0  # by the first fix, too, which is no reset
    if ekf.rows[i].nominal.reset_count != resets_before or has_jumped:
        ekf.rows[i].output = jump_output(ekf.rows[i].output, ekf.rows[i].nominal)
        ekf.rows[i].estimate = with_jump(ekf.rows[i].estimate, ekf.rows[i].nominal)
    ekf.rows[i].output = correct_output(
        params, ekf.rows[i].output, ekf.output_ring[i, slot], ekf.rows[i].nominal, imu.dt_s
    )


@wp.func
def watch(ekf: Ekf, i: int, params: EstimatorParams) -> None:
    """Switches silent and frozen sources off, renews flags and deviations, and mends a broken covariance."""
    now_us = ekf.rows[i].horizon_time_us
    listen_sensors(ekf, i, now_us)
    if ekf.rows[i].external_inbox.head > 0:
        listen_external(ekf, i, now_us)
    is_lost = not (wp.isfinite(ekf.rows[i].nominal.pos_ned) and wp.isfinite(ekf.rows[i].nominal.vel_ned))
    if is_lost or ekf.rows[i].imu_tail % SOUNDNESS_SAMPLES == 0:
        if not is_sound(ekf.covariance, i, ekf.rows[i].nominal):
            ekf.rows[i].fault_count += 1
            ekf.rows[i].phase = PHASE_ALIGNING
            ekf.rows[i].alignment = Alignment()
    ekf.rows[i].estimate = with_deviations(ekf.covariance, i, ekf.rows[i].estimate)
    ekf.rows[i].estimate.flags = flags(params, ekf.covariance, i, ekf.rows[i])


@wp.func
def align(ekf: Ekf, i: int, params: EstimatorParams, imu: ImuSample, samples: Samples) -> None:
    """Averages until the first attitude is known; what waits in the rings then is older and is dropped."""
    ekf.rows[i].alignment = average(ekf.rows[i].alignment, ekf.rows[i].stillness, imu, samples)
    alignment = ekf.rows[i].alignment
    if not is_aligned(alignment):
        return
    nominal = aligned_nominal(params, ekf.covariance, i, alignment)
    ekf.rows[i].phase = PHASE_RUNNING
    ekf.rows[i].is_yaw_aligned = nominal.reset_count  # 1 if the magnetometer set heading
    nominal.reset_count = ekf.rows[i].nominal.reset_count
    ekf.rows[i].wander_time_us = wp.int64(0)
    ekf.rows[i].manoeuvre_level = 0.0
    if alignment.baro_count > 0:
        count = float(alignment.baro_count)
        height_var = params.baro_noise * params.baro_noise / count
        nominal, origin_height = start_baro(ekf.covariance, i, nominal, alignment.baro_height / count, height_var)
        ekf.rows[i].origin_baro_height = origin_height
        ekf.rows[i].baro.is_active = 1
        ekf.rows[i].baro.judged_time_us = imu.time_us
    ekf.rows[i].nominal = nominal
    ekf.yaw[i] = start_tilt(YawEstimator(), nominal.q_ned_from_frd, nominal.gyro_bias_frd)
    output = start_output(nominal)
    ekf.rows[i].output = output
    for k in range(IMU_RING):
        ekf.output_ring[i, k] = output_sample(output)
    drop_waiting(ekf, i)
    ekf.rows[i].external_inbox.tail = ekf.rows[i].external_inbox.head


@wp.func
def estimator_step(ekf: Ekf, i: int, samples: Samples, contact: int) -> None:
    """One tick of vehicle i, on its row in place: nothing happens without a new IMU sample that is a number.

    Args:
        ekf: of all vehicles.
        i: the vehicle.
        samples: the newest of each sensor.
        contact: CONTACT_*: what the commander says.
    """
    if samples.imu.time_us == ekf.rows[i].time_us or not is_number(samples.imu):
        return
    params = ekf.params[i]
    clean = without_nan(ekf, i, calibrated(params, samples))
    imu = bounded_sample(clean.imu)
    if ekf.rows[i].imu_tail >= COUNTED_SAMPLES:
        ekf.rows[i].imu_head -= COUNTED_SAMPLES
        ekf.rows[i].imu_tail -= COUNTED_SAMPLES
    slot = ekf.rows[i].imu_head % IMU_RING
    ekf.imu_ring[i, slot] = imu
    ekf.rows[i].imu_head += 1
    ekf.rows[i].imu_tail = wp.max(ekf.rows[i].imu_tail, ekf.rows[i].imu_head - IMU_RING)
    ekf.rows[i].time_us = imu.time_us
    clean.imu = imu
    observe_stillness(ekf, i, params, clean, contact)
    receive_samples(ekf, i, clean)
    if ekf.external[i].time_us != ekf.rows[i].external_inbox.arrived_time_us:
        receive_external(ekf, i)
    if ekf.rows[i].phase == PHASE_ALIGNING:
        align(ekf, i, params, imu, clean)
    else:
        ekf.rows[i].output = integrate_output(ekf.rows[i].output, ekf.rows[i].nominal, imu)
        ekf.output_ring[i, slot] = output_sample(ekf.rows[i].output)
    horizon_us = imu.time_us - wp.int64(params.delay_s * 1.0e6)
    for _ in range(due_count(ekf.imu_ring, i, ekf.rows[i].imu_head, ekf.rows[i].imu_tail, horizon_us)):
        horizon_step(ekf, i, params)
    if ekf.rows[i].phase == PHASE_RUNNING:
        if ekf.rows[i].imu_head % WATCH_SAMPLES == 0:
            watch(ekf, i, params)
        ekf.rows[i].estimate = predicted_estimate(ekf.rows[i].estimate, ekf.rows[i].nominal, ekf.rows[i].output, imu)
    else:
        ekf.rows[i].estimate = raw_estimate(imu)
    if samples.airspeed.time_us != wp.int64(0):
        height_m = ekf.rows[i].origin_baro_height - ekf.rows[i].estimate.pos_ned[2]
        ekf.rows[i].airspeed = checked(
            params, ekf.rows[i].airspeed, ekf.rows[i].estimate, samples.airspeed, contact, height_m
        )
        ekf.rows[i].estimate = with_airspeed(ekf.rows[i].estimate, ekf.rows[i].airspeed, samples.airspeed)


@wp.func
def at_boot(ekf: Ekf, i: int) -> EstimatorState:
    """The state at power-on of vehicle i; its covariance is set by the alignment that follows."""
    state = EstimatorState()
    state.nominal.q_ned_from_frd = wp.quat_identity()
    state.output.q_raw = wp.quat_identity()
    state.output.q_correction = wp.quat_identity()
    state.estimate.q_ned_from_frd = wp.quat_identity()
    zero = vec24()
    for r in range(COV_ROWS):
        ekf.covariance[i, r] = zero
    return state


@wp.func
def estimator_reset(ekf: Ekf, i: int) -> None:
    """Powers the estimator of vehicle i on anew."""
    ekf.rows[i] = at_boot(ekf, i)
    ekf.yaw[i] = YawEstimator()
    ekf.external[i] = ExternalSample()


@wp.kernel(enable_backward=False)
def reset_rows(ekf: Ekf) -> None:
    estimator_reset(ekf, wp.tid())


def make_ekf(vehicle_count: int, device: str = "cpu", params: Any = None) -> Ekf:
    """Estimators of `vehicle_count` vehicles at power-on.

    Args:
        vehicle_count: rows of every array.
        device: a Warp device.
        params: one `EstimatorParams` for all rows; None gives the defaults without a world magnetic field.
    """
    start_warp()
    row = params if params is not None else estimator_params()
    ekf = Ekf()
    ekf.rows = wp.zeros(vehicle_count, dtype=EstimatorState, device=device)
    ekf.yaw = wp.zeros(vehicle_count, dtype=YawEstimator, device=device)
    ekf.params = wp.array([row] * vehicle_count, dtype=EstimatorParams, device=device)
    ekf.covariance = wp.zeros((vehicle_count, COV_ROWS), dtype=vec24, device=device)
    ekf.imu_ring = wp.zeros((vehicle_count, IMU_RING), dtype=ImuSample, device=device)
    ekf.output_ring = wp.zeros((vehicle_count, IMU_RING), dtype=OutputSample, device=device)
    for sensor in FUSED_SENSORS:
        ring = wp.zeros((vehicle_count, sensor.ring_size), dtype=sensor.Sample, device=device)
        setattr(ekf, f"{sensor.name}_ring", ring)
    ekf.external = wp.zeros(vehicle_count, dtype=ExternalSample, device=device)
    ekf.external_ring = wp.zeros((vehicle_count, EXTERNAL_RING), dtype=ExternalSample, device=device)
    wp.launch(reset_rows, dim=vehicle_count, inputs=[ekf], device=device)
    return ekf
