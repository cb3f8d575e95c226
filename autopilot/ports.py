"""The flight controller's connectors: what goes in, what comes out.

In: `Samples` from sensor drivers (a simulator, a log or a board) at each tick, `Setpoint` and `ExternalSample` from the
Python part at each frame. Out: `Estimate`, and `Actuators` at each tick. Each is one row per vehicle. Frames are ned
(local tangent plane whose origin is the home the vehicle boots at) and frd; units SI unless the name says otherwise.
A sample is new when its `time_us` differs from that of the last one used; 0 means never measured.
"""

import warp as wp

from common.kernels import vec8

wp.set_module_options({"enable_backward": False})

# Setpoint.kind
SETPOINT_IDLE = wp.constant(0)  # motors stopped when disarmed, at idle when armed
SETPOINT_TRAJECTORY = wp.constant(1)  # position, velocity, acceleration, yaw; smoothed by the trajectory generator
SETPOINT_ATTITUDE = wp.constant(2)  # attitude (yaw by rate where yaw_rate is finite) and thrust
SETPOINT_RATE = wp.constant(3)  # body rates and thrust
SETPOINT_LEAN = wp.constant(4)  # roll and pitch as an attitude; yaw rate, height or climb rate by the trajectory
SETPOINT_DRIVE = wp.constant(5)  # along the nose: speed, or throttle; and heading, yaw rate or steering
SETPOINT_STICKS = wp.constant(6)  # of a plane: ailerons, elevator and rudder as omega_frd has them, and throttle

# What the commander says of the vehicle
CONTACT_UNKNOWN = wp.constant(0)  # nobody says, as in a replay
CONTACT_GROUND = wp.constant(1)
CONTACT_NONE = wp.constant(2)  # in the air, or driving

# Estimate.flags
TILT_ALIGNED = wp.constant(1)
YAW_ALIGNED = wp.constant(2)
VELOCITY_VALID = wp.constant(4)
POSITION_VALID = wp.constant(8)  # horizontal
HEIGHT_VALID = wp.constant(16)
TERRAIN_VALID = wp.constant(32)
WIND_VALID = wp.constant(64)
DEAD_RECKONING = wp.constant(128)
EXTERNAL_POSITION = wp.constant(256)  # a client's horizontal position is being fused
ACCEL_DOUBTED = wp.constant(512)
MAG_DISTURBED = wp.constant(1024)  # the field is not that of the position
AIRSPEED_VALID = wp.constant(4096)
MAG_FAULTY = wp.constant(2048)  # heading was reset against the magnetometer, which does not agree yet

# ExternalSample.holds: the bits of EKF2_EV_CTRL
EXTERNAL_HOLDS_POS = wp.constant(1)  # north and east
EXTERNAL_HOLDS_HEIGHT = wp.constant(2)
EXTERNAL_HOLDS_VEL = wp.constant(4)
EXTERNAL_HOLDS_YAW = wp.constant(8)


@wp.struct
class ImuSample:
    """Mean angular rate and specific force over the last `dt_s`."""

    time_us: wp.int64
    dt_s: float
    gyro_frd: wp.vec3  # [rad/s]
    accel_frd: wp.vec3  # [m/s²], specific force: (0, 0, -9.8) at rest and level


@wp.struct
class GnssSample:
    """A navigation solution, projected by the driver on the tangent plane of the boot home."""

    time_us: wp.int64  # time of validity; the sample arrives later
    fix_type: int  # as MAVLink GPS_FIX_TYPE: 0 no receiver, 1 no fix, 3 3-D
    satellites: int
    pos_ned: wp.vec3  # [m]
    vel_ned: wp.vec3  # [m/s]
    pos_h_std: float  # [m] receiver's own accuracy figures
    pos_v_std: float  # [m]
    vel_std: float  # [m/s]


@wp.struct
class BaroSample:
    time_us: wp.int64
    pressure_pa: float
    temperature_c: float


@wp.struct
class MagSample:
    time_us: wp.int64
    field_frd_gauss: wp.vec3


@wp.struct
class RangeSample:
    """Distance along body down."""

    time_us: wp.int64
    distance_m: float
    is_valid: int  # 0: out of range or no return


@wp.struct
class ExternalSample:
    """Where a client (motion capture, visual odometry) says that the vehicle is."""

    time_us: wp.int64  # time of validity; the sample arrives later
    holds: int  # EXTERNAL_HOLDS_* bits of what it tells; the rest is 0
    reset_count: int  # grows when the client has set its answer anew
    pos_ned: wp.vec3  # [m]
    vel_ned: wp.vec3  # [m/s]
    yaw: float  # [rad]
    pos_h_std: float  # [m]
    pos_v_std: float  # [m]
    vel_std: float  # [m/s]
    yaw_std: float  # [rad]


@wp.struct
class WheelSample:
    """How fast the ground goes by under the wheels of either side, as their encoders count it; slip included."""

    time_us: wp.int64
    left_m_s: float  # forward
    right_m_s: float


@wp.struct
class AirspeedSample:
    """Of a pitot tube along the nose."""

    time_us: wp.int64  # 0: the vehicle has none
    pressure_pa: float  # dynamic: total less static


@wp.struct
class BatterySample:
    time_us: wp.int64
    voltage_v: float
    current_a: float


@wp.struct
class Samples:
    """The latest sample of every sensor."""

    imu: ImuSample
    gnss: GnssSample
    baro: BaroSample
    mag: MagSample
    range: RangeSample
    wheels: WheelSample
    airspeed: AirspeedSample
    battery: BatterySample


@wp.struct
class Setpoint:
    """What the vehicle shall do. NaN frees an element, as in PX4's trajectory_setpoint."""

    kind: int  # SETPOINT_*
    is_armed: int
    is_landed: int  # landed: integrators stay reset and the trajectory stays at the estimate
    pos_ned: wp.vec3  # [m]
    vel_ned: wp.vec3  # [m/s]
    accel_ned: wp.vec3  # [m/s²]
    yaw: float  # [rad]
    yaw_rate: float  # [rad/s]
    path_start_ned: wp.vec3  # [m] finite: keep to the straight line from here to pos_ned
    cruise_speed: float  # [m/s] horizontal, NaN: the class's own; negative: backwards, for what can
    climb_speed: float  # [m/s] up, NaN: the class's own
    descend_speed: float  # [m/s] down, NaN: the class's own
    exit_speed: float  # [m/s] speed with which pos_ned may be passed, 0: stop there
    pass_radius: float  # [m] from pos_ned, where exit_speed shall be reached: a vehicle on wheels turns from there on;
    # of a plane the radius of its circle round pos_ned, where it is on no line: negative to the left, 0 the class's own
    q_ned_from_frd: wp.quat  # SETPOINT_ATTITUDE; SETPOINT_LEAN: its heading is not used
    omega_frd: wp.vec3  # [rad/s] SETPOINT_RATE; SETPOINT_STICKS: [-1..1] roll right, pitch up, yaw right
    thrust: float  # [0..1] fraction of the maximum thrust; SETPOINT_DRIVE: throttle [-1..1] where `speed` is NaN
    speed: float  # [m/s] SETPOINT_DRIVE: along the nose, negative backwards
    steering: float  # [-1..1] SETPOINT_DRIVE: to the right, where `yaw` and `yaw_rate` are NaN
    ahead_max: float  # [m/s] speed along the nose that leaves room to stop, for what drives; 0: any, negative: none
    back_max: float  # [m/s] and backwards
    motor_test: vec8  # [0..1] commands of the motors while the vehicle is disarmed, not otherwise


@wp.func
def contact(setpoint: Setpoint) -> int:
    """CONTACT_* by a setpoint; a vehicle that was disarmed in the air may be anywhere."""
    if setpoint.is_landed == 1:
        return CONTACT_GROUND
    if setpoint.is_armed == 1:
        return CONTACT_NONE
    return CONTACT_UNKNOWN


@wp.struct
class Estimate:
    """The estimator's answer, predicted to the latest IMU sample."""

    time_us: wp.int64
    flags: int
    q_ned_from_frd: wp.quat
    omega_frd: wp.vec3  # [rad/s] bias removed
    accel_frd: wp.vec3  # [m/s²] specific force, bias removed
    vel_ned: wp.vec3  # [m/s]
    pos_ned: wp.vec3  # [m]
    accel_ned: wp.vec3  # [m/s²] gravity removed
    gyro_bias_frd: wp.vec3  # [rad/s]
    accel_bias_frd: wp.vec3  # [m/s²]
    wind_ned: wp.vec3  # [m/s] air over ground, down component 0
    terrain_d: float  # [m] ned down coordinate of the ground below
    airspeed: float  # [m/s] as indicated by the pitot tube, where AIRSPEED_VALID
    pos_h_std: float  # [m]
    pos_v_std: float  # [m]
    vel_std: float  # [m/s]
    tilt_std: float  # [rad]
    yaw_std: float  # [rad]
    reset_count: int  # grows when position, velocity or heading jumps
    pos_reset_ned: wp.vec3  # [m] the last jump
    vel_reset_ned: wp.vec3  # [m/s]
    yaw_reset: float  # [rad]


@wp.struct
class Actuators:
    """Motor commands, and the setpoints actually flown (for telemetry and logs)."""

    command: vec8  # [0..1] or [-1..1] per output, as its class says: what an ESC or a servo receives
    traj_pos_ned: wp.vec3
    traj_vel_ned: wp.vec3
    traj_accel_ned: wp.vec3
    traj_yaw: float
    traj_yaw_rate: float
    q_sp_ned_from_frd: wp.quat
    omega_sp_frd: wp.vec3
    thrust_sp: float  # [0..1]
    torque_sp_frd: wp.vec3  # [N m]
    torque_unallocated_frd: wp.vec3  # [N m] asked for and not achieved
