"""Telemetry of sensors, motors and the estimator's health."""

from math import atan2, hypot, isfinite
from typing import Any

from autopilot.interface.vehicle_state import VehicleState
from autopilot.mavlink.telemetry.motion import boot_ms
from autopilot.mavlink.wire.codec import known_type
from autopilot.mavlink.wire.convert import (
    UINT16_MAX,
    bounded_int,
    degrees_e7,
    heading_centideg,
    i16,
    i32,
    u16,
    u32,
)
from autopilot.ports import (
    ACCEL_DOUBTED,
    HEIGHT_VALID,
    POSITION_VALID,
    TERRAIN_VALID,
    TILT_ALIGNED,
    VELOCITY_VALID,
)
from common.geodesy import GRAVITY_M_S2, geodetic_from_ned

_gps_raw_int = known_type("GPS_RAW_INT").pack
_highres_imu = known_type("HIGHRES_IMU").pack
_scaled_imu = known_type("SCALED_IMU").pack
_scaled_imu2 = known_type("SCALED_IMU2").pack
_scaled_pressure = known_type("SCALED_PRESSURE").pack
_distance_sensor = known_type("DISTANCE_SENSOR").pack
_servo_output_raw = known_type("SERVO_OUTPUT_RAW").pack
_actuator_output_status = known_type("ACTUATOR_OUTPUT_STATUS").pack
_obstacle_distance = known_type("OBSTACLE_DISTANCE").pack
_raw_imu = known_type("RAW_IMU").pack
_vibration = known_type("VIBRATION").pack
_estimator_status = known_type("ESTIMATOR_STATUS").pack

PULSE_IDLE_US = 1000  # servo pulse at command 0; 2000 at command 1
MOVING_M_S = 0.5  # below this speed the course over ground is noise; guess
FIX_3D = 3  # GPS_FIX_TYPE
LOOKS_DOWN = 25  # MAV_SENSOR_ROTATION_PITCH_270
LASER = 0  # MAV_DISTANCE_SENSOR
COVARIANCE_UNKNOWN = 255
RING_LEAST_CM, RING_REACH_CM = 30, 3000  # of the driver of the ring sensor
BODY_FRD = 12  # MAV_FRAME
NO_RETURN_CM = UINT16_MAX

# Bits of HIGHRES_IMU_UPDATED_FLAGS
_ACCEL_GYRO_BITS = 0x3F
_MAG_BITS = 0x1C0
_PRESSURE_BITS = 0x200 | 0x800 | 0x1000

# ESTIMATOR_STATUS_FLAGS of our Estimate.flags
_ESTIMATOR_BITS = (
    (TILT_ALIGNED, 1),  # attitude
    (VELOCITY_VALID, 2 | 4),  # horizontal, vertical velocity
    (POSITION_VALID, 8 | 16 | 256 | 512),  # relative, absolute, and both predicted
    (HEIGHT_VALID, 32),  # absolute height
    (TERRAIN_VALID, 64),  # height above ground
    (ACCEL_DOUBTED, 2048),  # accelerometer error
)


def pressure_altitude_m(pressure_pa: float) -> float:
    """Height in the standard atmosphere (ICAO Doc 7488, troposphere)."""
    return float(44_330.77 * (1.0 - (max(pressure_pa, 0.0) / 101_325.0) ** 0.190263))


def gps_raw_int(state: VehicleState) -> bytes | None:
    """The receiver's own fix: position, accuracy, satellites."""
    gnss = state.samples.gnss
    if gnss.time_us == 0:
        return None
    north, east, down = gnss.pos_ned
    if not (isfinite(north) and isfinite(east) and isfinite(down)):
        return None
    lat_deg, lon_deg, alt_amsl_m = geodetic_from_ned(north, east, down, state.origin)
    vel_north, vel_east, _ = gnss.vel_ned
    speed = hypot(vel_north, vel_east)
    return _gps_raw_int(
        gnss.time_us,
        gnss.fix_type,
        degrees_e7(lat_deg),
        degrees_e7(lon_deg),
        i32(alt_amsl_m * 1000.0),
        # The receiver gives accuracies, not dilutions: hundredths of the dilution for a range error of 1 m.
        u16(gnss.pos_h_std * 100.0, UINT16_MAX),
        u16(gnss.pos_v_std * 100.0, UINT16_MAX),
        u16(speed * 100.0, UINT16_MAX),
        heading_centideg(atan2(vel_east, vel_north)) if speed > MOVING_M_S else UINT16_MAX,
        bounded_int(gnss.satellites, 0, 255),
        i32(alt_amsl_m * 1000.0),  # no geoid undulation, see common.geodesy
        u32(gnss.pos_h_std * 1000.0),
        u32(gnss.pos_v_std * 1000.0),
        u32(gnss.vel_std * 1000.0),
    )


def highres_imu(state: VehicleState) -> bytes:
    """Gyroscope, accelerometer, magnetometer and barometer as they are."""
    samples = state.samples
    imu, mag, baro = samples.imu, samples.mag, samples.baro
    updated = _ACCEL_GYRO_BITS | (_MAG_BITS if mag.time_us else 0) | (_PRESSURE_BITS if baro.time_us else 0)
    return _highres_imu(
        imu.time_us,
        *imu.accel_frd,
        *imu.gyro_frd,
        *mag.field_frd_gauss,
        baro.pressure_pa / 100.0,
        0.0,
        pressure_altitude_m(baro.pressure_pa),
        baro.temperature_c,
        updated,
    )


def scaled_imu(state: VehicleState) -> bytes:
    """Gyroscope, accelerometer and magnetometer in milli-units."""
    return _scaled_imu(boot_ms(state.time_us), *_milli_units(state))


def scaled_imu2(state: VehicleState) -> bytes:
    """The same once more, where clients look for a second IMU: there is one only."""
    return _scaled_imu2(boot_ms(state.time_us), *_milli_units(state))


def _milli_units(state: VehicleState) -> tuple[int, ...]:
    """Specific force [mg], body rates [mrad/s], magnetic field [mgauss]."""
    imu, mag = state.samples.imu, state.samples.mag
    milli_g = 1000.0 / GRAVITY_M_S2
    return (
        *(i16(value * milli_g) for value in imu.accel_frd),
        *(i16(value * 1000.0) for value in imu.gyro_frd),
        *(i16(value * 1000.0) for value in mag.field_frd_gauss),
    )


def obstacle_distance(state: VehicleState) -> bytes | None:
    """Distances all round by the ring sensor on board, where there is one; clockwise from the nose."""
    obstacles = state.obstacles
    if obstacles is None or not obstacles.body_m:
        return None
    reach_cm = RING_REACH_CM + 1  # nothing within reach
    return _obstacle_distance(
        obstacles.sensed_us,
        LASER,
        tuple(min(u16(distance * 100.0, reach_cm), reach_cm) for distance in obstacles.body_m),
        round(360.0 / len(obstacles.body_m)),
        RING_LEAST_CM,
        RING_REACH_CM,
        360.0 / len(obstacles.body_m),
        0.0,
        BODY_FRD,
    )


def raw_imu(state: VehicleState) -> bytes:
    """The IMU in the units of SCALED_IMU: its driver delivers no raw counts."""
    return _raw_imu(state.samples.imu.time_us, *_milli_units(state))


def scaled_pressure(state: VehicleState) -> bytes | None:
    """The barometer."""
    baro = state.samples.baro
    if baro.time_us == 0:
        return None
    return _scaled_pressure(boot_ms(state.time_us), baro.pressure_pa / 100.0, 0.0, i16(baro.temperature_c * 100.0))


def distance_sensor(state: VehicleState) -> bytes | None:
    """Height above ground by the range finder.

    Limits are sent as 0 and the largest value: the driver's sample does not carry them.
    """
    sample = state.samples.range
    if sample.time_us == 0:
        return None
    return _distance_sensor(
        boot_ms(state.time_us),
        0,
        NO_RETURN_CM - 1,
        u16(sample.distance_m * 100.0, NO_RETURN_CM) if sample.is_valid else NO_RETURN_CM,
        LASER,
        0,
        LOOKS_DOWN,
        COVARIANCE_UNKNOWN,
        signal_quality=100 if sample.is_valid else 1,
    )


_PULSE_MIDDLE_US = 1500  # of an output that goes both ways


def servo_output_raw(state: VehicleState) -> bytes:
    """Motor commands and auxiliary outputs as pulse widths."""
    pulses = [PULSE_IDLE_US + u16(min(command, 1.0) * 1000.0) for command in state.actuators.command]
    for i, output in enumerate(state.outputs):
        if output.is_signed:
            pulses[i] = _PULSE_MIDDLE_US + round(500.0 * min(max(state.actuators.command[i], -1.0), 1.0))
    return _servo_output_raw(state.time_us & 0xFFFFFFFF, 0, *pulses, *state.aux_pulses_us)


def actuator_output_status(state: VehicleState) -> bytes:
    """Motor commands as fractions of the greatest."""
    commands = tuple(state.actuators.command)
    active = sum(1 << i for i, command in enumerate(commands) if command != 0.0)
    return _actuator_output_status(state.time_us, active, commands + (0.0,) * (32 - len(commands)))


def vibration(state: VehicleState) -> bytes | None:
    """The estimator's deviation of the specific force from its mean, the same figure for the three axes."""
    health = state.health
    if health is None:
        return None
    level = (max(health.stillness.accel_var, 0.0) / 3.0) ** 0.5
    return _vibration(state.time_us, level, level, level)


def estimator_status(state: VehicleState) -> bytes:
    """Which estimates are valid, innovation test ratios, accuracies."""
    estimate = state.estimate
    flags = estimator_flags(state)
    gnss_vel, gnss_pos, baro, mag, range_finder = test_ratios(state.health)
    return _estimator_status(
        state.time_us,
        flags,
        gnss_vel,
        gnss_pos,
        baro,
        mag,
        range_finder,
        0.0,
        estimate.pos_h_std,
        estimate.pos_v_std,
    )


def estimator_flags(state: VehicleState) -> int:
    """ESTIMATOR_STATUS_FLAGS, which are those of EKF_STATUS_REPORT too."""
    return sum(bits for ours, bits in _ESTIMATOR_BITS if state.estimate.flags & ours)


def test_ratios(health: Any) -> tuple[float, float, float, float, float]:
    """Smoothed test ratios of velocity, position (a client's, else GNSS), barometer, magnetometer, range finder."""
    if health is None:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    vel = health.external_vel if health.external_vel.is_active else health.gnss_vel
    pos = health.external_pos if health.external_pos.is_active else health.gnss_pos
    return (
        vel.test_ratio_lpf,
        pos.test_ratio_lpf,
        health.baro.test_ratio_lpf,
        health.mag.test_ratio_lpf,
        health.range.test_ratio_lpf,
    )
