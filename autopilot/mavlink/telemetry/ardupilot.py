"""Telemetry that ArduPilot's ground stations show: estimator health, wind and range finder in ArduPilot's messages."""

from math import atan2, degrees, hypot

from autopilot.mavlink.codec import known_type
from autopilot.mavlink.telemetry.sensors import estimator_flags, test_ratios
from autopilot.ports import WIND_VALID
from autopilot.vehicle import VehicleState

_ekf_status_report = known_type("EKF_STATUS_REPORT").pack
_wind = known_type("WIND").pack
_rangefinder = known_type("RANGEFINDER").pack


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
