"""Arming checks: everything that must be right before the motors may turn, each with the reason it gives.

In: the vehicle's state. Out: reasons, most important first; empty means ready. Run at 5 Hz while disarmed. What a class
of vehicles checks besides is in its folder.
"""

from collections.abc import Sequence
from math import hypot, radians

from autopilot.estimator.params import MAG_TYPE_NONE
from autopilot.estimator.sensors import FUSED_SENSORS
from autopilot.interface.vehicle_state import VehicleState
from autopilot.ports import (
    EXTERNAL_POSITION,
    MAG_DISTURBED,
    MAG_FAULTY,
    POSITION_VALID,
    TILT_ALIGNED,
    VELOCITY_VALID,
    YAW_ALIGNED,
)
from autopilot.vehicles.vehicle_class import ArmingCheck
from common.params import ParameterTable

_NEEDED_SENSORS = tuple(sensor for sensor in FUSED_SENSORS if sensor.is_needed_to_arm)
_STALE_US = 1_000_000  # a sensor that has been silent for longer is off
_GNSS_STALE_US = 2_000_000
_STILL_RAD_S = 0.2  # faster than hands, wind or noise turn a vehicle that stands; guess
_REFUSE, WARN_ONLY = 1, 2  # COM_ARM_MAG_STR
MAGNETIC_INTERFERENCE = "strong magnetic interference"
_UPRIGHT_RAD = radians(45.0)  # PX4 and ArduPilot refuse a steeper stand


def arming_reasons(
    state: VehicleState, params: ParameterTable, own: Sequence[ArmingCheck] = (), *, needs_position: bool
) -> list[str]:
    """Why the vehicle may not be armed.

    Args:
        state: the vehicle as of this frame.
        params: its parameters.
        own: what its class checks besides.
        needs_position: whether the mode it would be armed in needs a position.
    """
    if state.estimate is None or state.samples is None:
        return ["no data from the sensors yet"]
    if needs_position:
        of_position = _POSITION
    else:
        of_position = () if int(params["COM_ARM_WO_GPS"]) else (_gnss,)
    checks = (*_SENSORS_AND_ESTIMATE, *own, *_STAND_AND_SUPPLY, *of_position)
    return [reason for check in checks if (reason := check(state, params))]


def _calibration(state: VehicleState, _: ParameterTable) -> str:
    return "a calibration is running" if state.is_calibrating else ""


def _imu(state: VehicleState, _: ParameterTable) -> str:
    return "IMU: no data" if _is_stale(state, state.samples.imu.time_us, _STALE_US) else ""


def _fused_sensors(state: VehicleState, _: ParameterTable) -> str:
    for sensor in _NEEDED_SENSORS:
        if _is_stale(state, getattr(state.samples, sensor.name).time_us, _STALE_US):
            return f"{sensor.label}: no data"
    return ""


def _magnetometer(state: VehicleState, params: ParameterTable) -> str:
    if not _has_compass(params):
        return ""
    if _is_stale(state, state.samples.mag.time_us, _STALE_US):
        return "magnetometer: no data"
    flags = state.estimate.flags
    if flags & MAG_FAULTY:
        return "compass contradicts the heading of the last flight: calibrate it"
    is_checked = int(params["COM_ARM_MAG_STR"]) == _REFUSE or not flags & YAW_ALIGNED
    return MAGNETIC_INTERFERENCE if flags & MAG_DISTURBED and is_checked else ""


def _alignment(state: VehicleState, _: ParameterTable) -> str:
    return "" if state.estimate.flags & TILT_ALIGNED else "estimator: attitude not aligned"


def _heading(state: VehicleState, params: ParameterTable) -> str:
    """Without a compass the heading is found in flight."""
    is_known = state.estimate.flags & YAW_ALIGNED
    return "estimator: heading not aligned" if _has_compass(params) and not is_known else ""


def _has_compass(params: ParameterTable) -> bool:
    return bool(int(params["EKF2_MAG_TYPE"]) != MAG_TYPE_NONE)


def _still(state: VehicleState, _: ParameterTable) -> str:
    p, q, r = state.estimate.omega_frd
    return "vehicle is moving" if p * p + q * q + r * r > _STILL_RAD_S * _STILL_RAD_S else ""


def _upright(state: VehicleState, _: ParameterTable) -> str:
    return "vehicle is not upright" if hypot(state.roll_rad, state.pitch_rad) > _UPRIGHT_RAD else ""


def _biases(state: VehicleState, params: ParameterTable) -> str:
    estimate = state.estimate
    if max(map(abs, estimate.gyro_bias_frd)) > radians(float(params["COM_ARM_GYR_BIAS"])):
        return "gyro bias is high"
    if max(map(abs, estimate.accel_bias_frd)) > params["COM_ARM_ACC_BIAS"]:
        return "accelerometer bias is high"
    return ""


def _battery(state: VehicleState, params: ParameterTable) -> str:
    remaining = state.battery_remaining
    if remaining != remaining or _is_stale(state, state.samples.battery.time_us, _GNSS_STALE_US):
        return "battery: no data"
    lowest = float(params["BAT_LOW_THR"])
    return f"battery: {remaining:.0%} left, {lowest:.0%} needed" if remaining < lowest else ""


def _gnss(state: VehicleState, params: ParameterTable) -> str:
    if state.estimate.flags & EXTERNAL_POSITION:
        return ""
    gnss = state.samples.gnss
    if _is_stale(state, gnss.time_us, _GNSS_STALE_US):
        return "GNSS: no data"
    if gnss.fix_type < 3:
        return "GNSS: no 3-D fix"
    needed = int(params["EKF2_REQ_NSATS"])
    return f"GNSS: {gnss.satellites} satellites, {needed} needed" if gnss.satellites < needed else ""


def _position(state: VehicleState, params: ParameterTable) -> str:
    estimate = state.estimate
    if not estimate.flags & YAW_ALIGNED:
        return "estimator: heading not aligned: take off in a mode that needs no position"
    if not estimate.flags & POSITION_VALID:
        return "estimator: no valid position"
    if not estimate.flags & VELOCITY_VALID:
        return "estimator: no valid velocity"
    for std, name, word in (
        (estimate.pos_h_std, "COM_POS_FS_EPH", "horizontal"),
        (estimate.pos_v_std, "COM_ARM_EPV", "vertical"),
    ):
        if not std <= params[name]:
            return f"estimator: {word} accuracy {std:.1f} m, {params[name]:.1f} m needed"
    return ""


def _is_stale(state: VehicleState, sample_us: int, limit_us: int) -> bool:
    return sample_us == 0 or state.time_us - sample_us > limit_us


_SENSORS_AND_ESTIMATE: tuple[ArmingCheck, ...] = (
    _calibration, _imu, _fused_sensors, _magnetometer, _alignment, _heading,
)  # fmt: skip
_STAND_AND_SUPPLY: tuple[ArmingCheck, ...] = (_upright, _still, _biases, _battery)
_POSITION: tuple[ArmingCheck, ...] = (_gnss, _position)
