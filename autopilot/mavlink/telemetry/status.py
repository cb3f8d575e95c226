"""Telemetry of the vehicle as a whole: mode, health, battery, home, mission."""

from math import cos, isfinite, nan, sin
from typing import Any

from pymavlink.dialects.v20 import all as mavlink

from autopilot.estimator.sensors import FUSED_SENSORS
from autopilot.interface.platform import Host
from autopilot.interface.vehicle_state import FenceLimit, LandedState, Mode, VehicleState
from autopilot.mavlink.dialects import Dialect
from autopilot.mavlink.telemetry.motion import boot_ms
from autopilot.mavlink.wire.codec import known_type
from autopilot.mavlink.wire.convert import INT16_MAX, UINT16_MAX, bounded_int, degrees_e7, i16, i32, u16
from autopilot.ports import (
    EXTERNAL_POSITION,
    MAG_DISTURBED,
    MAG_FAULTY,
    POSITION_VALID,
    TILT_ALIGNED,
    VELOCITY_VALID,
    YAW_ALIGNED,
)

_heartbeat = known_type("HEARTBEAT").pack
_sys_status = known_type("SYS_STATUS").pack
_battery_status = known_type("BATTERY_STATUS").pack
_home_position = known_type("HOME_POSITION").pack
_gps_global_origin = known_type("GPS_GLOBAL_ORIGIN").pack
_extended_sys_state = known_type("EXTENDED_SYS_STATE").pack
_fence_status = known_type("FENCE_STATUS").pack
_mission_current = known_type("MISSION_CURRENT").pack
_current_mode = known_type("CURRENT_MODE").pack
_available_modes_monitor = known_type("AVAILABLE_MODES_MONITOR").pack
_flight_information = known_type("FLIGHT_INFORMATION").pack
_system_time = known_type("SYSTEM_TIME").pack
_winch_status = known_type("WINCH_STATUS").pack

MODES_SEQUENCE = 1  # AVAILABLE_MODES_MONITOR.seq: the list of modes never changes while the vehicle runs
MAVLINK_VERSION = 3  # of the HEARTBEAT message
# Most modes fly themselves: stabilised, guided and automatic, with a custom mode. The others are flown by sticks.
_BASE_MODE = (
    mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    | mavlink.MAV_MODE_FLAG_STABILIZE_ENABLED
    | mavlink.MAV_MODE_FLAG_GUIDED_ENABLED
    | mavlink.MAV_MODE_FLAG_AUTO_ENABLED
)
_STICKS_MODE = (
    mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    | mavlink.MAV_MODE_FLAG_STABILIZE_ENABLED
    | mavlink.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
)
_ARMED = mavlink.MAV_MODE_FLAG_SAFETY_ARMED

_GYRO_ACCEL = mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO | mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL
_MAG = mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG
_GPS = mavlink.MAV_SYS_STATUS_SENSOR_GPS
_VISION = mavlink.MAV_SYS_STATUS_SENSOR_VISION_POSITION  # present once a client's position was used
_BATTERY = mavlink.MAV_SYS_STATUS_SENSOR_BATTERY
_AHRS = mavlink.MAV_SYS_STATUS_AHRS
_ATTITUDE_CONTROL = (
    mavlink.MAV_SYS_STATUS_SENSOR_ANGULAR_RATE_CONTROL
    | mavlink.MAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION
    | mavlink.MAV_SYS_STATUS_SENSOR_YAW_POSITION
    | mavlink.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS
)
_POSITION_CONTROL = mavlink.MAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL | mavlink.MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL
_RC = mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER  # present once sticks were heard: most clients have none
_PREARM = mavlink.MAV_SYS_STATUS_PREARM_CHECK
# Always present, enabled while a fence is watched: without it MAVProxy announces a breach of a fence nobody has set.
_GEOFENCE = mavlink.MAV_SYS_STATUS_GEOFENCE
_FUSED = sum(sensor.status_bit for sensor in FUSED_SENSORS if not sensor.is_optional)
_OPTIONAL_SENSORS = tuple(sensor for sensor in FUSED_SENSORS if sensor.is_optional)
_ALWAYS = _GYRO_ACCEL | _FUSED | _BATTERY | _AHRS | _ATTITUDE_CONTROL | _POSITION_CONTROL | _PREARM

_BREACH_KINDS = {
    FenceLimit.SHAPES: mavlink.FENCE_BREACH_BOUNDARY,
    FenceLimit.RADIUS: mavlink.FENCE_BREACH_BOUNDARY,
    FenceLimit.CEILING: mavlink.FENCE_BREACH_MAXALT,
    FenceLimit.FLOOR: mavlink.FENCE_BREACH_MINALT,
}

FRESH_IMU_US = 100_000  # older samples mean a dead sensor; several periods of each sensor
FRESH_US = 1_000_000
FIX_3D = 3  # GPS_FIX_TYPE
IN_MISSION_MODE, NOT_IN_MISSION_MODE = 1, 2  # MISSION_CURRENT.mission_mode; 0 is unknown
WHOLE_PACK_ONLY = (UINT16_MAX,) * 9  # cell voltages are not measured


def heartbeat(state: VehicleState, dialect: Dialect) -> bytes:
    """Mode, armed or not, state."""
    base_mode = _STICKS_MODE if dialect.mode_table[state.mode].needs_sticks else _BASE_MODE
    return _heartbeat(
        state.mav_type,
        dialect.autopilot,
        base_mode | _ARMED if state.is_armed else base_mode,
        dialect.custom_mode(state.mode),
        system_status(state, dialect),
        MAVLINK_VERSION,
    )


def system_status(state: VehicleState, dialect: Dialect) -> int:
    """MAV_STATE: standby, active or critical once armed (PX4) or off the ground (ArduPilot)."""
    is_standing = state.landed_state in (LandedState.ON_GROUND, LandedState.UNDEFINED)
    if is_standing and not (state.is_armed and dialect.is_active_armed):
        return int(mavlink.MAV_STATE_STANDBY)
    if state.mode is Mode.TERMINATION:
        return int(mavlink.MAV_STATE_FLIGHT_TERMINATION)
    return int(mavlink.MAV_STATE_CRITICAL if state.is_failsafe else mavlink.MAV_STATE_ACTIVE)


def sys_status(state: VehicleState) -> bytes:
    """Which sensors work, whether it may be armed, battery, load."""
    present = _ALWAYS | (_RC if state.sticks.heard_until_us else 0)
    for sensor in _OPTIONAL_SENSORS:
        if getattr(state.samples, sensor.name).time_us:
            present |= sensor.status_bit
    if state.health and state.health.external_pos.fused_time_us:
        present |= _VISION
    fence = state.fence
    battery = state.samples.battery
    return _sys_status(
        present | _GEOFENCE,
        present | (_GEOFENCE if fence.is_active else 0),
        healthy_sensors(state) & present | (0 if fence.breached else _GEOFENCE),
        u16(state.load * 1000.0),
        u16(battery.voltage_v * 1000.0, UINT16_MAX),
        i16(battery.current_a * 100.0, -1),
        _percent(state.battery_remaining),
    )


def healthy_sensors(state: VehicleState) -> int:
    """MAV_SYS_STATUS_SENSOR bits of all that works now."""
    now_us, samples, flags, health = state.time_us, state.samples, state.estimate.flags, state.health
    bits = 0
    if now_us - samples.imu.time_us < FRESH_IMU_US:
        bits |= _GYRO_ACCEL
    for sensor in FUSED_SENSORS:
        if _works(getattr(samples, sensor.name), health and getattr(health, f"{sensor.name}_inbox"), now_us):
            bits |= sensor.status_bit
    if flags & (MAG_DISTURBED | MAG_FAULTY):
        bits &= ~_MAG
    if samples.gnss.fix_type < FIX_3D or not flags & POSITION_VALID:
        bits &= ~_GPS
    if flags & EXTERNAL_POSITION:
        bits |= _VISION
    if samples.battery.time_us and now_us - samples.battery.time_us < FRESH_US:
        bits |= _BATTERY
    if flags & TILT_ALIGNED and flags & YAW_ALIGNED:
        bits |= _AHRS | _ATTITUDE_CONTROL
    if flags & VELOCITY_VALID and flags & POSITION_VALID:
        bits |= _POSITION_CONTROL
    if state.is_ready_to_arm or state.is_armed:
        bits |= _PREARM
    if now_us <= state.sticks.heard_until_us:
        bits |= _RC
    return bits


def _works(sample: Any, inbox: Any, now_us: int) -> bool:
    """Whether a sensor delivers samples that change."""
    is_fresh = sample.time_us != 0 and now_us - sample.time_us < FRESH_US
    return is_fresh and not (inbox and inbox.is_stuck)


def _percent(fraction: float) -> int:
    """[%], -1 if unknown."""
    return bounded_int(fraction * 100.0, 0, 100) if isfinite(fraction) else -1


def battery_status(state: VehicleState) -> bytes | None:
    """Voltage, current, charge used and left."""
    battery = state.samples.battery
    if battery.time_us == 0:
        return None
    return _battery_status(
        0,
        mavlink.MAV_BATTERY_FUNCTION_ALL,
        mavlink.MAV_BATTERY_TYPE_LIPO,
        INT16_MAX,  # temperature not measured
        (u16(battery.voltage_v * 1000.0, UINT16_MAX), *WHOLE_PACK_ONLY),
        i16(battery.current_a * 100.0, -1),
        i32(state.battery_used_mah, -1),
        -1,
        _percent(state.battery_remaining),
        0,
        state.battery_level,
    )


def home_position(state: VehicleState) -> bytes | None:
    """Home, once it is known."""
    home = state.home
    if home is None:
        return None
    half = 0.5 * state.home_yaw_rad
    return _home_position(
        degrees_e7(home.lat_deg),
        degrees_e7(home.lon_deg),
        i32(home.alt_m * 1000.0),
        *state.home_ned,
        (cos(half), 0.0, 0.0, sin(half)),
        nan,
        nan,
        nan,
        state.time_us,
    )


def gps_global_origin(state: VehicleState) -> bytes:
    """Where the local frame has its origin: the position of power-on."""
    origin = state.origin
    return _gps_global_origin(
        degrees_e7(origin.lat_deg), degrees_e7(origin.lon_deg), i32(origin.alt_m * 1000.0), state.time_us
    )


def extended_sys_state(state: VehicleState) -> bytes:
    """On the ground, taking off, in the air, landing."""
    return _extended_sys_state(mavlink.MAV_VTOL_STATE_UNDEFINED, state.landed_state)


def mission_current(state: VehicleState) -> bytes:
    """The current mission item, of how many (home not counted), and the mission's state."""
    return mission_progress(state, state.mission_current)


def mission_progress(state: VehicleState, seq: int) -> bytes:
    """MISSION_CURRENT with the item's number as clients know it."""
    mission_mode = IN_MISSION_MODE if state.mode is Mode.MISSION else NOT_IN_MISSION_MODE
    return _mission_current(u16(seq), u16(state.mission_count), state.mission_state, mission_mode)


def fence_status(state: VehicleState) -> bytes:
    """Whether the fence is breached, and the kind and the time of the last breach."""
    fence = state.fence
    return _fence_status(
        int(fence.breached != 0),
        u16(fence.breach_count),
        next((kind for limit, kind in _BREACH_KINDS.items() if fence.last_breach & limit), 0),
        boot_ms(fence.breach_time_us),
        mavlink.FENCE_MITIGATE_NONE,
    )


def system_time(host: Host, state: VehicleState) -> bytes:
    """Unix time, which goes on from the date of power-on with simulated time."""
    return _system_time(host.boot_unix_us + state.time_us, boot_ms(state.time_us))


def current_mode(state: VehicleState, dialect: Dialect) -> bytes:
    """CURRENT_MODE: the mode flown; the one asked for last is the same, since a mode is entered at once or not."""
    custom_mode = dialect.custom_mode(state.mode)
    standard = next((row.standard_mode for row in dialect.modes if row.mode is state.mode), 0)
    return _current_mode(standard, custom_mode, custom_mode)


def available_modes_monitor(_: VehicleState) -> bytes:
    """A number that would change with the list of modes."""
    return _available_modes_monitor(MODES_SEQUENCE)


def flight_information(state: VehicleState) -> bytes:
    """When it was armed and took off [us since power-on; the date is unknown], and the number of the flight."""
    armed_us = state.armed_since_us if state.is_armed else 0
    takeoff_us = state.takeoff_us if state.is_armed else 0
    return _flight_information(boot_ms(state.time_us), armed_us, takeoff_us, state.flight_number)


def winch_status(state: VehicleState) -> bytes | None:
    """Line out, speed, tension and state of the winch, where there is one."""
    if state.read_winch is None:
        return None
    winch = state.read_winch()
    return _winch_status(
        state.time_us, winch.length_m, winch.rate_m_s, winch.tension_kg, winch.voltage_v, winch.current_a, INT16_MAX,
        winch.flags,
    )  # fmt: skip
