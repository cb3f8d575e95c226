"""Health: which parts of the estimate may be used, how sure they are, and what to do with a broken covariance.

In: the state after a horizon step. Out: `Estimate.flags` and standard deviations, and aids switched off when their
sensor fell silent or froze.

Barometer and GNSS velocity that leave the prediction on the same side say that the accelerometer is wrong: heavy
vibration, or a large bias. It is doubted then, for as long as that lasts (PX4's bad_acc_vertical, ArduPilot's vibration
failsafe): velocity counts as uncertain and follows GNSS, and the bias may be as large as no healthy sensor's.
"""

import warp as wp

from autopilot.estimator.fuse import seconds_since
from autopilot.estimator.params import EstimatorParams
from autopilot.estimator.state import (
    ATT,
    PHASE_RUNNING,
    POS,
    SLOW_COUNT,
    SLOW_COV,
    VEL,
    WIND,
    Aid,
    EstimatorState,
    Inbox,
    Nominal,
)
from autopilot.ports import (
    ACCEL_DOUBTED,
    DEAD_RECKONING,
    EXTERNAL_POSITION,
    HEIGHT_VALID,
    MAG_DISTURBED,
    MAG_FAULTY,
    POSITION_VALID,
    TERRAIN_VALID,
    TILT_ALIGNED,
    VELOCITY_VALID,
    WIND_VALID,
    YAW_ALIGNED,
    Estimate,
)
from common.kernels import ERROR_STATES, vec24

wp.set_module_options({"enable_backward": False})

_SILENT_AFTER_S = wp.constant(1.0)  # five samples of the slowest source
DEAD_RECKONING_AFTER_S = wp.constant(1.0)
DOUBTED_ACCEL_NSD = wp.constant(1.0)  # [m²/s³] what 2 m/s² too much do between two fixes; guess
_DOUBTED_BIAS_LIMIT = wp.constant(4.0)  # [m/s²] guess
_DOUBTED_BIAS_WALK = wp.constant(0.5)  # [m/s²/√s] guess
_DOUBT_S = wp.constant(10.0)  # after the last sign of it (PX4)
_DOUBT_SIGMA = wp.constant(4.0)  # both sources, on the same side
_DOUBT_CLIMB_M_S = wp.constant(0.15)  # mean innovation that says it goes on; guess, far above the receiver's noise
_CLIMB_LPF_GAIN = wp.constant(0.05)  # per fix
_TERRAIN_AFTER_S = wp.constant(2.0)
_MAX_TILT_VAR = wp.constant(0.01)  # rad²: 6 deg
_MAX_YAW_VAR = wp.constant(0.07)  # rad²: 15 deg
_CARRYING_VEL_VAR = wp.constant(0.16)  # (0.4 m/s)²: a velocity known no better carries no position; odometry keeps 0.1
_MAX_WIND_VAR = wp.constant(9.0)  # (3 m/s)²
_MAX_POS_VAR = wp.constant(2500.0)  # (50 m)²
_MIN_VAR = wp.constant(1.0e-12)
_MAX_VAR = wp.constant(1.0e8)


@wp.func
def listen(aid: Aid, inbox: Inbox, horizon_time_us: wp.int64) -> Aid:
    """The aid, inactive once its sensor froze or its samples stopped coming."""
    if inbox.is_stuck == 1 or seconds_since(horizon_time_us, aid.judged_time_us) > _SILENT_AFTER_S:
        aid.is_active = 0
    return aid


@wp.func
def is_healthy(aid: Aid) -> bool:
    """The source is in use and agrees with the estimate."""
    return aid.is_active == 1 and aid.test_ratio_lpf < 1.0


@wp.func
def is_doubted(state: EstimatorState) -> bool:
    """The accelerometer is not believed at present."""
    return seconds_since(state.horizon_time_us, state.doubted_time_us) < _DOUBT_S


@wp.func
def with_doubt(params: EstimatorParams, is_doubted: bool) -> EstimatorParams:
    """The parameters with which an accelerometer that is doubted may have any bias."""
    out = params
    if is_doubted:
        out.accel_bias_limit = wp.max(params.accel_bias_limit, _DOUBTED_BIAS_LIMIT)
        out.accel_bias_walk = wp.max(params.accel_bias_walk, _DOUBTED_BIAS_WALK)
    return out


@wp.func
def doubt_accel(state: EstimatorState, bias_limit: float) -> wp.int64:
    """When the accelerometer was last doubted, after a GNSS velocity has been judged.

    Args:
        state: of the vehicle.
        bias_limit: [m/s²] of a healthy accelerometer.
    """
    bias_frd = state.nominal.accel_bias_frd
    bias_most = wp.max(wp.abs(bias_frd[0]), wp.max(wp.abs(bias_frd[1]), wp.abs(bias_frd[2])))
    goes_on = wp.abs(state.climb_innov_lpf) > _DOUBT_CLIMB_M_S or bias_most > bias_limit
    climb, height = state.gnss_vel.innov[2], state.baro.innov[0]
    limit = _DOUBT_SIGMA * _DOUBT_SIGMA
    is_wrong = (
        state.baro.is_active == 1
        and climb * height > 0.0
        and climb * climb > limit * state.gnss_vel.innov_var[2]
        and height * height > limit * state.baro.innov_var[0]
    )
    if is_wrong or (is_doubted(state) and goes_on):
        return state.horizon_time_us
    return state.doubted_time_us


@wp.func
def climb_innov_lpf(state: EstimatorState) -> float:
    """[m/s] the low-passed vertical innovation of the GNSS velocity."""
    return state.climb_innov_lpf + _CLIMB_LPF_GAIN * (state.gnss_vel.innov[2] - state.climb_innov_lpf)


@wp.func
def is_sound(cov: wp.array2d(dtype=vec24), i: int, nominal: Nominal) -> bool:
    """Every variance is a positive, finite number, after those that rounding brought below a floor were lifted.

    Lifting is safe: adding to the diagonal keeps a matrix positive.
    """
    is_good = wp.isfinite(nominal.q_ned_from_frd) and wp.isfinite(nominal.vel_ned) and wp.isfinite(nominal.pos_ned)
    for r in range(ERROR_STATES):
        row = cov[i, r]
        if row[r] < _MIN_VAR and row[r] > -_MIN_VAR:
            row[r] = _MIN_VAR
            cov[i, r] = row
        # written so that a NaN fails
        if not (row[r] > 0.0 and row[r] < _MAX_VAR):
            is_good = False
    slow_row = cov[i, SLOW_COV]
    for j in range(SLOW_COUNT):
        variance = slow_row[(SLOW_COUNT + 1) * j]
        slow_row[(SLOW_COUNT + 1) * j] = wp.max(variance, _MIN_VAR)
        if not (variance > -_MIN_VAR and variance < _MAX_VAR):
            is_good = False
    cov[i, SLOW_COV] = slow_row
    return is_good


@wp.func
def with_deviations(cov: wp.array2d(dtype=vec24), i: int, estimate: Estimate) -> Estimate:
    """The estimate with its standard deviations; horizontal ones are those of the worse axis."""
    estimate.tilt_std = wp.sqrt(cov[i, ATT][ATT] + cov[i, ATT + 1][ATT + 1])
    estimate.yaw_std = wp.sqrt(cov[i, ATT + 2][ATT + 2])
    estimate.vel_std = wp.sqrt(wp.max(cov[i, VEL][VEL], cov[i, VEL + 1][VEL + 1]))
    estimate.pos_h_std = wp.sqrt(wp.max(cov[i, POS][POS], cov[i, POS + 1][POS + 1]))
    estimate.pos_v_std = wp.sqrt(cov[i, POS + 2][POS + 2])
    return estimate


@wp.func
def carried_s(params: EstimatorParams, wheels_s: float, external_vel_s: float) -> float:
    """For how long [s] a position stays valid after the last one that was fused: longer while the way is measured.

    Args:
        params: of the estimator.
        wheels_s: since the speed of wheels was fused last.
        external_vel_s: since a velocity from outside was.
    """
    valid_s = params.no_aid_s
    if wheels_s < params.no_aid_s:
        valid_s = wp.max(valid_s, params.wheel_valid_s)
    if external_vel_s < params.no_aid_s:
        valid_s = wp.max(valid_s, params.external_vel_valid_s)
    return valid_s


@wp.func
def flags(params: EstimatorParams, cov: wp.array2d(dtype=vec24), i: int, state: EstimatorState) -> int:
    """Bits of `Estimate.flags`."""
    bits = int(0)
    if state.phase == PHASE_RUNNING:
        now_us = state.horizon_time_us
        tilt_var = cov[i, ATT][ATT] + cov[i, ATT + 1][ATT + 1]
        if tilt_var < _MAX_TILT_VAR:
            bits = bits | TILT_ALIGNED
        if state.is_yaw_aligned == 1 and cov[i, ATT + 2][ATT + 2] < _MAX_YAW_VAR:
            bits = bits | YAW_ALIGNED
        pos_s = seconds_since(now_us, state.gnss_pos.fused_time_us)
        external_pos_s = seconds_since(now_us, state.external_pos.fused_time_us)
        if external_pos_s < DEAD_RECKONING_AFTER_S:
            bits = bits | EXTERNAL_POSITION
        pos_s = wp.min(pos_s, external_pos_s)
        vel_s = wp.min(pos_s, seconds_since(now_us, state.gnss_vel.fused_time_us))
        external_vel_s = seconds_since(now_us, state.external_vel.fused_time_us)
        if wp.max(cov[i, VEL][VEL], cov[i, VEL + 1][VEL + 1]) > _CARRYING_VEL_VAR:
            external_vel_s = params.no_aid_s  # what says so little carries nothing
        vel_s = wp.min(vel_s, external_vel_s)
        wheels_s = seconds_since(now_us, state.wheels.fused_time_us)
        if pos_s < carried_s(params, wheels_s, external_vel_s) and cov[i, POS][POS] < _MAX_POS_VAR:
            bits = bits | POSITION_VALID
        if wp.min(vel_s, wheels_s) < params.no_aid_s:
            bits = bits | VELOCITY_VALID
        if vel_s > DEAD_RECKONING_AFTER_S:
            bits = bits | DEAD_RECKONING
        if is_doubted(state):
            bits = bits | ACCEL_DOUBTED
        if state.is_mag_disturbed == 1:
            bits = bits | MAG_DISTURBED
        if state.is_mag_faulty == 1:
            bits = bits | MAG_FAULTY
        height_s = seconds_since(now_us, state.baro.fused_time_us)
        if state.baro.is_active == 0:
            height_s = seconds_since(now_us, state.gnss_height.fused_time_us)
        height_s = wp.min(height_s, seconds_since(now_us, state.external_height.fused_time_us))
        if height_s < params.no_aid_s:
            bits = bits | HEIGHT_VALID
        if state.range.is_active == 1 and seconds_since(now_us, state.range.fused_time_us) < _TERRAIN_AFTER_S:
            bits = bits | TERRAIN_VALID
        if state.drag.is_active == 1 and cov[i, WIND][WIND] + cov[i, WIND + 1][WIND + 1] < _MAX_WIND_VAR:
            bits = bits | WIND_VALID
    return bits
