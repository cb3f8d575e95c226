"""The estimator: an error-state Kalman filter (Solà 2017, "Quaternion kinematics for the error-state Kalman filter").

In: the newest samples, each tick. Out: `EstimatorState.estimate`, predicted to the newest IMU sample, at 250 Hz. Inside:
samples wait until the horizon, EKF2_DELAY_MAX behind, has passed their time; the filter runs there; the output
predictor carries its state to now. `estimator_tick` is the whole filter in time order.
"""

from typing import Any

import warp as wp

from autopilot.estimator.align import aligned_nominal, average, is_aligned, start_output
from autopilot.estimator.delay import (
    bounded_sample,
    correct_output,
    due_count,
    integrate_output,
    jump_output,
    output_attitude,
    receive,
)
from autopilot.estimator.fuse import seconds_since
from autopilot.estimator.generated import predict_covariance
from autopilot.estimator.health import flags, is_sound, lift_variances, listen, with_deviations
from autopilot.estimator.params import HEIGHT_REF_BARO, MAG_TYPE_NONE, EstimatorParams, estimator_params
from autopilot.estimator.predict import predict_nominal, process_variance
from autopilot.estimator.sources.baro import BARO_STUCK_AFTER, fuse_baro
from autopilot.estimator.sources.drag import drag_is_due, fuse_drag, is_airborne
from autopilot.estimator.sources.gnss import (
    GNSS_STUCK_AFTER,
    fuse_gnss_height,
    fuse_gnss_pos,
    fuse_gnss_vel,
    gnss_is_good,
    gnss_repeats,
    propagate_wander,
)
from autopilot.estimator.sources.mag import MAG_STUCK_AFTER, fuse_mag, start_mag
from autopilot.estimator.sources.range import RANGE_STUCK_AFTER, fuse_range
from autopilot.estimator.sources.rest import fuse_rest, observe_stillness, rest_is_due
from autopilot.estimator.state import (
    BARO_RING,
    GNSS_RING,
    IMU_RING,
    MAG_RING,
    PHASE_ALIGNING,
    PHASE_RUNNING,
    RANGE_RING,
    Ekf,
    EstimatorState,
    OutputSample,
)
from autopilot.ports import BaroSample, Estimate, GnssSample, ImuSample, MagSample, RangeSample, Samples
from common.kernels import ERROR_STATES, GRAVITY_M_S2, vec24

wp.set_module_options({"enable_backward": False})

_MAX_STEPS = wp.constant(4)  # horizon steps per tick: catches up after a gap
_MAX_AGE_S = wp.constant(0.3)  # a sample later than that behind the horizon is too old to be carried forward
_SOUNDNESS_SAMPLES = wp.constant(250)  # the covariance is looked over once a second


@wp.func
def receive_samples(ekf: Ekf, i: int, state: EstimatorState, samples: Samples) -> EstimatorState:
    """New samples of the slow sensors are put into their rings."""
    is_live = state.stillness.is_noise_free == 0
    if samples.gnss.time_us != state.gnss_inbox.arrived_time_us:
        head = state.gnss_inbox.head
        is_equal = head > 0 and gnss_repeats(samples.gnss, ekf.gnss_ring[i, (head + GNSS_RING - 1) % GNSS_RING])
        ekf.gnss_ring[i, head % GNSS_RING] = samples.gnss
        state.gnss_inbox = receive(
            state.gnss_inbox, samples.gnss.time_us, GNSS_RING, is_equal, is_live, GNSS_STUCK_AFTER
        )
    if samples.baro.time_us != state.baro_inbox.arrived_time_us:
        head = state.baro_inbox.head
        is_equal = head > 0 and (
            samples.baro.pressure_pa == ekf.baro_ring[i, (head + BARO_RING - 1) % BARO_RING].pressure_pa
        )
        ekf.baro_ring[i, head % BARO_RING] = samples.baro
        state.baro_inbox = receive(
            state.baro_inbox, samples.baro.time_us, BARO_RING, is_equal, is_live, BARO_STUCK_AFTER
        )
    if samples.mag.time_us != state.mag_inbox.arrived_time_us:
        head = state.mag_inbox.head
        is_equal = head > 0 and (
            samples.mag.field_frd_gauss == ekf.mag_ring[i, (head + MAG_RING - 1) % MAG_RING].field_frd_gauss
        )
        ekf.mag_ring[i, head % MAG_RING] = samples.mag
        state.mag_inbox = receive(state.mag_inbox, samples.mag.time_us, MAG_RING, is_equal, is_live, MAG_STUCK_AFTER)
    if samples.range.time_us != state.range_inbox.arrived_time_us:
        head = state.range_inbox.head
        previous = ekf.range_ring[i, (head + RANGE_RING - 1) % RANGE_RING]
        # out of range, a live sensor repeats its limit; at rest it may repeat its quantum
        is_equal = head > 0 and samples.range.distance_m == previous.distance_m and samples.range.is_valid == 1
        ekf.range_ring[i, head % RANGE_RING] = samples.range
        state.range_inbox = receive(
            state.range_inbox,
            samples.range.time_us,
            RANGE_RING,
            is_equal,
            is_live and state.stillness.is_still == 0,
            RANGE_STUCK_AFTER,
        )
    return state


@wp.func
def fuse_gnss_step(ekf: Ekf, i: int, params: EstimatorParams, state: EstimatorState) -> EstimatorState:
    """Takes the oldest waiting GNSS sample and fuses what it holds."""
    sample = ekf.gnss_ring[i, state.gnss_inbox.tail % GNSS_RING]
    state.gnss_inbox.tail += 1
    age_s = seconds_since(state.horizon_time_us, sample.time_us)
    if gnss_is_good(params, sample) and age_s < _MAX_AGE_S:
        wander = propagate_wander(params, state.gnss_wander, sample)
        if state.is_yaw_aligned == 1:
            nominal, aid = fuse_gnss_vel(params, ekf.covariance, i, state.nominal, state.gnss_vel, sample)
            state.gnss_vel = aid
            nominal, aid, wander = fuse_gnss_pos(
                params, ekf.covariance, i, nominal, state.gnss_pos, wander, sample, age_s
            )
            state.gnss_pos = aid
            state.nominal = nominal
        nominal, aid, wander = fuse_gnss_height(
            params,
            ekf.covariance,
            i,
            state.nominal,
            state.gnss_height,
            wander,
            sample,
            age_s,
            state.baro.is_active == 0,
        )
        state.nominal = nominal
        state.gnss_height = aid
        state.gnss_wander = wander
    return state


@wp.func
def fuse_baro_step(ekf: Ekf, i: int, params: EstimatorParams, state: EstimatorState) -> EstimatorState:
    """Takes the oldest waiting pressure and fuses it, unless GNSS height is the chosen reference and alive."""
    sample = ekf.baro_ring[i, state.baro_inbox.tail % BARO_RING]
    state.baro_inbox.tail += 1
    age_s = seconds_since(state.horizon_time_us, sample.time_us)
    is_gnss_height_good = state.gnss_height.is_active == 1 and state.gnss_height.test_ratio_lpf < 1.0
    is_wanted = params.height_ref == HEIGHT_REF_BARO or not is_gnss_height_good
    if params.baro_ctrl == 1 and is_wanted and age_s < _MAX_AGE_S:
        nominal, aid, origin_height = fuse_baro(
            params,
            ekf.covariance,
            i,
            state.nominal,
            state.baro,
            state.origin_baro_height,
            sample,
            age_s,
            is_gnss_height_good,
        )
        state.nominal = nominal
        state.baro = aid
        state.origin_baro_height = origin_height
    elif not is_wanted:
        state.baro.is_active = 0
    return state


@wp.func
def fuse_mag_step(
    ekf: Ekf, i: int, params: EstimatorParams, state: EstimatorState, gyro_frd: wp.vec3
) -> EstimatorState:
    """Takes the oldest waiting field and fuses it; the first one ever sets heading."""
    sample = ekf.mag_ring[i, state.mag_inbox.tail % MAG_RING]
    state.mag_inbox.tail += 1
    age_s = seconds_since(state.horizon_time_us, sample.time_us)
    if params.mag_type != MAG_TYPE_NONE and age_s < _MAX_AGE_S:
        if state.is_yaw_aligned == 0:
            state.nominal = start_mag(params, ekf.covariance, i, state.nominal, sample.field_frd_gauss)
            state.is_yaw_aligned = 1
        omega_frd = gyro_frd - state.nominal.gyro_bias_frd
        nominal, aid = fuse_mag(params, ekf.covariance, i, state.nominal, state.mag, sample, omega_frd, age_s)
        state.nominal = nominal
        state.mag = aid
    return state


@wp.func
def fuse_sources(ekf: Ekf, i: int, params: EstimatorParams, state: EstimatorState, imu: ImuSample) -> EstimatorState:
    """One waiting sample of each source that the horizon has passed."""
    now_us = state.horizon_time_us
    if state.gnss_inbox.tail < state.gnss_inbox.head:
        if ekf.gnss_ring[i, state.gnss_inbox.tail % GNSS_RING].time_us <= now_us:
            state = fuse_gnss_step(ekf, i, params, state)
    if state.baro_inbox.tail < state.baro_inbox.head:
        if ekf.baro_ring[i, state.baro_inbox.tail % BARO_RING].time_us <= now_us:
            state = fuse_baro_step(ekf, i, params, state)
    if state.mag_inbox.tail < state.mag_inbox.head:
        if ekf.mag_ring[i, state.mag_inbox.tail % MAG_RING].time_us <= now_us:
            state = fuse_mag_step(ekf, i, params, state, imu.gyro_frd)
    if state.range_inbox.tail < state.range_inbox.head:
        sample = ekf.range_ring[i, state.range_inbox.tail % RANGE_RING]
        if sample.time_us <= now_us:
            state.range_inbox.tail += 1
            if params.range_ctrl == 1:
                nominal, aid = fuse_range(params, ekf.covariance, i, state.nominal, state.range, sample)
                state.nominal = nominal
                state.range = aid
    if rest_is_due(state.rest, state.stillness, state.nominal, now_us):
        nominal, aid = fuse_rest(params, ekf.covariance, i, state.nominal, state.rest, now_us)
        state.nominal = nominal
        state.rest = aid
    return state


@wp.func
def fuse_drag_step(ekf: Ekf, i: int, params: EstimatorParams, state: EstimatorState, imu: ImuSample) -> EstimatorState:
    """Averages the specific force and fuses it when the average is complete."""
    state.drag_sum.accel_frd = state.drag_sum.accel_frd + imu.accel_frd * imu.dt_s
    state.drag_sum.time_s = state.drag_sum.time_s + imu.dt_s
    if state.stillness.is_still == 1:
        state.drag_sum.ground_d = state.nominal.pos_ned[2]
    if drag_is_due(state.drag_sum):
        if is_airborne(state.drag_sum, state.nominal):
            is_starved = seconds_since(state.horizon_time_us, state.gnss_vel.fused_time_us) > 1.0
            nominal, aid = fuse_drag(
                params,
                ekf.covariance,
                i,
                state.nominal,
                state.drag,
                state.drag_sum,
                state.horizon_time_us,
                params.drag_ctrl == 2 and is_starved,
            )
            state.nominal = nominal
            state.drag = aid
        else:
            state.drag.is_active = 0
        state.drag_sum.accel_frd = wp.vec3()
        state.drag_sum.time_s = 0.0
    return state


@wp.func
def predict_step(ekf: Ekf, i: int, params: EstimatorParams, state: EstimatorState, imu: ImuSample) -> EstimatorState:
    """Moves the nominal state by one IMU sample, and the covariance when enough of them have come together."""
    vel_before_ned = state.nominal.vel_ned
    state.nominal = predict_nominal(state.nominal, imu)
    gravity_ned = wp.vec3(0.0, 0.0, GRAVITY_M_S2 * imu.dt_s)
    state.step_delta_vel_ned = state.step_delta_vel_ned + state.nominal.vel_ned - vel_before_ned - gravity_ned
    state.step_dt_s = state.step_dt_s + imu.dt_s
    if state.step_dt_s > params.predict_s - 0.5 * imu.dt_s:
        added_var = process_variance(params, ekf.covariance, i, state.nominal.vel_ned, state.step_dt_s)
        rot = wp.quat_to_matrix(state.nominal.q_ned_from_frd)
        predict_covariance(ekf.covariance, i, rot, state.step_delta_vel_ned, state.step_dt_s, added_var)
        state.step_dt_s = 0.0
        state.step_delta_vel_ned = wp.vec3()
        state.estimate = with_deviations(ekf.covariance, i, state.gnss_wander, state.estimate)
    return state


@wp.func
def start(ekf: Ekf, i: int, params: EstimatorParams, state: EstimatorState) -> EstimatorState:
    """From alignment to running; what waits in the rings is older than the start and is dropped."""
    state.phase = PHASE_RUNNING
    state.nominal = aligned_nominal(params, ekf.covariance, i, state.alignment)
    state.is_yaw_aligned = state.nominal.reset_count  # 1 if the magnetometer set heading
    state.nominal.reset_count = 0
    if state.alignment.baro_count > 0:
        state.origin_baro_height = state.alignment.baro_height / float(state.alignment.baro_count)
        state.origin_baro_height = state.origin_baro_height + state.nominal.pos_ned[2]
        state.baro.is_active = 1
    state.output = start_output(state.nominal)
    past = OutputSample()
    past.q_raw = state.output.q_raw
    past.pos_raw_ned = state.output.pos_raw_ned
    for k in range(IMU_RING):
        ekf.output_ring[i, k] = past
    state.gnss_inbox.tail = state.gnss_inbox.head
    state.baro_inbox.tail = state.baro_inbox.head
    state.mag_inbox.tail = state.mag_inbox.head
    state.range_inbox.tail = state.range_inbox.head
    return state


@wp.func
def horizon_step(ekf: Ekf, i: int, params: EstimatorParams, state: EstimatorState) -> EstimatorState:
    """Moves the horizon by one IMU sample and fuses what it passes."""
    slot = state.imu_tail % IMU_RING
    imu = ekf.imu_ring[i, slot]
    state.imu_tail += 1
    state.horizon_time_us = imu.time_us
    if state.phase == PHASE_RUNNING:
        state.nominal.pos_jump_ned = wp.vec3()
        state.nominal.vel_jump_ned = wp.vec3()
        state.nominal.yaw_jump = 0.0
        resets_before = state.nominal.reset_count
        state = predict_step(ekf, i, params, state, imu)
        state = fuse_sources(ekf, i, params, state, imu)
        if params.drag_ctrl > 0:
            state = fuse_drag_step(ekf, i, params, state, imu)
        if state.nominal.reset_count != resets_before:
            state.output = jump_output(state.output, state.nominal)
            state.estimate.pos_reset_ned = state.nominal.pos_jump_ned
            state.estimate.vel_reset_ned = state.nominal.vel_jump_ned
            state.estimate.yaw_reset = state.nominal.yaw_jump
        state.output = correct_output(params, state.output, ekf.output_ring[i, slot], state.nominal, imu.dt_s)
    return state


@wp.func
def watch(ekf: Ekf, i: int, params: EstimatorParams, state: EstimatorState) -> EstimatorState:
    """Switches silent sources off, once per tick, and starts anew on a covariance that has lost its shape."""
    now_us = state.horizon_time_us
    state.gnss_pos = listen(state.gnss_pos, state.gnss_inbox, now_us)
    state.gnss_vel = listen(state.gnss_vel, state.gnss_inbox, now_us)
    state.gnss_height = listen(state.gnss_height, state.gnss_inbox, now_us)
    state.mag = listen(state.mag, state.mag_inbox, now_us)
    state.range = listen(state.range, state.range_inbox, now_us)
    if state.baro.judged_time_us > wp.int64(0) or state.baro_inbox.is_stuck == 1:
        state.baro = listen(state.baro, state.baro_inbox, now_us)
    if state.imu_tail % _SOUNDNESS_SAMPLES == 0:
        lift_variances(ekf.covariance, i)
        if not is_sound(ekf.covariance, i):
            faults = state.fault_count + 1
            state = at_boot(ekf, i)
            state.fault_count = faults
    return state


@wp.func
def answer(ekf: Ekf, i: int, params: EstimatorParams, state: EstimatorState, imu: ImuSample) -> Estimate:
    """The estimate at the newest IMU sample."""
    estimate = state.estimate
    nominal = state.nominal
    estimate.time_us = state.time_us
    estimate.omega_frd = imu.gyro_frd - nominal.gyro_bias_frd
    estimate.accel_frd = imu.accel_frd - nominal.accel_bias_frd
    if state.phase == PHASE_RUNNING:
        estimate.q_ned_from_frd = output_attitude(state.output)
        estimate.vel_ned = state.output.vel_raw_ned + state.output.vel_correction_ned
        estimate.pos_ned = state.output.pos_raw_ned + state.output.pos_correction_ned
        gravity_ned = wp.vec3(0.0, 0.0, GRAVITY_M_S2)
        estimate.accel_ned = wp.quat_rotate(estimate.q_ned_from_frd, estimate.accel_frd) + gravity_ned
        estimate.gyro_bias_frd = nominal.gyro_bias_frd
        estimate.accel_bias_frd = nominal.accel_bias_frd
        estimate.wind_ned = nominal.wind_ned
        estimate.terrain_d = nominal.terrain_d
        estimate.reset_count = nominal.reset_count
        estimate.flags = flags(params, ekf.covariance, i, state)
    return estimate


@wp.func
def estimator_tick(ekf: Ekf, i: int, state: EstimatorState, samples: Samples) -> EstimatorState:
    """The estimator of vehicle i after one tick: nothing happens without a new IMU sample."""
    if samples.imu.time_us == state.time_us:
        return state
    params = ekf.params[i]
    imu = bounded_sample(samples.imu)
    slot = state.imu_head % IMU_RING
    ekf.imu_ring[i, slot] = imu
    state.imu_head += 1
    state.imu_tail = wp.max(state.imu_tail, state.imu_head - IMU_RING)
    state.time_us = imu.time_us
    state.stillness = observe_stillness(state.stillness, imu)
    state = receive_samples(ekf, i, state, samples)
    if state.phase == PHASE_ALIGNING:
        state.alignment = average(state.alignment, state.stillness, imu, samples)
        if is_aligned(state.alignment):
            state = start(ekf, i, params, state)
    else:
        state.output = integrate_output(state.output, state.nominal, imu)
        past = OutputSample()
        past.q_raw = state.output.q_raw
        past.vel_raw_ned = state.output.vel_raw_ned
        past.pos_raw_ned = state.output.pos_raw_ned
        ekf.output_ring[i, slot] = past
    horizon_us = imu.time_us - wp.int64(params.delay_s * 1.0e6)
    steps = due_count(ekf.imu_ring, i, state.imu_head, state.imu_tail, horizon_us, _MAX_STEPS)
    for _ in range(steps):
        state = horizon_step(ekf, i, params, state)
    if state.phase == PHASE_RUNNING:
        state = watch(ekf, i, params, state)
    state.estimate = answer(ekf, i, params, state, imu)
    return state


@wp.func
def at_boot(ekf: Ekf, i: int) -> EstimatorState:
    """The state at power-on of vehicle i; its covariance is set by the alignment that follows."""
    state = EstimatorState()
    state.nominal.q_ned_from_frd = wp.quat_identity()
    state.output.q_raw = wp.quat_identity()
    state.output.q_correction = wp.quat_identity()
    state.estimate.q_ned_from_frd = wp.quat_identity()
    zero = vec24()
    for r in range(ERROR_STATES):
        ekf.covariance[i, r] = zero
    return state


@wp.func
def estimator_reset(ekf: Ekf, i: int) -> None:
    """Powers the estimator of vehicle i on anew."""
    ekf.rows[i] = at_boot(ekf, i)


@wp.kernel(enable_backward=False)
def reset_rows(ekf: Ekf):
    estimator_reset(ekf, wp.tid())


def make_ekf(vehicle_count: int, device: str = "cpu", params: Any = None) -> Ekf:
    """Estimators of `vehicle_count` vehicles at power-on.

    Args:
        vehicle_count: rows of every array.
        device: a Warp device.
        params: one `EstimatorParams` for all rows; None gives the defaults without a world magnetic field.
    """
    row = params if params is not None else estimator_params()
    ekf = Ekf()
    ekf.rows = wp.zeros(vehicle_count, dtype=EstimatorState, device=device)
    ekf.params = wp.array([row] * vehicle_count, dtype=EstimatorParams, device=device)
    ekf.covariance = wp.zeros((vehicle_count, ERROR_STATES), dtype=vec24, device=device)
    ekf.imu_ring = wp.zeros((vehicle_count, IMU_RING), dtype=ImuSample, device=device)
    ekf.output_ring = wp.zeros((vehicle_count, IMU_RING), dtype=OutputSample, device=device)
    ekf.gnss_ring = wp.zeros((vehicle_count, GNSS_RING), dtype=GnssSample, device=device)
    ekf.baro_ring = wp.zeros((vehicle_count, BARO_RING), dtype=BaroSample, device=device)
    ekf.mag_ring = wp.zeros((vehicle_count, MAG_RING), dtype=MagSample, device=device)
    ekf.range_ring = wp.zeros((vehicle_count, RANGE_RING), dtype=RangeSample, device=device)
    wp.launch(reset_rows, dim=vehicle_count, inputs=[ekf], device=device)
    return ekf
