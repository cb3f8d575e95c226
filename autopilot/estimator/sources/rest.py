"""Rest: while nothing speaks of motion, velocity is zero.

Holds tilt and biases together from alignment until GNSS takes over, and again after landing.

A smooth drive, climb or hover looks to an IMU like rest: only the change from one to the other shows. So rest ends with
any sign of motion: vibration, a turn, velocity gained by the accelerometer, GNSS velocity, barometer climb; and never
is while the commander says that the vehicle is in the air. It comes back when all of them, filtered, and the estimate
have been quiet for seconds, or at once with a landing that the commander tells of. GNSS alone would not do: a
threshold above its noise lets a slow climb pass.

Wheels say it better: where they turn the vehicle moves, and where both sides stand it is at rest as soon as the IMU is
quiet, whatever the commander says, unless GNSS velocity contradicts (it slides, or is carried). What stands on its
wheels does not turn either: the gyro shows its bias, and so heading is held for as long as it is parked.
"""

import warp as wp

from autopilot.estimator.fuse import fuse_state, judge, mark_fused, seconds_since
from autopilot.estimator.params import EstimatorParams
from autopilot.estimator.sources.baro import baro_height
from autopilot.estimator.state import GYRO_BIAS, PHASE_RUNNING, VEL, Aid, Ekf, Nominal, Stillness
from autopilot.estimator.wheel_params import WHEEL_CTRL_REST
from autopilot.ports import CONTACT_GROUND, CONTACT_NONE, BaroSample, GnssSample, ImuSample, Samples, WheelSample
from common.geodesy import GRAVITY_M_S2
from common.kernels import TICK_S, vec24

wp.set_module_options({"enable_backward": False})

_STD = wp.constant(0.1)  # [m/s]
# What is fused 25 times a second has an error that does not change: a creep below the limits that follow. So velocity
# is never taken for better known than that.
_CREEP_STD = wp.constant(0.05)  # [m/s]
_LANDED_CREEP_STD = wp.constant(0.02)  # [m/s] where the commander says that it stands
_STIRRED_STD = wp.constant(0.1)  # [m/s] what velocity may have become when a sign of motion is seen
_GATE_SIGMA = wp.constant(5.0)
_PERIOD_S = wp.constant(0.0399)
_AVERAGE_S = wp.constant(0.1)  # time constant of the running means
# guess: between a BMI088 at rest (gyro 0.005 rad/s, accelerometer 0.05 m/s², three axes) and a hovering airframe
_MAX_GYRO_VAR = wp.constant(4.0e-4)  # [(rad/s)²]
_MAX_ACCEL_VAR = wp.constant(0.02)  # [(m/s²)²]
_MAX_RATE = wp.constant(0.05)  # [rad/s] bias included
_MAX_GRAVITY_ERROR = wp.constant(0.5)  # [m/s²]

# Signs of motion. Each limit is above four deviations of its filtered noise, with the default sensors.
_ACCEL_SAMPLES = wp.constant(8)  # its means of seconds take what the running mean of 0.1 s is at 31 Hz
_RECENT_S = wp.constant(2.0)  # within which velocity is gained
_BEFORE_S = wp.constant(10.0)
_MAX_GAIN = wp.constant(0.06)  # [m/s] gained by the accelerometer; noise of the default IMU at rest: 0.01
_GNSS_S = wp.constant(2.0)  # time constant
_GNSS_STEP_S = wp.constant(0.2)  # a fix after a longer gap counts no more
_MAX_GNSS_SPEED = wp.constant(0.15)  # [m/s] noise 0.02 per axis
_BARO_S = wp.constant(2.0)  # time constant
_BARO_GAP_S = wp.constant(1.0)
_MAX_CLIMB = wp.constant(0.1)  # [m/s] noise 0.01
_MAX_SPEED = wp.constant(0.2)  # [m/s] by the estimate, to be found at rest again
_STILL_AFTER_S = wp.constant(0.4)  # from power-on
_STILL_AGAIN_AFTER_S = wp.constant(3.0)  # the filters have forgotten most of a motion

_ROLL_SPEED = wp.constant(0.05)  # [m/s] above one step of an encoder in 20 ms; guess
_STAND_M = wp.constant(0.004)  # [m] crept while they stand: 0.013 m/s are not called rest; guess
_PARKED_AFTER_S = wp.constant(0.3)
_WHEELS_SILENT_S = wp.constant(0.5)
_TICK_S = wp.constant(TICK_S)


@wp.func
def observe_imu(still: Stillness, imu: ImuSample) -> Stillness:
    """Running means and variances of the IMU, and for how long they have been those of rest or of a smooth motion."""
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
    return still


@wp.func
def observe_accel(still: Stillness, q_raw: wp.quat, step_s: float) -> Stillness:
    """Slower means of the running mean of the specific force, since the IMU is quiet, in a frame of the gyro alone.

    What drives by its thrust leans, and feels nothing in its own frame; and what other sensors make of attitude, such
    as a magnetometer on steel, is no motion. The means wait for the estimator to settle.

    Args:
        still: after the newest IMU sample.
        q_raw: attitude by the gyro.
        step_s: since the last call.
    """
    force = wp.quat_rotate(q_raw, still.accel_mean_frd)
    if still.still_s > _RECENT_S and wp.length_sq(still.accel_recent) > 0.0:
        recent_change = force - still.accel_recent
        still.accel_recent = still.accel_recent + recent_change * wp.min(step_s / _RECENT_S, 1.0)
        before_change = still.accel_recent - still.accel_before
        still.accel_before = still.accel_before + before_change * wp.min(step_s / _BEFORE_S, 1.0)
    else:
        still.accel_recent = force
        still.accel_before = force
    return still


@wp.func
def observe_gnss(params: EstimatorParams, still: Stillness, sample: GnssSample, step_s: float) -> Stillness:
    """The low-passed velocity after a fix, if the receiver knows it."""
    if sample.fix_type >= params.gnss_min_fix and sample.vel_std <= params.gnss_max_vel_std:
        gain = wp.clamp(step_s, 0.0, _GNSS_STEP_S) / _GNSS_S
        still.gnss_vel_ned = still.gnss_vel_ned + gain * (sample.vel_ned - still.gnss_vel_ned)
    return still


@wp.func
def observe_baro(still: Stillness, sample: BaroSample, step_s: float) -> Stillness:
    """Height and climb after a pressure: a critically damped tracker."""
    height = baro_height(sample.pressure_pa)
    if step_s > _BARO_GAP_S or step_s < 0.0:
        still.baro_height = height
        still.baro_climb = 0.0
    else:
        fraction = step_s / _BARO_S
        error = height - still.baro_height - still.baro_climb * step_s
        still.baro_height = still.baro_height + still.baro_climb * step_s + 2.0 * fraction * error
        still.baro_climb = still.baro_climb + fraction / _BARO_S * error
    return still


@wp.func
def observe_wheels(still: Stillness, sample: WheelSample, step_s: float) -> Stillness:
    """Whether the wheels of both sides turn, and for how long they have stood; neither if only one side turns."""
    left, right = wp.abs(sample.left_m_s), wp.abs(sample.right_m_s)
    still.is_rolling = 0
    if wp.min(left, right) > _ROLL_SPEED:
        still.is_rolling = 1
    crept = still.stand_m + wp.vec2(sample.left_m_s, sample.right_m_s) * wp.min(step_s, _WHEELS_SILENT_S)
    still.stand_s = still.stand_s + wp.clamp(step_s, 0.0, _WHEELS_SILENT_S)
    if wp.max(left, right) > _ROLL_SPEED or wp.max(wp.abs(crept[0]), wp.abs(crept[1])) > _STAND_M:
        crept = wp.vec2()
        still.stand_s = 0.0
    still.stand_m = crept
    return still


@wp.func
def without_wheels(still: Stillness) -> Stillness:
    """The wheels say nothing."""
    still.is_rolling = 0
    still.stand_s = 0.0
    still.stand_m = wp.vec2()
    return still


@wp.func
def forgotten(still: Stillness) -> Stillness:
    """All signs of a motion that is over, and that linger in the filters, are forgotten."""
    still.has_moved = 0
    still.gnss_vel_ned = wp.vec3()
    still.baro_climb = 0.0
    return still


@wp.func
def shows_motion(still: Stillness, vel_ned: wp.vec3) -> bool:
    """Something other than vibration says that the vehicle moves.

    The estimate speaks only against rest that has ended: upset by another sensor, it is rest that mends it.

    Args:
        still: after the newest samples.
        vel_ned: [m/s] by the estimate.
    """
    gained = (still.accel_recent - still.accel_before) * _RECENT_S
    return (
        wp.length_sq(gained) > _MAX_GAIN * _MAX_GAIN
        or wp.length_sq(still.gnss_vel_ned) > _MAX_GNSS_SPEED * _MAX_GNSS_SPEED
        or wp.abs(still.baro_climb) > _MAX_CLIMB
        or (still.has_moved == 1 and still.is_still == 0 and wp.length_sq(vel_ned) > _MAX_SPEED * _MAX_SPEED)
    )


@wp.func
def conclude(still: Stillness, vel_ned: wp.vec3, contact: int, dt_s: float) -> Stillness:
    """Whether the vehicle is at rest."""
    was_parked = still.is_parked
    still.is_parked = 0
    if still.stand_s > _PARKED_AFTER_S:
        still.is_parked = 1
    if (contact == CONTACT_GROUND and still.contact != CONTACT_GROUND) or still.is_parked > was_parked:
        still = forgotten(still)
    still.contact = contact
    is_driving = still.is_rolling == 1 or (contact == CONTACT_NONE and still.is_parked == 0)
    if is_driving or shows_motion(still, vel_ned):
        still.has_moved = 1
        still.calm_s = 0.0
    elif still.still_s == 0.0:
        still.calm_s = 0.0
    else:
        still.calm_s = still.calm_s + dt_s
    needed_s = _STILL_AFTER_S
    if still.has_moved == 1:
        needed_s = _STILL_AGAIN_AFTER_S
    still.is_still = 0
    if still.calm_s > needed_s:
        still.is_still = 1
    return still


@wp.func
def stir(cov: wp.array2d(dtype=vec24), i: int) -> None:
    """Velocity is less certain: a vehicle taken to be at rest was not."""
    for axis in range(3):
        row = cov[i, VEL + axis]
        row[VEL + axis] = row[VEL + axis] + _STIRRED_STD * _STIRRED_STD
        cov[i, VEL + axis] = row


@wp.func
def observe_stillness(ekf: Ekf, i: int, params: EstimatorParams, samples: Samples, contact: int) -> None:
    """Takes what is new in the samples, before the inboxes have seen them."""
    still = observe_imu(ekf.rows[i].stillness, samples.imu)
    if ekf.rows[i].phase != PHASE_RUNNING:
        still.accel_recent = wp.vec3()  # the frame begins with alignment
    elif ekf.rows[i].imu_head % _ACCEL_SAMPLES == 0:
        still = observe_accel(still, ekf.rows[i].output.q_raw, float(_ACCEL_SAMPLES) * samples.imu.dt_s)
    if samples.gnss.time_us != ekf.rows[i].gnss_inbox.arrived_time_us:
        step_s = seconds_since(samples.gnss.time_us, ekf.rows[i].gnss_inbox.arrived_time_us)
        still = observe_gnss(params, still, samples.gnss, step_s)
    if samples.baro.time_us != ekf.rows[i].baro_inbox.arrived_time_us:
        step_s = seconds_since(samples.baro.time_us, ekf.rows[i].baro_inbox.arrived_time_us)
        still = observe_baro(still, samples.baro, step_s)
    if samples.wheels.time_us != wp.int64(0):
        wheels_inbox = ekf.rows[i].wheels_inbox
        silent_s = seconds_since(samples.imu.time_us, samples.wheels.time_us)
        if (params.wheel_ctrl & WHEEL_CTRL_REST) == 0 or wheels_inbox.is_stuck == 1 or silent_s > _WHEELS_SILENT_S:
            still = without_wheels(still)
        elif samples.wheels.time_us != wheels_inbox.arrived_time_us:
            still = observe_wheels(
                still, samples.wheels, seconds_since(samples.wheels.time_us, wheels_inbox.arrived_time_us)
            )
    was_still = still.is_still
    still = conclude(still, ekf.rows[i].nominal.vel_ned, contact, samples.imu.dt_s)
    if was_still == 1 and still.calm_s == 0.0:
        stir(ekf.covariance, i)
    ekf.rows[i].stillness = still


@wp.func
def fuse_rest(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    aid: Aid,
    time_us: wp.int64,
    creep_std: float,
) -> tuple[Nominal, Aid]:
    """Zero velocity in three axes, which stays uncertain by a creep."""
    var = _STD * _STD
    innov = -nominal.vel_ned
    innov_var = wp.vec3(cov[i, VEL][VEL] + var, cov[i, VEL + 1][VEL + 1] + var, cov[i, VEL + 2][VEL + 2] + var)
    aid = judge(aid, time_us, innov, innov_var, 3, _GATE_SIGMA)
    aid.is_active = 1
    if aid.test_ratio <= 1.0:
        for axis in range(3):
            if cov[i, VEL + axis][VEL + axis] > creep_std * creep_std:
                nominal = fuse_state(params, cov, i, nominal, VEL + axis, -nominal.vel_ned[axis], var)
        aid = mark_fused(aid)
    return nominal, aid


@wp.func
def fuse_no_turn(
    params: EstimatorParams, cov: wp.array2d(dtype=vec24), i: int, nominal: Nominal, gyro_frd: wp.vec3
) -> Nominal:
    """What the gyro shows of a vehicle that does not turn is its bias: as well known as a mean over the period."""
    var = params.gyro_noise * params.gyro_noise * _TICK_S / _PERIOD_S
    for axis in range(3):
        k = GYRO_BIAS + axis
        innov = gyro_frd[axis] - nominal.gyro_bias_frd[axis]
        if innov * innov < _GATE_SIGMA * _GATE_SIGMA * (cov[i, k][k] + var):
            nominal = fuse_state(params, cov, i, nominal, k, innov, var)
    return nominal


@wp.func
def take_rest(ekf: Ekf, i: int, params: EstimatorParams, now_us: wp.int64) -> None:
    """Fuses zero velocity, 25 times a second."""
    if seconds_since(now_us, ekf.rows[i].rest.judged_time_us) > _PERIOD_S:
        creep_std = _CREEP_STD
        if ekf.rows[i].stillness.contact == CONTACT_GROUND or ekf.rows[i].stillness.is_parked == 1:
            creep_std = _LANDED_CREEP_STD
        nominal, aid = fuse_rest(params, ekf.covariance, i, ekf.rows[i].nominal, ekf.rows[i].rest, now_us, creep_std)
        if ekf.rows[i].stillness.is_parked == 1:
            nominal = fuse_no_turn(params, ekf.covariance, i, nominal, ekf.rows[i].stillness.gyro_mean_frd)
        ekf.rows[i].nominal = nominal
        ekf.rows[i].rest = aid
