"""Telemetry of motion: attitude, position, speed, and the setpoints being flown."""

from math import hypot, isfinite, nan

from autopilot.interface.vehicle_state import Mode, VehicleState
from autopilot.mavlink.wire.codec import known_type
from autopilot.mavlink.wire.convert import (
    degrees_e7,
    heading_centideg,
    i16,
    i32,
    u16,
    wxyz_from_quat,
)
from autopilot.ports import (
    AIRSPEED_VALID,
    HEIGHT_VALID,
    POSITION_VALID,
    TERRAIN_VALID,
    VELOCITY_VALID,
    WIND_VALID,
    YAW_ALIGNED,
)
from common.geodesy import geodetic_from_ned

_attitude = known_type("ATTITUDE").pack
_attitude_quaternion = known_type("ATTITUDE_QUATERNION").pack
_local_position_ned = known_type("LOCAL_POSITION_NED").pack
_global_position_int = known_type("GLOBAL_POSITION_INT").pack
_vfr_hud = known_type("VFR_HUD").pack
_altitude = known_type("ALTITUDE").pack
_odometry = known_type("ODOMETRY").pack
_position_target_local_ned = known_type("POSITION_TARGET_LOCAL_NED").pack
_position_target_global_int = known_type("POSITION_TARGET_GLOBAL_INT").pack
_attitude_target = known_type("ATTITUDE_TARGET").pack
_orbit_execution_status = known_type("ORBIT_EXECUTION_STATUS").pack
_wind_cov = known_type("WIND_COV").pack

LOCAL_NED = 1  # MAV_FRAME
GLOBAL_INT = 5
BODY_FRD = 12
NO_ROTATION = (0.0, 0.0, 0.0, 0.0)  # repr_offset_q: not used
_GOTO_MODES = frozenset({Mode.HOLD, Mode.GUIDED})
ESTIMATOR_TYPE_AUTOPILOT = 8  # MAV_ESTIMATOR_TYPE
UPPER_TRIANGLE = 21  # entries of a 6 x 6 symmetric matrix


def boot_ms(time_us: int) -> int:
    return time_us // 1000 & 0xFFFFFFFF


def attitude(state: VehicleState) -> bytes:
    """Roll, pitch, yaw and body rates."""
    p, q, r = state.estimate.omega_frd
    return _attitude(boot_ms(state.time_us), state.roll_rad, state.pitch_rad, state.yaw_rad, p, q, r)


def attitude_quaternion(state: VehicleState) -> bytes:
    """The attitude as a quaternion, and body rates."""
    estimate = state.estimate
    x, y, z, w = estimate.q_ned_from_frd
    p, q, r = estimate.omega_frd
    return _attitude_quaternion(boot_ms(state.time_us), w, x, y, z, p, q, r, NO_ROTATION)


def local_position_ned(state: VehicleState) -> bytes | None:
    """Position and velocity in the local frame; not before there is a position."""
    estimate = state.estimate
    if not estimate.flags & POSITION_VALID:
        return None
    return _local_position_ned(boot_ms(state.time_us), *estimate.pos_ned, *estimate.vel_ned)


def global_position_int(state: VehicleState) -> bytes | None:
    """Latitude, longitude, altitude above sea level and above home, velocity, heading."""
    estimate = state.estimate
    if not estimate.flags & POSITION_VALID:
        return None
    position = state.position
    north, east, down = estimate.vel_ned
    return _global_position_int(
        boot_ms(state.time_us),
        degrees_e7(position.lat_deg),
        degrees_e7(position.lon_deg),
        i32(position.alt_m * 1000.0),
        i32(height_above_home(state) * 1000.0),
        i16(north * 100.0),
        i16(east * 100.0),
        i16(down * 100.0),
        heading_centideg(state.yaw_rad if estimate.flags & YAW_ALIGNED else nan),
    )


def height_above_home(state: VehicleState) -> float:
    """[m]; above the origin until a home is set."""
    return state.position.alt_m - (state.home.alt_m if state.home else state.origin.alt_m)


def vfr_hud(state: VehicleState) -> bytes:
    """Speed through the air (measured or by the wind, else 0), over ground, heading, altitude, climb rate, throttle."""
    estimate = state.estimate
    north, east, down = estimate.vel_ned
    ground_speed = hypot(north, east)
    air_speed = 0.0  # as autopilots without an airspeed sensor send it: not every display can draw a NaN
    if estimate.flags & AIRSPEED_VALID:
        air_speed = max(estimate.airspeed, 0.0)
    elif estimate.flags & WIND_VALID:
        wind_north, wind_east, _ = estimate.wind_ned
        air_speed = hypot(north - wind_north, east - wind_east, down)
    return _vfr_hud(
        air_speed,
        ground_speed,
        heading_centideg(state.yaw_rad) // 100 % 360,
        u16(state.actuators.thrust_sp * 100.0) if state.is_armed else 0,
        state.position.alt_m,
        -down,
    )


def altitude(state: VehicleState) -> bytes | None:
    """Altitude above sea level, home and ground."""
    estimate = state.estimate
    if not estimate.flags & HEIGHT_VALID:
        return None
    down = estimate.pos_ned[2]
    has_terrain = estimate.flags & TERRAIN_VALID
    amsl = state.position.alt_m
    return _altitude(
        state.time_us,
        amsl,
        amsl,
        -down,
        height_above_home(state),
        state.origin.alt_m - estimate.terrain_d if has_terrain else nan,
        estimate.terrain_d - down if has_terrain else nan,
    )


def wind_cov(state: VehicleState) -> bytes | None:
    """The estimated wind."""
    estimate = state.estimate
    if not estimate.flags & WIND_VALID:
        return None
    north, east, down = estimate.wind_ned
    return _wind_cov(state.time_us, north, east, down, nan, nan, state.position.alt_m, nan, nan)


def odometry(state: VehicleState) -> bytes | None:
    """Position, velocity in body axes, attitude, with their variances."""
    estimate = state.estimate
    if not estimate.flags & POSITION_VALID:
        return None
    pose_covariance = [nan] * UPPER_TRIANGLE
    pose_covariance[0] = pose_covariance[6] = estimate.pos_h_std**2
    pose_covariance[11] = estimate.pos_v_std**2
    pose_covariance[15] = pose_covariance[18] = estimate.tilt_std**2
    pose_covariance[20] = estimate.yaw_std**2
    velocity_covariance = [nan] * UPPER_TRIANGLE
    velocity_covariance[0] = velocity_covariance[6] = velocity_covariance[11] = estimate.vel_std**2
    return _odometry(
        state.time_us,
        LOCAL_NED,
        LOCAL_NED,  # the velocity's frame
        *estimate.pos_ned,
        wxyz_from_quat(estimate.q_ned_from_frd),
        *estimate.vel_ned,
        *estimate.omega_frd,
        pose_covariance,
        velocity_covariance,
        estimate.reset_count & 0xFF,
        ESTIMATOR_TYPE_AUTOPILOT,
        100 if estimate.flags & VELOCITY_VALID else 0,
    )


def _free_mask(state: VehicleState) -> int:
    """type_mask of the trajectory being flown: a bit for each element that is NaN."""
    actuators = state.actuators
    elements = (
        *actuators.traj_pos_ned,
        *actuators.traj_vel_ned,
        *actuators.traj_accel_ned,
        0.0,  # the bit that would make accelerations forces
        actuators.traj_yaw,
        actuators.traj_yaw_rate,
    )
    return sum(1 << i for i, element in enumerate(elements) if not isfinite(element))


def position_target_local_ned(state: VehicleState) -> bytes | None:
    """The trajectory being flown, in the local frame."""
    if not state.is_armed:
        return None
    actuators = state.actuators
    return _position_target_local_ned(
        boot_ms(state.time_us),
        LOCAL_NED,
        _free_mask(state),
        *actuators.traj_pos_ned,
        *actuators.traj_vel_ned,
        *actuators.traj_accel_ned,
        actuators.traj_yaw,
        actuators.traj_yaw_rate,
    )


def position_target_global_int(state: VehicleState) -> bytes | None:
    """The trajectory being flown, in global coordinates; on the way to a goto's target its position is the target's."""
    if not state.is_armed:
        return None
    actuators = state.actuators
    is_goto = state.mode in _GOTO_MODES and isfinite(state.path_start_ned[0])
    north, east, down = state.goal_ned if is_goto else actuators.traj_pos_ned
    lat_deg = lon_deg = nan
    alt_amsl_m = state.origin.alt_m - down
    if isfinite(north) and isfinite(east) and isfinite(down):
        lat_deg, lon_deg, alt_amsl_m = geodetic_from_ned(north, east, down, state.origin)
    return _position_target_global_int(
        boot_ms(state.time_us),
        GLOBAL_INT,
        _free_mask(state),
        degrees_e7(lat_deg),
        degrees_e7(lon_deg),
        alt_amsl_m,
        *actuators.traj_vel_ned,
        *actuators.traj_accel_ned,
        actuators.traj_yaw,
        actuators.traj_yaw_rate,
    )


def attitude_target(state: VehicleState) -> bytes | None:
    """Attitude, body rates and thrust being flown."""
    if not state.is_armed:
        return None
    actuators = state.actuators
    return _attitude_target(
        boot_ms(state.time_us),
        0,
        wxyz_from_quat(actuators.q_sp_ned_from_frd),
        *actuators.omega_sp_frd,
        actuators.thrust_sp,
    )


def orbit_execution_status(state: VehicleState) -> bytes | None:
    """The circle of mode Orbit, while it is flown."""
    orbit = state.orbit
    if orbit is None:
        return None
    centre = orbit.centre
    return _orbit_execution_status(
        state.time_us, orbit.radius_m, 0, degrees_e7(centre.lat_deg), degrees_e7(centre.lon_deg), centre.alt_m
    )
