"""Wheels: what stands on them moves along its nose at the speed that their encoders show, and neither sideways nor up.

In: tread speeds of the left and the right side. Fused: their mean, the speed along body x, and the constraint of a
vehicle that rolls (Dissanayake et al. 2001, "The aiding of a low-cost strapdown inertial measurement unit using vehicle
model constraints for land vehicle applications"): none along body y and z at the place that does not slip sideways in a
turn. Along the body's axes, so slopes are no matter. Where the sides differ by more than the vehicle turns, one of them
spins, slides or is broken: the one that is nearer to the estimate is believed.

Tyres slip by what they bear, along and across, on slopes and in bends: as much as EKF2_WHL_SLIP says is expected. What
is wrong with a wheel lasts: its scale, the rest of its slip. So the samples of a third of a second
tell no more than one, while the gate is as narrow as the noise of each. The scale of each side is learned from GNSS
velocity by a filter of its own. Not fused: off the ground or tipped over, without heading, and for seconds after GNSS
velocity has been rejected for two (sliding, carried, spinning on ice): GNSS is believed then. Never sets the state;
where nothing has passed for long and no other velocity is there, it becomes uncertain enough for the wheels to pass.
"""

import warp as wp

from autopilot.estimator.delay import MAX_AGE_S, receive
from autopilot.estimator.fuse import fuse, judge, mark_fused, noise_variance, seconds_since
from autopilot.estimator.generated import speed_products
from autopilot.estimator.health import DEAD_RECKONING_AFTER_S
from autopilot.estimator.params import EstimatorParams
from autopilot.estimator.sensor_spec import AidSpec, SampleTopic, SensorSpec
from autopilot.estimator.sources.gnss import gnss_vel_std
from autopilot.estimator.sources.mag import body_axis_ned
from autopilot.estimator.state import GNSS_RING, VEL, WHEELS_RING, Aid, Ekf, Inbox, Nominal, Odometer
from autopilot.estimator.wheel_params import WHEEL_CTRL_SCALE, WHEEL_CTRL_SIDE, WHEEL_CTRL_SPEED
from autopilot.ports import GnssSample, WheelSample
from common.kernels import vec24

wp.set_module_options({"enable_backward": False})

_STUCK_AFTER = wp.constant(12)
_STUCK_MOVED = wp.constant(0.5)  # [m/s] by the estimate, within which no encoder of use repeats its value
_LASTS_S = wp.constant(0.3)  # within which all samples have the same error; tuned on simulated drives
_SLIP_ERROR = wp.constant(0.7)  # of the slip that is expected; guess: loose ground has twice that of firm
_TURN_SLIP = wp.constant(0.2)  # of what a side moves in a turn on the spot; guess: skid steer
_LEAST_LOAD = wp.constant(4.0)  # [m/s²] that the ground bears: less of it, and the wheels are in the air; guess
_MOST_LOAD = wp.constant(20.0)
_LEAST_DOWN = wp.constant(0.5)  # cosine of the largest tilt, 60 deg: beyond it the vehicle lies on its side
_UP_FACTOR = wp.constant(2.0)  # vertical over sideways noise: springs; guess
_UP_FRACTION = wp.constant(0.03)  # and of the speed: bumps; guess
_DOUBT_REJECTS = wp.constant(10)  # GNSS velocities in a row
_DOUBT_S = wp.constant(5.0)
_STARVED_S = wp.constant(20.0)  # a velocity that the IMU alone has carried on so long is worth no more; guess
_STRUCK_S = wp.constant(0.5)  # the same after a blow, which an IMU does not measure well
_SCALE_SPEED = wp.constant(0.7)  # [m/s] below which a scale is not learned
_SCALE_FORCE = wp.constant(2.0)  # [m/s²] along the ground, above which slip would be taken for scale
_SCALE_TURN = wp.constant(0.5)  # [rad/s]
_SCALE_APART_S = wp.constant(0.03)  # between a fix and a sample that describe the same moment
_SCALE_GATE = wp.constant(3.0)
_SCALE_WALK = wp.constant(2.0e-4)  # [1/√s] guess: load, tyre pressure, ground
_SCALE_LIMIT = wp.constant(0.1)


@wp.struct
class Rolling:
    """A wheel sample as it meets the estimate."""

    left: float  # [m/s] scale removed
    right: float
    turn: float  # [m/s] by which the left side is faster, by the gyro
    speed: float  # [m/s] of the vehicle's middle
    std: float  # [m/s] of that
    is_one: int  # one side is believed, not both
    side: float  # [m/s] what the place that does not slip makes the centre do along body y
    side_std: float
    up: float  # [m/s] along body z
    up_std: float


@wp.func
def wheels_time(inbox: Inbox, sample: WheelSample) -> wp.int64:
    """The time of the sample; that of the one before if it is no number."""
    if wp.isfinite(sample.left_m_s) and wp.isfinite(sample.right_m_s):
        return sample.time_us
    return inbox.arrived_time_us


@wp.func
def receive_wheels(ekf: Ekf, i: int, sample: WheelSample, is_still: bool) -> None:
    """Puts a new sample into the ring."""
    inbox = ekf.rows[i].wheels_inbox
    if sample.time_us != inbox.arrived_time_us:
        before = ekf.wheels_ring[i, (inbox.head + WHEELS_RING - 1) % WHEELS_RING]
        is_repeat = inbox.head > 0 and sample.left_m_s == before.left_m_s and sample.right_m_s == before.right_m_s
        ekf.wheels_ring[i, inbox.head % WHEELS_RING] = sample
        rate = ekf.rows[i].estimate.accel_ned
        ekf.rows[i].wheels_inbox = receive(
            inbox, sample.time_us, WHEELS_RING, is_repeat, is_still, rate, _STUCK_AFTER, _STUCK_MOVED
        )


@wp.func
def is_on_wheels(accel_frd: wp.vec3, q_ned_from_frd: wp.quat) -> bool:
    """The ground bears the vehicle through its wheels.

    Args:
        accel_frd: [m/s²] specific force, a running mean.
        q_ned_from_frd: attitude.
    """
    load = -accel_frd[2]
    down = wp.quat_rotate(q_ned_from_frd, wp.vec3(0.0, 0.0, 1.0))[2]
    return load > _LEAST_LOAD and load < _MOST_LOAD and down > _LEAST_DOWN


@wp.func
def rolling(
    params: EstimatorParams,
    odometer: Odometer,
    sample: WheelSample,
    omega_frd: wp.vec3,
    accel_frd: wp.vec3,
    expected: float,
) -> Rolling:
    """What a sample says of the vehicle, and how sure it is.

    Args:
        params: of the estimator.
        odometer: what is known of the wheels.
        sample: as measured.
        omega_frd: [rad/s] bias removed.
        accel_frd: [m/s²] specific force: what the tyres bear.
        expected: [m/s] speed along body x by the estimate.
    """
    out = Rolling()
    grip = 1.0 - params.wheel_slip * accel_frd[0]
    out.left = sample.left_m_s * (1.0 + odometer.scale[0]) * grip
    out.right = sample.right_m_s * (1.0 + odometer.scale[1]) * grip
    out.turn = omega_frd[2] * params.wheel_track
    run = 0.5 * (wp.abs(out.left) + wp.abs(out.right))
    slip = _SLIP_ERROR * params.wheel_slip * wp.sqrt(accel_frd[0] * accel_frd[0] + accel_frd[1] * accel_frd[1]) * run
    scale_var = wp.max(odometer.scale_var[0], odometer.scale_var[1])
    turn_slip = _TURN_SLIP * out.turn
    var = params.wheel_noise * params.wheel_noise + scale_var * run * run + slip * slip + turn_slip * turn_slip
    out.std = wp.sqrt(var)
    out.speed = 0.5 * (out.left + out.right)
    apart = out.left - out.right - out.turn
    if apart * apart > 2.0 * params.wheel_gate * params.wheel_gate * var:
        out.is_one = 1
        by_left, by_right = out.left - 0.5 * out.turn, out.right + 0.5 * out.turn
        out.speed = by_left
        if wp.abs(by_right - expected) < wp.abs(by_left - expected):
            out.speed = by_right
    side_slip = params.wheel_slip * accel_frd[1] * run
    side_error = _SLIP_ERROR * side_slip
    side_var = params.wheel_side_noise * params.wheel_side_noise + side_error * side_error + turn_slip * turn_slip
    out.side = -omega_frd[2] * params.wheel_x - side_slip
    out.side_std = wp.sqrt(side_var)
    out.up = omega_frd[1] * params.wheel_x
    out.up_std = _UP_FACTOR * params.wheel_side_noise + _UP_FRACTION * run
    return out


@wp.func
def fuse_speed(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    axis: int,
    measured: float,
    var: float,
) -> Nominal:
    """The speed along a body axis."""
    axis_ned = body_axis_ned(wp.quat_to_matrix(nominal.q_ned_from_frd), axis)
    ph, ph_slow, hph = speed_products(cov, i, axis_ned, nominal.vel_ned)
    return fuse(params, cov, i, nominal, ph, ph_slow, measured - wp.dot(axis_ned, nominal.vel_ned), hph + var)


@wp.func
def fuse_axes(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    aid: Aid,
    time_us: wp.int64,
    first: int,
    measured: wp.vec2,
    std: wp.vec2,
) -> tuple[Nominal, Aid]:
    """Speeds along body x (first 0, one axis), or y and z (first 1), which pass or fail together."""
    count = 1 + wp.min(first, 1)
    step_s = wp.clamp(seconds_since(time_us, aid.judged_time_us), 1.0e-3, _LASTS_S)
    innov = wp.vec3()
    innov_var = wp.vec3(1.0, 1.0, 1.0)
    rot = wp.quat_to_matrix(nominal.q_ned_from_frd)
    for k in range(count):
        axis_ned = body_axis_ned(rot, first + k)
        _ph, _ph_slow, hph = speed_products(cov, i, axis_ned, nominal.vel_ned)
        innov[k] = measured[k] - wp.dot(axis_ned, nominal.vel_ned)
        innov_var[k] = hph + noise_variance(aid, std[k])
    aid = judge(aid, time_us, innov, innov_var, count, params.wheel_gate)
    aid.is_active = 1
    if aid.test_ratio <= 1.0:
        for k in range(count):
            var = noise_variance(aid, std[k]) * _LASTS_S / step_s
            nominal = fuse_speed(params, cov, i, nominal, first + k, measured[k], var)
        aid = mark_fused(aid)
    return nominal, aid


@wp.func
def learned(
    params: EstimatorParams, odometer: Odometer, sample: WheelSample, fix: GnssSample, roll: Rolling, speed: float
) -> Odometer:
    """The scales after a GNSS velocity of the sample's own moment: one filter of one state for each side.

    Args:
        params: of the estimator.
        odometer: before.
        sample: as measured.
        fix: the GNSS solution.
        roll: the sample as it met the estimate.
        speed: [m/s] along body x by the fix.
    """
    gnss_std = gnss_vel_std(params, fix)
    walk_s = wp.min(seconds_since(fix.time_us, odometer.learned_time_us), 1.0)
    for side in range(2):
        measured = sample.left_m_s
        expected = speed + 0.5 * roll.turn
        if side == 1:
            measured = sample.right_m_s
            expected = speed - 0.5 * roll.turn
        prior = wp.min(
            odometer.scale_var[side] + _SCALE_WALK * _SCALE_WALK * walk_s,
            params.wheel_scale_std * params.wheel_scale_std,
        )
        innov = expected - measured * (1.0 + odometer.scale[side])
        innov_var = measured * measured * prior + gnss_std * gnss_std + params.wheel_noise * params.wheel_noise
        if innov * innov < _SCALE_GATE * _SCALE_GATE * innov_var:
            gain = prior * measured / innov_var
            odometer.scale[side] = wp.clamp(odometer.scale[side] + gain * innov, -_SCALE_LIMIT, _SCALE_LIMIT)
            odometer.scale_var[side] = (1.0 - gain * measured) * prior
    odometer.learned_time_us = fix.time_us
    return odometer


@wp.func
def learn_scale(
    ekf: Ekf, i: int, params: EstimatorParams, sample: WheelSample, roll: Rolling, turn_rate: float
) -> None:
    """Learns the scales from the newest fix, if it is new, of this moment, and the vehicle rolls along evenly."""
    fix_us = ekf.rows[i].gnss_vel.fused_time_us
    odometer = ekf.rows[i].odometer
    if fix_us == odometer.learned_time_us or seconds_since(sample.time_us, fix_us) > _SCALE_APART_S:
        return
    fix = ekf.gnss_ring[i, (ekf.rows[i].gnss_inbox.tail + GNSS_RING - 1) % GNSS_RING]
    force = ekf.rows[i].stillness.accel_mean_frd
    is_even = force[0] * force[0] + force[1] * force[1] < _SCALE_FORCE * _SCALE_FORCE and turn_rate < _SCALE_TURN
    if fix.time_us == fix_us and is_even and roll.is_one == 0 and wp.abs(roll.speed) > _SCALE_SPEED:
        nose_ned = wp.quat_rotate(ekf.rows[i].nominal.q_ned_from_frd, wp.vec3(1.0, 0.0, 0.0))
        ekf.rows[i].odometer = learned(params, odometer, sample, fix, roll, wp.dot(nose_ned, fix.vel_ned))


@wp.func
def add_velocity_variance(cov: wp.array2d(dtype=vec24), i: int, vel: wp.vec3) -> None:
    """Velocity may be wrong by `vel` [m/s]."""
    for axis in range(3):
        row = cov[i, VEL + axis]
        row[VEL + axis] = row[VEL + axis] + vel[axis] * vel[axis]
        cov[i, VEL + axis] = row


@wp.func
def is_contradicted(ekf: Ekf, i: int, now_us: wp.int64) -> bool:
    """GNSS velocity does not agree with the wheels: it is believed, and meets a velocity that is as uncertain."""
    vel = ekf.rows[i].gnss_vel
    if vel.is_active == 1 and vel.reject_count >= _DOUBT_REJECTS:
        if seconds_since(now_us, ekf.rows[i].odometer.doubted_time_us) > _DOUBT_S:
            add_velocity_variance(ekf.covariance, i, vel.innov)
        ekf.rows[i].odometer.doubted_time_us = now_us
    return seconds_since(now_us, ekf.rows[i].odometer.doubted_time_us) < _DOUBT_S


@wp.func
def give_way(ekf: Ekf, i: int, now_us: wp.int64, roll: Rolling, vel_frd: wp.vec3) -> None:
    """Velocity becomes as uncertain as the wheels have long found it wrong, where nothing else measures it."""
    if ekf.rows[i].manoeuvre_level > 1.0:
        ekf.rows[i].odometer.struck_time_us = now_us
    if ekf.rows[i].external_vel.is_active == 1:
        return
    if seconds_since(now_us, ekf.rows[i].gnss_vel.fused_time_us) < DEAD_RECKONING_AFTER_S:
        return
    patience_s = _STARVED_S
    if seconds_since(now_us, ekf.rows[i].odometer.struck_time_us) < _STARVED_S:
        patience_s = _STRUCK_S
    error_frd = wp.vec3()
    if seconds_since(now_us, ekf.rows[i].wheels.fused_time_us) > patience_s:
        error_frd[0] = roll.speed - vel_frd[0]
    if seconds_since(now_us, ekf.rows[i].wheel_side.fused_time_us) > patience_s:
        error_frd[1] = roll.side - vel_frd[1]
        error_frd[2] = roll.up - vel_frd[2]
    if wp.length_sq(error_frd) > 0.0:
        error_ned = wp.quat_rotate(ekf.rows[i].nominal.q_ned_from_frd, error_frd)
        add_velocity_variance(ekf.covariance, i, error_ned)


@wp.func
def take_wheels(ekf: Ekf, i: int, params: EstimatorParams, now_us: wp.int64, gyro_frd: wp.vec3) -> None:
    """Fuses the oldest waiting sample if the horizon has passed it."""
    sample = ekf.wheels_ring[i, ekf.rows[i].wheels_inbox.tail % WHEELS_RING]
    if sample.time_us > now_us:
        return
    ekf.rows[i].wheels_inbox.tail += 1
    if params.wheel_ctrl == 0 or seconds_since(now_us, sample.time_us) > MAX_AGE_S:
        return
    if ekf.rows[i].odometer.learned_time_us == wp.int64(0):
        var = params.wheel_scale_std * params.wheel_scale_std
        ekf.rows[i].odometer.scale_var = wp.vec2(var, var)
    nominal = ekf.rows[i].nominal
    force = ekf.rows[i].stillness.accel_mean_frd
    if ekf.rows[i].is_yaw_aligned == 0 or not is_on_wheels(force, nominal.q_ned_from_frd):
        return
    if is_contradicted(ekf, i, now_us):
        return
    omega_frd = gyro_frd - nominal.gyro_bias_frd
    vel_frd = wp.quat_rotate_inv(nominal.q_ned_from_frd, nominal.vel_ned)
    roll = rolling(params, ekf.rows[i].odometer, sample, omega_frd, force, vel_frd[0])
    if (params.wheel_ctrl & WHEEL_CTRL_SCALE) != 0:
        learn_scale(ekf, i, params, sample, roll, wp.abs(omega_frd[2]))
    give_way(ekf, i, now_us, roll, vel_frd)
    if (params.wheel_ctrl & WHEEL_CTRL_SPEED) != 0:
        measured, std = wp.vec2(roll.speed, 0.0), wp.vec2(roll.std, 0.0)
        nominal, aid = fuse_axes(
            params, ekf.covariance, i, nominal, ekf.rows[i].wheels, sample.time_us, 0, measured, std
        )
        ekf.rows[i].wheels = aid
    if (params.wheel_ctrl & WHEEL_CTRL_SIDE) != 0:
        measured, std = wp.vec2(roll.side, roll.up), wp.vec2(roll.side_std, roll.up_std)
        nominal, aid = fuse_axes(
            params, ekf.covariance, i, nominal, ekf.rows[i].wheel_side, sample.time_us, 1, measured, std
        )
        ekf.rows[i].wheel_side = aid
    ekf.rows[i].nominal = nominal


WHEELS = SensorSpec(
    name="wheels",
    label="wheel encoders",
    Sample=WheelSample,
    ring_size=WHEELS_RING,
    aids=(AidSpec("wheels", 1, "m/s", {}), AidSpec("wheel_side", 2, "m/s", {})),
    topic=SampleTopic(
        "wheel_encoders",
        {"timestamp_sample": "uint64_t", "left_m_s": "float", "right_m_s": "float"},
        {"timestamp_sample": "time_us", "left_m_s": "left_m_s", "right_m_s": "right_m_s"},
    ),
    is_optional=True,
    parameter="EKF2_WHL_CTRL",
    bias_unit="m/s",
    wrong_bias=5.0,
)
