"""The estimator's state: what it believes, how sure it is, and how each source of measurements is doing.

One `EstimatorState` per vehicle lives in `Ekf.rows`; the covariance and the rings of waiting samples are arrays of
their own, because they are indexed. All of it is written by `estimator_step` alone, but for the newest external
sample; the host reads.

Error state and covariance order: attitude (rotation vector in ned) 0-2, velocity 3-5, position 6-8, gyro bias 9-11,
accelerometer bias 12-14, earth field 15-17, body field 18-20, wind north and east 21-22, terrain 23. Then four
slow errors of sensors. No motion changes them, so they are kept at the border of the matrix: rows 24-27 are their
covariances with the 24 errors, row 28 holds those among themselves, 4 x 4.
"""

import warp as wp

from autopilot.estimator.params import EstimatorParams
from autopilot.ports import (
    BaroSample,
    Estimate,
    ExternalSample,
    GnssSample,
    ImuSample,
    MagSample,
    RangeSample,
    WheelSample,
)
from common.kernels import vec5, vec24

wp.set_module_options({"enable_backward": False})

ATT = wp.constant(0)
VEL = wp.constant(3)
POS = wp.constant(6)
GYRO_BIAS = wp.constant(9)
ACCEL_BIAS = wp.constant(12)
EARTH = wp.constant(15)
BODY = wp.constant(18)
WIND = wp.constant(21)
TERRAIN = wp.constant(23)

# Slow errors: GNSS position north, east, down, and barometer height (down)
SLOW_COUNT = wp.constant(4)
SLOW_BARO = wp.constant(3)
SLOW = wp.constant(24)  # row of the covariance: of slow error j with the error state, in row SLOW + j
SLOW_COV = wp.constant(28)  # row of the covariance: of slow errors j and k, in element 4 j + k
COV_ROWS = 29

# Ring sizes are powers of two, so that a running count modulo the size stays cheap.
IMU_RING = wp.constant(64)  # 256 ms at 250 Hz
GNSS_RING = wp.constant(4)
BARO_RING = wp.constant(16)
MAG_RING = wp.constant(16)
RANGE_RING = wp.constant(16)
WHEELS_RING = wp.constant(16)
EXTERNAL_RING = wp.constant(16)  # one in each 20 ms frame

PHASE_ALIGNING = wp.constant(0)
PHASE_RUNNING = wp.constant(1)


@wp.struct
class Nominal:
    """The nominal state at the delayed horizon."""

    q_ned_from_frd: wp.quat
    vel_ned: wp.vec3  # [m/s]
    pos_ned: wp.vec3  # [m]
    gyro_bias_frd: wp.vec3  # [rad/s]
    accel_bias_frd: wp.vec3  # [m/s²]
    holds_accel_bias: int  # the manoeuvre is too hard to learn it
    earth_field_ned: wp.vec3  # [gauss]
    body_field_frd: wp.vec3  # [gauss] hard iron
    wind_ned: wp.vec3  # [m/s] down component 0
    terrain_d: float  # [m] ned down coordinate of the ground below
    slow: wp.vec4  # [m] slow errors: measured minus true
    reset_count: int  # grows when position, velocity or heading is set instead of corrected
    pos_jump_ned: wp.vec3  # [m] of the resets in this step
    vel_jump_ned: wp.vec3  # [m/s]
    yaw_jump: float  # [rad]


@wp.struct
class Inbox:
    """The samples of one sensor that wait for the horizon, and whether the sensor still lives."""

    arrived_time_us: wp.int64  # validity time of the newest sample
    head: int  # samples put into the ring so far
    tail: int  # samples taken out of it so far
    repeat_count: int  # equal values in a row
    change_count: int  # differing values in a row, at rest
    moved: wp.vec3  # what the estimate says the vehicle has moved since the value changed last
    resolves_noise: int  # at rest each value differed from the one before: this sensor shows its noise
    is_stuck: int  # the value no longer changes, and should


@wp.struct
class Aid:
    """How one source of measurements is doing. Times are those of validity of the samples, not of their arrival."""

    innov: wp.vec3  # measured minus predicted, before fusion
    innov_var: wp.vec3
    judged_time_us: wp.int64  # last sample whose innovation was computed
    fused_time_us: wp.int64  # last sample that passed its gate and was fused, 0: never
    is_active: int
    reject_count: int  # rejected samples in a row
    reset_count: int
    test_ratio: float  # largest innov² / (gate² innov_var) of the last sample; above 1 is rejected
    test_ratio_lpf: float
    noise_scale: float  # by which the source's noise variance exceeds its parameter, from 1


@wp.struct
class Alignment:
    """Sums over the time in which attitude, field and pressure are averaged."""

    waited_s: float  # since power-on
    is_moving: int  # the newest IMU sample is not one of a vehicle at rest
    time_s: float  # averaged
    accel_frd: wp.vec3  # [m/s² s] integral
    gyro_frd: wp.vec3  # [rad] integral
    mag_frd: wp.vec3  # [gauss] sum
    mag_count: int
    mag_time_us: wp.int64
    baro_height: float  # [m] sum
    baro_count: int
    baro_time_us: wp.int64


@wp.struct
class Stillness:
    """Is the vehicle at rest?"""

    gyro_mean_frd: wp.vec3  # [rad/s]
    accel_mean_frd: wp.vec3  # [m/s²]
    gyro_var: float  # [(rad/s)²] about the mean, the three axes together
    accel_var: float  # [(m/s²)²]
    still_s: float  # for how long the IMU has shown no vibration and no turn
    accel_recent: wp.vec3  # [m/s²] specific force in the gyro's frame, mean of seconds
    accel_before: wp.vec3  # [m/s²] slower mean of that one: a velocity gained shows as their difference
    gnss_vel_ned: wp.vec3  # [m/s] low-passed
    baro_height: float  # [m] tracked
    baro_climb: float  # [m/s]
    contact: int  # CONTACT_*: what the commander says
    calm_s: float  # for how long nothing has spoken of motion
    stand_s: float  # for how long the wheels of both sides have stood
    stand_m: wp.vec2  # [m] left, right: what they have crept meanwhile
    is_rolling: int  # the wheels of both sides turn
    is_parked: int  # they have stood for some tenths of a second
    has_moved: int  # since power-on, since the commander said that the vehicle has landed, or its wheels stopped
    is_still: int  # at rest: velocity is zero


@wp.struct
class Output:
    """The output predictor: integrals of the IMU without any correction, and the correction that is added to them.

    Adding a correction to all past states at once is the same as adding it to the integrals as they are read, so the
    ring of past states never has to be rewritten.
    """

    q_raw: wp.quat
    vel_raw_ned: wp.vec3
    pos_raw_ned: wp.vec3
    q_correction: wp.quat
    vel_correction_ned: wp.vec3
    pos_correction_ned: wp.vec3


@wp.struct
class OutputSample:
    """The raw integrals just after one IMU sample."""

    q_raw: wp.quat
    vel_raw_ned: wp.vec3
    pos_raw_ned: wp.vec3


@wp.struct
class DragSum:
    """Specific force integrated since the last drag fusion."""

    accel_frd: wp.vec3  # [m/s² s]
    time_s: float
    ground_d: float  # [m] down coordinate where the vehicle last stood still


@wp.struct
class Odometer:
    """What is known of the wheels themselves, left and right."""

    scale: wp.vec2  # by which fraction they turn too little
    scale_var: wp.vec2
    learned_time_us: wp.int64  # of the GNSS velocity that the scale was last learned from, 0: never
    doubted_time_us: wp.int64  # when GNSS velocity last contradicted them, 0: never
    struck_time_us: wp.int64  # of the last blow, 0: none


@wp.struct
class YawEstimator:
    """Tilt without heading, and five filters that know no heading at first; see `yaw_estimator.py`."""

    q_level_from_frd: wp.quat  # to a level frame that stands still and whose heading is unknown
    gyro_bias_frd: wp.vec3  # [rad/s]
    delta_angle_frd: wp.vec3  # [rad] summed since the attitude was renewed
    delta_vel_frd: wp.vec3  # [m/s]
    step_s: float  # over which they were summed
    delta_vel_level: wp.vec3  # [m/s] summed since the last fix
    since_fix_s: float
    fix_time_us: wp.int64  # of the last fix
    fix_vel_ned: wp.vec3  # [m/s] its velocity
    is_running: int  # the five filters have started
    running_s: float  # since the vehicle was last at rest
    yaw: vec5  # [rad] heading of the level frame's x axis
    vel_north: vec5  # [m/s]
    vel_east: vec5  # [m/s]
    p_nn: vec5  # covariance of velocity north, east and heading
    p_ne: vec5
    p_ny: vec5
    p_ee: vec5
    p_ey: vec5
    p_yy: vec5
    weight: vec5  # probabilities
    innov_north: vec5  # [m/s]
    innov_east: vec5  # [m/s]
    ratio: vec5  # squared innovations over their variances: 2 expected
    ratio_lpf: float  # of the weighted sum, halved: 1 expected
    yaw_level: float  # [rad] weighted heading of the level frame's x axis
    yaw_var: float  # [rad²]
    has_moved: int  # the IMU has shown vibration or a turn since the vehicle was aligned
    main_ratio_lpf: float  # of the main filter's at the same fixes
    disagree_s: float  # for how long the main filter's heading has differed by more than both can explain


@wp.struct
class AirspeedCheck:
    """Is the pitot tube to be believed?"""

    sample_us: wp.int64  # of the newest sample
    pressure_pa: float
    changed_us: wp.int64  # when its value last changed, or the vehicle stood
    wind_ne: wp.vec2  # [m/s] mean, of a tube that is believed
    wind_count: float  # samples in it
    is_contradicted: int  # by the motion over ground
    doubted_us: wp.int64  # since when; 0: it is not
    passed_us: wp.int64  # since when it is not; 0: it is
    is_failed: int


@wp.struct
class EstimatorState:
    """The estimator of one vehicle, without its covariance and rings."""

    phase: int  # PHASE_*
    time_us: wp.int64  # of the newest IMU sample
    horizon_time_us: wp.int64  # of the nominal state
    imu_head: int  # IMU samples put into the ring so far, modulo 2^30; the newest is (imu_head - 1) % IMU_RING
    imu_tail: int  # IMU samples taken out of it so far, likewise
    nominal: Nominal
    step_dt_s: float  # since the last covariance prediction
    step_delta_vel_ned: wp.vec3  # [m/s] specific force integrated since then
    step_delta_angle_frd: wp.vec3  # [rad] turned since then
    manoeuvre_level: float  # decaying maximum of specific force and angular rate, each over its limit
    output: Output
    alignment: Alignment
    stillness: Stillness
    gnss_inbox: Inbox
    baro_inbox: Inbox
    mag_inbox: Inbox
    range_inbox: Inbox
    wheels_inbox: Inbox
    external_inbox: Inbox
    gnss_pos: Aid  # north, east [m]
    gnss_vel: Aid  # north, east, down [m/s]
    gnss_height: Aid  # down [m]
    baro: Aid  # down [m]
    mag: Aid  # x, y, z [gauss]
    range: Aid  # along body down [m]
    wheels: Aid  # along body x [m/s]
    wheel_side: Aid  # none along body y, z [m/s]
    odometer: Odometer
    drag: Aid  # x, y [m/s²]
    rest: Aid  # zero velocity while the vehicle stands still [m/s]
    external_pos: Aid  # north, east [m]
    external_height: Aid  # down [m]
    external_vel: Aid  # north, east, down [m/s]
    external_yaw: Aid  # [rad]
    airspeed: AirspeedCheck
    external_reset_count: int  # of the last external sample used
    doubted_time_us: wp.int64  # when the accelerometer last contradicted GNSS and barometer, 0: never
    climb_innov_lpf: float  # [m/s] of the GNSS velocity, down
    wander_time_us: wp.int64  # to which the GNSS wander was propagated
    drag_sum: DragSum
    is_yaw_aligned: int
    is_mag_disturbed: int  # not the local field
    is_mag_faulty: int  # heading was reset against the magnetometer; it is not used until it agrees again
    mag_stale_s: float  # for how long it has contradicted the heading that it alone had set
    mag_agree_s: float  # for how long a faulty magnetometer has agreed
    baro_drift_var: float  # [m²] how far the barometer may have drifted since its reference height was taken
    origin_baro_height: float  # [m] standard-atmosphere height of the ned origin
    fault_count: int  # times the covariance lost its shape and was started anew
    estimate: Estimate


@wp.struct
class Ekf:
    """Everything the estimator keeps, one row per vehicle."""

    rows: wp.array(dtype=EstimatorState)
    yaw: wp.array(dtype=YawEstimator)
    params: wp.array(dtype=EstimatorParams)
    covariance: wp.array2d(dtype=vec24)  # row r of vehicle i is covariance[i, r], COV_ROWS of them
    imu_ring: wp.array2d(dtype=ImuSample)
    output_ring: wp.array2d(dtype=OutputSample)
    gnss_ring: wp.array2d(dtype=GnssSample)
    baro_ring: wp.array2d(dtype=BaroSample)
    mag_ring: wp.array2d(dtype=MagSample)
    range_ring: wp.array2d(dtype=RangeSample)
    wheels_ring: wp.array2d(dtype=WheelSample)
    external: wp.array(dtype=ExternalSample)  # the newest, written by the Python part
    external_ring: wp.array2d(dtype=ExternalSample)
