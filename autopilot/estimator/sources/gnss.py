"""GNSS: horizontal position, height and velocity, fused as the horizon passes the time of validity.

A position holds white noise and a wander that lasts a minute (ionosphere, ephemeris, multipath): a slow error per axis.
So a vehicle that boots at the origin keeps its place though the receiver says otherwise, and one that does not know its
place never takes the mean of many fixes for better than the wander they share.

Starts with the first good fix once heading is known. Stops with the fix. A fix whose velocity is not known well enough
gives position and height alone. Sets position and velocity when the first fix is far off or nothing passed the gate for
a while; a velocity that did not fit for so long puts heading in doubt too. While a client's position is fused it sets
nothing: two frames that differ would set the state in turn.
"""

import warp as wp

from autopilot.estimator.delay import MAX_AGE_S, receive
from autopilot.estimator.fuse import (
    fuse,
    fuse_state,
    judge,
    mark_fused,
    mark_reset,
    noise_variance,
    offset_products,
    seconds_since,
    set_offset_by_state,
    set_slow_variance,
    set_state_by_offset,
    set_variance,
)
from autopilot.estimator.health import climb_innov_lpf, doubt_accel
from autopilot.estimator.params import GPS_CTRL_HEIGHT, GPS_CTRL_POS, GPS_CTRL_VEL, EstimatorParams
from autopilot.estimator.sensor_spec import AidSpec, SensorSpec
from autopilot.estimator.state import (
    ATT,
    BODY,
    GNSS_RING,
    POS,
    SLOW,
    SLOW_COUNT,
    SLOW_COV,
    VEL,
    Aid,
    Ekf,
    Inbox,
    Nominal,
)
from autopilot.ports import GnssSample
from common.kernels import vec24

wp.set_module_options({"enable_backward": False})

GNSS_STUCK_AFTER = wp.constant(3)  # equal solutions in a row: floats of a live receiver never repeat
VERTICAL_FACTOR = wp.constant(1.5)  # vertical over horizontal error, from satellite geometry
# The receiver's accuracy figures hold both errors; guess at how they divide, for receivers worse than the parameters
_WHITE_FRACTION_POS = wp.constant(0.3)
_SLOW_FRACTION_POS = wp.constant(0.6)
_WHITE_FRACTION_VEL = wp.constant(0.5)
GNSS_STUCK_MOVED = wp.constant(3.0)  # [m]
# Acceleration turned to ned with a wrong heading is the ordinary cause of a velocity that does not fit: guess
_DOUBTED_HEADING_STD = wp.constant(0.2)  # [rad]
_DOUBTED_BODY_FRACTION = wp.constant(4.0)  # of the body field's deviation at the start
_LOST_VAR = wp.constant(1.1e4)  # [m²] beyond 100 m the position is set by a fix: float32 would not subtract well
_NOWHERE_VAR = wp.constant(25.0)  # [m²] beyond 5 m the first fix sets it: fused, the present would glide there
_RESET_AFTER_S = wp.constant(5.0)  # nothing passed for so long: believe the receiver rather than the dead reckoning


@wp.func
def gnss_is_good(params: EstimatorParams, sample: GnssSample) -> bool:
    """The fix is good enough to be used; its velocity may not be."""
    return (
        sample.fix_type >= params.gnss_min_fix
        and sample.satellites >= params.gnss_min_satellites
        and sample.pos_h_std <= params.gnss_max_pos_h_std
        and sample.pos_v_std <= params.gnss_max_pos_v_std
    )


@wp.func
def gnss_vel_is_good(params: EstimatorParams, sample: GnssSample) -> bool:
    """The velocity of a good fix is good enough to be used, too."""
    return sample.vel_std <= params.gnss_max_vel_std


@wp.func
def gnss_repeats(sample: GnssSample, previous: GnssSample) -> bool:
    """Both samples hold the same solution."""
    return sample.pos_ned == previous.pos_ned and sample.vel_ned == previous.vel_ned


@wp.func
def gnss_time(inbox: Inbox, sample: GnssSample) -> wp.int64:
    """The time of the sample; that of the one before if it is no number."""
    if wp.isfinite(sample.pos_ned) and wp.isfinite(sample.vel_ned):
        return sample.time_us
    return inbox.arrived_time_us


@wp.func
def receive_gnss(ekf: Ekf, i: int, sample: GnssSample, is_still: bool, vel_ned: wp.vec3) -> None:
    """Puts a new sample into the ring."""
    inbox = ekf.rows[i].gnss_inbox
    if sample.time_us != inbox.arrived_time_us:
        is_repeat = inbox.head > 0 and gnss_repeats(sample, ekf.gnss_ring[i, (inbox.head - 1) % GNSS_RING])
        ekf.gnss_ring[i, inbox.head % GNSS_RING] = sample
        rate = vel_ned
        ekf.rows[i].gnss_inbox = receive(
            inbox, sample.time_us, GNSS_RING, is_repeat, is_still, rate, GNSS_STUCK_AFTER, GNSS_STUCK_MOVED
        )


@wp.func
def gnss_pos_std(params: EstimatorParams, sample: GnssSample) -> float:
    """[m] noise per horizontal axis from sample to sample."""
    return wp.max(params.gnss_pos_noise, _WHITE_FRACTION_POS * sample.pos_h_std)


@wp.func
def gnss_vel_std(params: EstimatorParams, sample: GnssSample) -> float:
    """[m/s] noise per axis."""
    return wp.max(params.gnss_vel_noise, _WHITE_FRACTION_VEL * sample.vel_std)


@wp.func
def fuse_gnss_vel(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    aid: Aid,
    sample: GnssSample,
    may_reset: bool,
) -> tuple[Nominal, Aid]:
    """Velocity: three axes that pass or fail together."""
    var = noise_variance(aid, gnss_vel_std(params, sample))
    if (params.gnss_ctrl & GPS_CTRL_VEL) != 0:
        innov = sample.vel_ned - nominal.vel_ned
        innov_var = wp.vec3(cov[i, VEL][VEL] + var, cov[i, VEL + 1][VEL + 1] + var, cov[i, VEL + 2][VEL + 2] + var)
        starved_s = seconds_since(sample.time_us, aid.fused_time_us)
        aid = judge(aid, sample.time_us, innov, innov_var, 3, params.gnss_vel_gate)
        aid.is_active = 1
        if aid.test_ratio <= 1.0:
            for axis in range(3):
                axis_innov = sample.vel_ned[axis] - nominal.vel_ned[axis]
                nominal = fuse_state(params, cov, i, nominal, VEL + axis, axis_innov, var)
            aid = mark_fused(aid)
        elif may_reset and starved_s > _RESET_AFTER_S:
            nominal.vel_jump_ned = nominal.vel_jump_ned + innov
            nominal.vel_ned = sample.vel_ned
            nominal.reset_count += 1
            for axis in range(3):
                set_variance(cov, i, VEL + axis, var)
                body_std = _DOUBTED_BODY_FRACTION * params.body_field_init
                set_variance(cov, i, BODY + axis, body_std * body_std)
            set_variance(cov, i, ATT + 2, _DOUBTED_HEADING_STD * _DOUBTED_HEADING_STD)
            aid = mark_reset(aid)
    return nominal, aid


@wp.func
def gnss_wander_var(params: EstimatorParams, sample: GnssSample, axis: int) -> float:
    """[m²] variance of the slow error."""
    std = wp.max(params.gnss_wander, _SLOW_FRACTION_POS * sample.pos_h_std)
    if axis == 2:
        std = VERTICAL_FACTOR * std
    return std * std


@wp.func
def propagate_wander(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    sample: GnssSample,
    then_us: wp.int64,
) -> Nominal:
    """The wander from `then_us` (0: never known) to the sample: a first-order Gauss-Markov process on each axis."""
    keep = float(0.0)
    if then_us != wp.int64(0):
        keep = wp.exp(-seconds_since(sample.time_us, then_us) / params.gnss_wander_time)
    slow_row = cov[i, SLOW_COV]
    for j in range(3):
        nominal.slow[j] = nominal.slow[j] * keep
        cov[i, SLOW + j] = cov[i, SLOW + j] * keep
        for k in range(SLOW_COUNT):
            slow_row[SLOW_COUNT * j + k] = slow_row[SLOW_COUNT * j + k] * keep
            slow_row[SLOW_COUNT * k + j] = slow_row[SLOW_COUNT * k + j] * keep
        diagonal = (SLOW_COUNT + 1) * j
        slow_row[diagonal] = slow_row[diagonal] + gnss_wander_var(params, sample, j) * (1.0 - keep * keep)
    cov[i, SLOW_COV] = slow_row
    return nominal


@wp.func
def set_gnss_axis(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    sample: GnssSample,
    axis: int,
    measured: float,
    var: float,
) -> Nominal:
    """One position axis set to the receiver's, whose wander is unknown then."""
    nominal.pos_jump_ned[axis] = nominal.pos_jump_ned[axis] + measured - nominal.pos_ned[axis]
    nominal.pos_ned[axis] = measured
    nominal.slow[axis] = 0.0
    set_slow_variance(cov, i, axis, gnss_wander_var(params, sample, axis))
    set_state_by_offset(cov, i, POS + axis, axis, var)
    return nominal


@wp.func
def fuse_gnss_pos(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    aid: Aid,
    sample: GnssSample,
    age_s: float,
    may_reset: bool,
) -> tuple[Nominal, Aid]:
    """Horizontal position: two axes that pass or fail together."""
    var = noise_variance(aid, gnss_pos_std(params, sample))
    if (params.gnss_ctrl & GPS_CTRL_POS) != 0:
        pos_ned = sample.pos_ned + nominal.vel_ned * age_s
        innov = wp.vec3()
        innov_var = wp.vec3(1.0, 1.0, 1.0)
        for axis in range(2):
            _ph, _ph_slow, hph = offset_products(cov, i, POS + axis, axis)
            innov[axis] = pos_ned[axis] - nominal.pos_ned[axis] - nominal.slow[axis]
            innov_var[axis] = hph + var
        starved_s = seconds_since(sample.time_us, aid.fused_time_us)
        aid = judge(aid, sample.time_us, innov, innov_var, 2, params.gnss_pos_gate)
        aid.is_active = 1
        is_first = aid.fused_time_us == wp.int64(0)
        is_lost = cov[i, POS][POS] > wp.where(is_first, _NOWHERE_VAR, _LOST_VAR)
        if aid.test_ratio <= 1.0 and not is_lost:
            for axis in range(2):
                ph, ph_slow, hph = offset_products(cov, i, POS + axis, axis)
                axis_innov = pos_ned[axis] - nominal.pos_ned[axis] - nominal.slow[axis]
                nominal = fuse(params, cov, i, nominal, ph, ph_slow, axis_innov, hph + var)
            aid = mark_fused(aid)
        elif may_reset and (is_lost or starved_s > _RESET_AFTER_S):
            for axis in range(2):
                nominal = set_gnss_axis(params, cov, i, nominal, sample, axis, pos_ned[axis], var)
            if is_first:
                aid = mark_fused(aid)
            else:
                nominal.reset_count += 1
                aid = mark_reset(aid)
    return nominal, aid


@wp.func
def fuse_gnss_height(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    aid: Aid,
    sample: GnssSample,
    age_s: float,
    is_reference: bool,
) -> tuple[Nominal, Aid]:
    """Height. Nothing fits for long: the state is set if this is the height reference, else the wander is."""
    var = noise_variance(aid, VERTICAL_FACTOR * gnss_pos_std(params, sample))
    if (params.gnss_ctrl & GPS_CTRL_HEIGHT) != 0:
        pos_d = sample.pos_ned[2] + nominal.vel_ned[2] * age_s
        innov = pos_d - nominal.pos_ned[2] - nominal.slow[2]
        ph, ph_slow, hph = offset_products(cov, i, POS + 2, 2)
        innov_var = hph + var
        starved_s = seconds_since(sample.time_us, aid.fused_time_us)
        aid = judge(
            aid, sample.time_us, wp.vec3(innov, 0.0, 0.0), wp.vec3(innov_var, 1.0, 1.0), 1, params.gnss_pos_gate
        )
        aid.is_active = 1
        if aid.test_ratio <= 1.0:
            nominal = fuse(params, cov, i, nominal, ph, ph_slow, innov, innov_var)
            aid = mark_fused(aid)
        elif starved_s > _RESET_AFTER_S:
            if is_reference:
                nominal.reset_count += 1
                nominal = set_gnss_axis(params, cov, i, nominal, sample, 2, pos_d, var)
            else:
                nominal.slow[2] = nominal.slow[2] + innov
                set_offset_by_state(cov, i, POS + 2, 2, var)
            aid = mark_reset(aid)
    return nominal, aid


@wp.func
def take_gnss(ekf: Ekf, i: int, params: EstimatorParams, now_us: wp.int64) -> None:
    """Fuses the oldest waiting GNSS sample if the horizon has passed it."""
    sample = ekf.gnss_ring[i, ekf.rows[i].gnss_inbox.tail % GNSS_RING]
    if sample.time_us > now_us:
        return
    ekf.rows[i].gnss_inbox.tail += 1
    age_s = seconds_since(now_us, sample.time_us)
    if age_s > MAX_AGE_S or not gnss_is_good(params, sample):
        return
    cov = ekf.covariance
    nominal = propagate_wander(params, cov, i, ekf.rows[i].nominal, sample, ekf.rows[i].wander_time_us)
    ekf.rows[i].wander_time_us = sample.time_us
    may_reset = ekf.rows[i].external_pos.is_active == 0
    if ekf.rows[i].is_yaw_aligned == 1:
        if gnss_vel_is_good(params, sample):
            nominal, vel_aid = fuse_gnss_vel(params, cov, i, nominal, ekf.rows[i].gnss_vel, sample, may_reset)
            ekf.rows[i].gnss_vel = vel_aid
            ekf.rows[i].climb_innov_lpf = climb_innov_lpf(ekf.rows[i])
            ekf.rows[i].doubted_time_us = doubt_accel(ekf.rows[i], ekf.params[i].accel_bias_limit)
        nominal, pos_aid = fuse_gnss_pos(params, cov, i, nominal, ekf.rows[i].gnss_pos, sample, age_s, may_reset)
        ekf.rows[i].gnss_pos = pos_aid
    is_reference = ekf.rows[i].baro.is_active == 0 and ekf.rows[i].external_height.is_active == 0
    nominal, height_aid = fuse_gnss_height(
        params, cov, i, nominal, ekf.rows[i].gnss_height, sample, age_s, is_reference
    )
    ekf.rows[i].gnss_height = height_aid
    ekf.rows[i].nominal = nominal


GNSS = SensorSpec(
    name="gnss",
    label="GNSS",
    Sample=GnssSample,
    ring_size=GNSS_RING,
    aids=(
        AidSpec("gnss_pos", 2, "m", {"gps_hpos": slice(0, 2)}),
        AidSpec("gnss_vel", 3, "m/s", {"gps_hvel": slice(0, 2), "gps_vvel": slice(2, 3)}),
        AidSpec("gnss_height", 1, "m", {"gps_vpos": slice(0, 1)}),
    ),
    status_bit=1 << 5,
    failure_unit=4,
    bias_unit="m",
    wrong_bias=100.0,
)
