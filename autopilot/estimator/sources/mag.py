"""Magnetometer: three body axes, observing heading, the earth field and the field of the body (hard iron).

Starts with heading from the levelled field and the declination of the world model. Stops when its values freeze, it
falls silent, or its field is not the local one; the gyro then carries heading, which GNSS velocity holds while the
vehicle accelerates. When its samples were rejected for long, the field of the body is learned anew from the attitude.

A vehicle that has not moved since it was aligned knows its heading from the magnetometer alone: there heading is set
again, instead of learning a field of the body that no calibration leaves. A magnetometer against which heading was
reset (`heading.py`) is used again once it has agreed for a while.
"""

import warp as wp

from autopilot.estimator.delay import MAX_AGE_S, receive
from autopilot.estimator.fuse import fuse, judge, mark_fused, mark_reset, noise_variance, seconds_since, set_variance
from autopilot.estimator.generated import mag_products
from autopilot.estimator.params import MAG_CHECK_INCLINATION, MAG_CHECK_STRENGTH, MAG_TYPE_NONE, EstimatorParams
from autopilot.estimator.sensor_spec import AidSpec, SampleTopic, SensorSpec
from autopilot.estimator.state import ATT, BODY, EARTH, MAG_RING, Aid, Ekf, Inbox, Nominal
from autopilot.ports import MagSample
from common.kernels import vec24
from common.rotation import quat_from_yaw, wrap_pi, yaw_from_quat

wp.set_module_options({"enable_backward": False})

MAG_STUCK_MOVED = wp.constant(0.2)  # [rad]
MAG_STUCK_AFTER = wp.constant(5)  # equal vectors in a row; at 25 Hz known before the first of them is fused
_RESET_AFTER_S = wp.constant(5.0)
# World Magnetic Model 2025, error model of its technical report: 131 to 145 nT per component at one deviation
_WORLD_MODEL_STD_GAUSS = wp.constant(1.4e-3)
_UNKNOWN_FIELD_STD_GAUSS = wp.constant(0.1)
_AGREE_RAD = wp.constant(0.175)  # [rad] 10 deg
_AGREE_S = wp.constant(10.0)  # guess
_STALE_RAD = wp.constant(0.07)  # [rad] 4 deg
_STALE_S = wp.constant(1.0)  # guess
_HEADING_INIT_STD = wp.constant(0.5)  # [rad] before the first fusion, which knows how wrong the field can be


@wp.func
def has_field_model(params: EstimatorParams) -> bool:
    """The host knows the earth field at the origin."""
    return wp.length_sq(params.earth_field_ned_gauss) > 1.0e-4


@wp.func
def is_disturbed(params: EstimatorParams, q_ned_from_frd: wp.quat, field_frd: wp.vec3) -> bool:
    """The field differs from the local one by more than EKF2_MAG_CHK_STR or EKF2_MAG_CHK_INC."""
    earth_ned = params.earth_field_ned_gauss
    strength = wp.length(field_frd)
    is_wrong = bool(False)
    if has_field_model(params):
        if (params.mag_check & MAG_CHECK_STRENGTH) != 0:
            is_wrong = wp.abs(strength - wp.length(earth_ned)) > params.mag_check_strength
        if (params.mag_check & MAG_CHECK_INCLINATION) != 0:
            down = wp.quat_rotate(q_ned_from_frd, field_frd)[2] / wp.max(strength, 1.0e-6)
            inclination = wp.asin(wp.clamp(down, -1.0, 1.0))
            at_position = wp.asin(wp.clamp(earth_ned[2] / wp.length(earth_ned), -1.0, 1.0))
            is_wrong = is_wrong or wp.abs(inclination - at_position) > params.mag_check_inclination
    return is_wrong


@wp.func
def mag_heading(params: EstimatorParams, q_ned_from_frd: wp.quat, field_frd: wp.vec3) -> float:
    """[rad] heading that a field implies, given the tilt of an attitude."""
    tilt = quat_from_yaw(-yaw_from_quat(q_ned_from_frd)) * q_ned_from_frd
    level = wp.quat_rotate(tilt, field_frd)
    declination = float(0.0)
    if has_field_model(params):
        declination = wp.atan2(params.earth_field_ned_gauss[1], params.earth_field_ned_gauss[0])
    return wrap_pi(declination - wp.atan2(level[1], level[0]))


@wp.func
def start_mag(
    params: EstimatorParams, cov: wp.array2d(dtype=vec24), i: int, nominal: Nominal, field_frd: wp.vec3
) -> Nominal:
    """The nominal state with heading and field states set from one (mean) field; heading jumps."""
    yaw_before = yaw_from_quat(nominal.q_ned_from_frd)
    yaw = mag_heading(params, nominal.q_ned_from_frd, field_frd)
    nominal.yaw_jump = nominal.yaw_jump + wrap_pi(yaw - yaw_before)
    nominal.reset_count += 1
    nominal.q_ned_from_frd = wp.normalize(quat_from_yaw(wrap_pi(yaw - yaw_before)) * nominal.q_ned_from_frd)
    set_variance(cov, i, ATT + 2, _HEADING_INIT_STD * _HEADING_INIT_STD)
    return start_field(params, cov, i, nominal, field_frd)


@wp.func
def start_field(
    params: EstimatorParams, cov: wp.array2d(dtype=vec24), i: int, nominal: Nominal, field_frd: wp.vec3
) -> Nominal:
    """The nominal state with the field states of a calibrated magnetometer at a known attitude."""
    earth_std = _WORLD_MODEL_STD_GAUSS
    nominal.earth_field_ned = params.earth_field_ned_gauss
    if not has_field_model(params):
        earth_std = _UNKNOWN_FIELD_STD_GAUSS
        nominal.earth_field_ned = wp.quat_rotate(nominal.q_ned_from_frd, field_frd)
    nominal.body_field_frd = wp.vec3(0.0, 0.0, 0.0)
    for axis in range(3):
        set_variance(cov, i, EARTH + axis, earth_std * earth_std)
        set_variance(cov, i, BODY + axis, params.body_field_init * params.body_field_init)
    return nominal


@wp.func
def mag_repeats(sample: MagSample, previous: MagSample) -> bool:
    """Both samples hold the same field."""
    return sample.field_frd_gauss == previous.field_frd_gauss


@wp.func
def mag_time(inbox: Inbox, sample: MagSample) -> wp.int64:
    """The time of the sample; that of the one before if it is no number."""
    if wp.isfinite(sample.field_frd_gauss):
        return sample.time_us
    return inbox.arrived_time_us


@wp.func
def receive_mag(ekf: Ekf, i: int, sample: MagSample, is_still: bool, omega_frd: wp.vec3) -> None:
    """Puts a new sample into the ring."""
    inbox = ekf.rows[i].mag_inbox
    if sample.time_us != inbox.arrived_time_us:
        is_repeat = inbox.head > 0 and mag_repeats(sample, ekf.mag_ring[i, (inbox.head - 1) % MAG_RING])
        ekf.mag_ring[i, inbox.head % MAG_RING] = sample
        rate = omega_frd
        ekf.rows[i].mag_inbox = receive(
            inbox, sample.time_us, MAG_RING, is_repeat, is_still, rate, MAG_STUCK_AFTER, MAG_STUCK_MOVED
        )


@wp.func
def body_axis_ned(rot: wp.mat33, axis: int) -> wp.vec3:
    """Direction of a body axis in ned: a column of the rotation matrix."""
    return wp.vec3(rot[0, axis], rot[1, axis], rot[2, axis])


@wp.func
def fuse_mag(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    aid: Aid,
    sample: MagSample,
    omega_frd: wp.vec3,
    age_s: float,
) -> tuple[Nominal, Aid]:
    """The field in three axes, which pass or fail together; the vehicle has turned by omega * age since the sample."""
    var = noise_variance(aid, params.mag_noise)
    field_frd = sample.field_frd_gauss
    earth_part = field_frd - nominal.body_field_frd
    field_frd = field_frd - wp.cross(omega_frd, earth_part) * age_s
    rot = wp.quat_to_matrix(nominal.q_ned_from_frd)
    innov = field_frd - wp.quat_rotate_inv(nominal.q_ned_from_frd, nominal.earth_field_ned) - nominal.body_field_frd
    innov_var = wp.vec3()
    for axis in range(3):
        _ph, _ph_slow, hph = mag_products(cov, i, body_axis_ned(rot, axis), axis, nominal.earth_field_ned)
        innov_var[axis] = hph + var
    starved_s = seconds_since(sample.time_us, aid.fused_time_us)
    aid = judge(aid, sample.time_us, innov, innov_var, 3, params.mag_gate)
    aid.is_active = 1
    if aid.test_ratio <= 1.0:
        for axis in range(3):
            rot = wp.quat_to_matrix(nominal.q_ned_from_frd)
            axis_ned = body_axis_ned(rot, axis)
            ph, ph_slow, hph = mag_products(cov, i, axis_ned, axis, nominal.earth_field_ned)
            predicted = wp.dot(axis_ned, nominal.earth_field_ned) + nominal.body_field_frd[axis]
            nominal = fuse(params, cov, i, nominal, ph, ph_slow, field_frd[axis] - predicted, hph + var)
        aid = mark_fused(aid)
    elif starved_s > _RESET_AFTER_S:
        nominal.body_field_frd = nominal.body_field_frd + innov
        for axis in range(3):
            set_variance(cov, i, BODY + axis, params.body_field_init * params.body_field_init + var)
        aid = mark_reset(aid)
    return nominal, aid


@wp.func
def heading_apart(params: EstimatorParams, q_ned_from_frd: wp.quat, field_frd: wp.vec3) -> float:
    """[rad] between the heading that a field implies and that of an attitude."""
    return wp.abs(wrap_pi(mag_heading(params, q_ned_from_frd, field_frd) - yaw_from_quat(q_ned_from_frd)))


@wp.func
def knows_heading_by_mag_alone(ekf: Ekf, i: int) -> bool:
    """The vehicle stands as it was aligned: no motion has shown its heading, and nothing from outside."""
    return ekf.yaw[i].has_moved == 0 and ekf.rows[i].external_yaw.is_active == 0


@wp.func
def keeps_heading(ekf: Ekf, i: int) -> bool:
    """The vehicle stands on its wheels after a drive: a field that changes now is that of steel beside it."""
    return ekf.rows[i].stillness.is_parked == 1 and ekf.rows[i].stillness.is_still == 1 and ekf.yaw[i].has_moved == 1


@wp.func
def take_mag(ekf: Ekf, i: int, params: EstimatorParams, now_us: wp.int64, gyro_frd: wp.vec3) -> None:
    """Fuses the oldest waiting field if the horizon has passed it; the first one ever sets heading."""
    sample = ekf.mag_ring[i, ekf.rows[i].mag_inbox.tail % MAG_RING]
    if sample.time_us > now_us:
        return
    ekf.rows[i].mag_inbox.tail += 1
    age_s = seconds_since(now_us, sample.time_us)
    if params.mag_type == MAG_TYPE_NONE or age_s > MAX_AGE_S:
        return
    if keeps_heading(ekf, i):
        ekf.rows[i].mag.judged_time_us = sample.time_us
        return
    nominal = ekf.rows[i].nominal
    ekf.rows[i].is_mag_disturbed = 0
    if is_disturbed(params, nominal.q_ned_from_frd, sample.field_frd_gauss):
        ekf.rows[i].is_mag_disturbed = 1
        ekf.rows[i].mag_agree_s = 0.0
        return
    aid = ekf.rows[i].mag
    step_s = wp.min(seconds_since(sample.time_us, aid.judged_time_us), 1.0)
    if ekf.rows[i].is_mag_faulty == 1:
        aid.judged_time_us = sample.time_us
        aid.is_active = 0
        ekf.rows[i].mag = aid
        if heading_apart(params, nominal.q_ned_from_frd, sample.field_frd_gauss) > _AGREE_RAD:
            ekf.rows[i].mag_agree_s = 0.0
        else:
            ekf.rows[i].mag_agree_s += step_s
        if ekf.rows[i].mag_agree_s < _AGREE_S:
            return
        ekf.rows[i].is_mag_faulty = 0
        ekf.rows[i].mag_agree_s = 0.0
        ekf.rows[i].nominal = start_field(params, ekf.covariance, i, nominal, sample.field_frd_gauss)
    elif ekf.rows[i].is_yaw_aligned == 0:
        ekf.rows[i].nominal = start_mag(params, ekf.covariance, i, nominal, sample.field_frd_gauss)
        ekf.rows[i].is_yaw_aligned = 1
    elif not knows_heading_by_mag_alone(ekf, i):
        ekf.rows[i].mag_stale_s = 0.0
    else:  # both sides of an `or` would be computed, and this one is dear
        ekf.rows[i].mag_stale_s += step_s
        if heading_apart(params, nominal.q_ned_from_frd, sample.field_frd_gauss) < _STALE_RAD:
            ekf.rows[i].mag_stale_s = 0.0
        if ekf.rows[i].mag_stale_s > _STALE_S:
            ekf.rows[i].nominal = start_mag(params, ekf.covariance, i, nominal, sample.field_frd_gauss)
            ekf.rows[i].mag_stale_s = 0.0
    omega_frd = gyro_frd - ekf.rows[i].nominal.gyro_bias_frd
    nominal, aid = fuse_mag(params, ekf.covariance, i, ekf.rows[i].nominal, ekf.rows[i].mag, sample, omega_frd, age_s)
    ekf.rows[i].nominal = nominal
    ekf.rows[i].mag = aid


MAG = SensorSpec(
    name="mag",
    label="magnetometer",
    Sample=MagSample,
    ring_size=MAG_RING,
    aids=(AidSpec("mag", 3, "gauss", {"mag_field": slice(0, 3)}),),
    topic=SampleTopic(
        "vehicle_magnetometer",
        {"timestamp_sample": "uint64_t", "magnetometer_ga": "float[3]"},
        {"timestamp_sample": "time_us", "magnetometer_ga": "field_frd_gauss"},
    ),
    status_bit=1 << 2,
    failure_unit=2,
    bias_unit="gauss",
    wrong_bias=0.3,
)
