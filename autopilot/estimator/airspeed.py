"""Airspeed from a pitot tube: what the control law and telemetry are told, and whether it is to be believed.

In: dynamic pressure, the motion over ground. Out: indicated airspeed, that is at the density of sea level, as PX4's
FW_AIRSPD_* mean it; invalid where the tube is silent, its value does not change, or it contradicts the motion over
ground in the wind of the last minute (ASPD_*). No filter fuses it.
"""

import warp as wp

from autopilot.estimator.airspeed_params import CHECK_INNOVATION, CHECK_MISSING, CHECK_STUCK
from autopilot.estimator.params import EstimatorParams
from autopilot.estimator.state import AirspeedCheck
from autopilot.ports import (
    AIRSPEED_VALID,
    CONTACT_GROUND,
    CONTACT_NONE,
    CONTACT_UNKNOWN,
    VELOCITY_VALID,
    AirspeedSample,
    Estimate,
)

wp.set_module_options({"enable_backward": False})

SEA_LEVEL_DENSITY_KG_M3 = wp.constant(1.225)  # ISO 2533
_SILENT_US = wp.constant(1_000_000)  # guess
_STUCK_US = wp.constant(2_000_000)  # PX4's
_MOVING_M_S = wp.constant(5.0)  # over ground; slower, the motion tells little of the tube
_WIND_SAMPLES = wp.constant(3000.0)  # of the mean: a minute; guess: turns in it tell the tube's error from the wind
_WIND_LEAST = wp.constant(250.0)  # of samples, before the wind is known; guess


@wp.func
def airspeed_of(pressure_pa: float) -> float:
    """[m/s] indicated; negative pressure, as of noise at rest, is a negative speed."""
    return wp.sign(pressure_pa) * wp.sqrt(2.0 * wp.abs(pressure_pa) / SEA_LEVEL_DENSITY_KG_M3)


@wp.func
def true_airspeed_of(pressure_pa: float, height_m: float) -> float:
    """[m/s] through the standard atmosphere (ISO 2533) at a height over sea level; of the motion, not of the wing."""
    density_ratio = wp.pow(wp.clamp(1.0 - 2.25577e-5 * height_m, 0.1, 2.0), 4.25588)
    return airspeed_of(pressure_pa) / wp.sqrt(density_ratio)


@wp.func
def is_contradicted(params: EstimatorParams, check: AirspeedCheck, estimate: Estimate, speed: float) -> bool:
    """Whether a true airspeed [m/s] differs from that of the motion in the known wind."""
    if check.wind_count < _WIND_LEAST:
        return False
    through = estimate.vel_ned - wp.vec3(check.wind_ne[0], check.wind_ne[1], 0.0)
    return wp.abs(speed - wp.length(through)) > params.airspeed_innov


@wp.func
def wind_learned(check: AirspeedCheck, estimate: Estimate, speed: float) -> AirspeedCheck:
    """The check with its mean wind a sample later."""
    out = check
    nose = wp.quat_rotate(estimate.q_ned_from_frd, wp.vec3(1.0, 0.0, 0.0))
    now = wp.vec2(estimate.vel_ned[0] - speed * nose[0], estimate.vel_ned[1] - speed * nose[1])
    out.wind_count = wp.min(check.wind_count + 1.0, _WIND_SAMPLES)
    out.wind_ne = check.wind_ne + (now - check.wind_ne) / out.wind_count
    return out


@wp.func
def checked(
    params: EstimatorParams,
    check: AirspeedCheck,
    estimate: Estimate,
    sample: AirspeedSample,
    contact: int,
    height_m: float,
) -> AirspeedCheck:
    """The check after a tick of the IMU; on the ground a value may well stay the same, and tells nothing of the wind.

    Args:
        params: ASPD_*.
        check: as of the last tick.
        estimate: of the motion.
        sample: the newest.
        contact: CONTACT_*: what the commander says.
        height_m: over sea level, in the standard atmosphere.
    """
    out = check
    now_us = estimate.time_us
    vel = wp.vec2(estimate.vel_ned[0], estimate.vel_ned[1])
    is_moving = (estimate.flags & VELOCITY_VALID) != 0 and wp.length(vel) > _MOVING_M_S
    is_flying = contact == CONTACT_NONE or (contact == CONTACT_UNKNOWN and is_moving)
    if not is_flying:
        out.changed_us = now_us
        out.is_contradicted = 0
    if contact == CONTACT_GROUND:
        out.wind_count = 0.0
    if sample.time_us != check.sample_us and wp.isfinite(sample.pressure_pa):
        speed = true_airspeed_of(sample.pressure_pa, height_m)
        if sample.pressure_pa != check.pressure_pa:
            out.changed_us = now_us
        out.sample_us = sample.time_us
        out.pressure_pa = sample.pressure_pa
        if is_flying and is_moving:  # else it stays as it was judged last
            out.is_contradicted = 0
            if is_contradicted(params, check, estimate, speed):
                out.is_contradicted = 1
            elif check.is_failed == 0:
                out = wind_learned(out, estimate, speed)
    is_silent = now_us - out.sample_us > wp.int64(_SILENT_US) and (params.airspeed_checks & CHECK_MISSING) != 0
    is_stuck = now_us - out.changed_us > wp.int64(_STUCK_US) and (params.airspeed_checks & CHECK_STUCK) != 0
    is_off = out.is_contradicted == 1 and (params.airspeed_checks & CHECK_INNOVATION) != 0
    if is_silent or is_stuck or is_off:
        out.passed_us = wp.int64(0)
        if check.doubted_us == wp.int64(0):
            out.doubted_us = now_us
        if is_silent or is_stuck or now_us - out.doubted_us > wp.int64(params.airspeed_stop_s * 1.0e6):
            out.is_failed = 1
    else:
        out.doubted_us = wp.int64(0)
        if check.passed_us == wp.int64(0) or (is_flying and not is_moving):  # in the air unjudged is not passed
            out.passed_us = now_us
        is_over = now_us - out.passed_us > wp.int64(params.airspeed_start_s * 1.0e6)
        if params.airspeed_start_s >= 0.0 and is_over:
            out.is_failed = 0
    return out


@wp.func
def with_airspeed(estimate: Estimate, check: AirspeedCheck, sample: AirspeedSample) -> Estimate:
    """The estimate with the speed of the latest sample; not valid once the tube has failed, or tells no number."""
    out = estimate
    out.flags = estimate.flags & ~AIRSPEED_VALID
    is_heard = estimate.time_us - sample.time_us <= wp.int64(_SILENT_US)
    if check.is_failed == 0 and is_heard and wp.isfinite(sample.pressure_pa):
        out.flags = out.flags | AIRSPEED_VALID
        out.airspeed = airspeed_of(sample.pressure_pa)
    return out
