"""Telemetry that ArduPilot's ground stations show: the estimator, wind, range finder and terrain in its messages."""

from math import atan2, degrees, hypot

from autopilot.interface.vehicle_state import VehicleState
from autopilot.mavlink.telemetry.sensors import estimator_flags, test_ratios
from autopilot.mavlink.wire.codec import known_type
from autopilot.mavlink.wire.convert import degrees_e7
from autopilot.ports import POSITION_VALID, TERRAIN_VALID, WIND_VALID

_ekf_status_report = known_type("EKF_STATUS_REPORT").pack
_wind = known_type("WIND").pack
_rangefinder = known_type("RANGEFINDER").pack
_ahrs = known_type("AHRS").pack
_ahrs2 = known_type("AHRS2").pack
_terrain_report = known_type("TERRAIN_REPORT").pack


def ekf_status_report(state: VehicleState) -> bytes:
    """Which estimates are valid, and innovation test ratios: above 1 a measurement is rejected."""
    gnss_vel, gnss_pos, baro, mag, range_finder = test_ratios(state.health)
    return _ekf_status_report(estimator_flags(state), gnss_vel, gnss_pos, baro, mag, range_finder, 0.0)


def wind(state: VehicleState) -> bytes | None:
    """The estimated wind: where it comes from, its speed over ground and upwards."""
    estimate = state.estimate
    if not estimate.flags & WIND_VALID:
        return None
    north, east, down = estimate.wind_ned
    return _wind(degrees(atan2(-east, -north)), hypot(north, east), -down)


def rangefinder(state: VehicleState) -> bytes | None:
    """Height above ground by the range finder."""
    sample = state.samples.range
    if sample.time_us == 0 or not sample.is_valid:
        return None
    return _rangefinder(sample.distance_m, 0.0)


def ahrs(state: VehicleState) -> bytes:
    """The gyroscope's estimated bias, and the deviations of tilt and heading as errors."""
    estimate = state.estimate
    return _ahrs(*estimate.gyro_bias_frd, 0.0, 0.0, estimate.tilt_std, estimate.yaw_std)


def ahrs2(state: VehicleState) -> bytes:
    """Attitude and place once more, where clients look for a second estimator: there is one only."""
    has_position = state.estimate.flags & POSITION_VALID
    position = state.position
    return _ahrs2(
        state.roll_rad,
        state.pitch_rad,
        state.yaw_rad,
        position.alt_m,
        degrees_e7(position.lat_deg) if has_position else 0,
        degrees_e7(position.lon_deg) if has_position else 0,
    )


def terrain_report(state: VehicleState) -> bytes | None:
    """The ground below as the range finder measures it: its altitude, and the height above it; no grid is loaded."""
    estimate = state.estimate
    if not estimate.flags & TERRAIN_VALID or not estimate.flags & POSITION_VALID:
        return None
    return _terrain_report(
        degrees_e7(state.position.lat_deg),
        degrees_e7(state.position.lon_deg),
        0,
        state.origin.alt_m - estimate.terrain_d,
        estimate.terrain_d - estimate.pos_ned[2],
        0,
        0,
    )
