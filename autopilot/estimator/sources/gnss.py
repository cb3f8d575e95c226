"""GNSS: horizontal position, height and velocity, fused as the horizon passes the time of validity.

Starts with the first good fix once heading is known, by setting position and velocity. Stops with the fix. Sets them
again after nothing passed the gate for a while. Height only tracks its offset to the barometer while that is the
reference, and takes over from there when the barometer stops.
"""

import warp as wp

from autopilot.estimator.fuse import fuse_state, judge, mark_fused, mark_reset, seconds_since, set_variance
from autopilot.estimator.params import GPS_CTRL_HEIGHT, GPS_CTRL_POS, GPS_CTRL_VEL, EstimatorParams
from autopilot.estimator.state import POS, VEL, Aid, GnssHeightBias, Nominal
from autopilot.ports import GnssSample
from common.kernels import vec24

wp.set_module_options({"enable_backward": False})

GNSS_STUCK_AFTER = wp.constant(3)  # equal solutions in a row: floats of a live receiver never repeat
VERTICAL_FACTOR = wp.constant(1.5)  # vertical over horizontal error, from satellite geometry
# The receiver's accuracy figures hold the slow error too; this share of them is new with each sample.
_WHITE_SHARE_POS = wp.constant(0.3)
_WHITE_SHARE_VEL = wp.constant(0.5)
_RESET_AFTER_S = wp.constant(5.0)  # nothing passed for so long: believe the receiver rather than the dead reckoning


@wp.func
def gnss_is_good(params: EstimatorParams, sample: GnssSample) -> bool:
    """The fix is good enough to be used."""
    return (
        sample.fix_type >= params.gnss_min_fix
        and sample.satellites >= params.gnss_min_satellites
        and sample.pos_h_std <= params.gnss_max_pos_h_std
        and sample.pos_v_std <= params.gnss_max_pos_v_std
        and sample.vel_std <= params.gnss_max_vel_std
    )


@wp.func
def gnss_repeats(sample: GnssSample, previous: GnssSample) -> bool:
    """Both samples hold the same solution."""
    return sample.pos_ned == previous.pos_ned and sample.vel_ned == previous.vel_ned


@wp.func
def gnss_pos_std(params: EstimatorParams, sample: GnssSample) -> float:
    """[m] noise per horizontal axis from sample to sample."""
    return wp.max(params.gnss_pos_noise, _WHITE_SHARE_POS * sample.pos_h_std)


@wp.func
def gnss_vel_std(params: EstimatorParams, sample: GnssSample) -> float:
    """[m/s] noise per axis."""
    return wp.max(params.gnss_vel_noise, _WHITE_SHARE_VEL * sample.vel_std)


@wp.func
def fuse_gnss_vel(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    aid: Aid,
    sample: GnssSample,
):  # type: ignore[no-untyped-def]
    """Velocity: three axes that pass or fail together."""
    std = gnss_vel_std(params, sample)
    var = std * std
    if (params.gnss_ctrl & GPS_CTRL_VEL) != 0:
        innov = sample.vel_ned - nominal.vel_ned
        innov_var = wp.vec3(cov[i, VEL][VEL] + var, cov[i, VEL + 1][VEL + 1] + var, cov[i, VEL + 2][VEL + 2] + var)
        starved_s = seconds_since(sample.time_us, aid.fused_time_us)
        aid = judge(aid, sample.time_us, innov, innov_var, params.gnss_vel_gate)
        aid.is_active = 1
        if aid.fused_time_us == wp.int64(0) or (aid.test_ratio > 1.0 and starved_s > _RESET_AFTER_S):
            nominal.vel_jump_ned = nominal.vel_jump_ned + innov
            nominal.vel_ned = sample.vel_ned
            nominal.reset_count += 1
            for axis in range(3):
                set_variance(cov, i, VEL + axis, var)
            aid = mark_reset(aid)
        elif aid.test_ratio <= 1.0:
            for axis in range(3):
                axis_innov = sample.vel_ned[axis] - nominal.vel_ned[axis]
                nominal = fuse_state(params, cov, i, nominal, VEL + axis, axis_innov, var)
            aid = mark_fused(aid)
    return nominal, aid


@wp.func
def fuse_gnss_pos(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    aid: Aid,
    sample: GnssSample,
    age_s: float,
):  # type: ignore[no-untyped-def]
    """Horizontal position: two axes that pass or fail together."""
    std = gnss_pos_std(params, sample)
    var = std * std
    if (params.gnss_ctrl & GPS_CTRL_POS) != 0:
        pos_ned = sample.pos_ned + nominal.vel_ned * age_s
        innov = wp.vec3(pos_ned[0] - nominal.pos_ned[0], pos_ned[1] - nominal.pos_ned[1], 0.0)
        innov_var = wp.vec3(cov[i, POS][POS] + var, cov[i, POS + 1][POS + 1] + var, 1.0)
        starved_s = seconds_since(sample.time_us, aid.fused_time_us)
        aid = judge(aid, sample.time_us, innov, innov_var, params.gnss_pos_gate)
        aid.is_active = 1
        if aid.fused_time_us == wp.int64(0) or (aid.test_ratio > 1.0 and starved_s > _RESET_AFTER_S):
            nominal.pos_jump_ned = nominal.pos_jump_ned + innov
            nominal.pos_ned = nominal.pos_ned + innov
            nominal.reset_count += 1
            set_variance(cov, i, POS, var)
            set_variance(cov, i, POS + 1, var)
            aid = mark_reset(aid)
        elif aid.test_ratio <= 1.0:
            for axis in range(2):
                axis_innov = pos_ned[axis] - nominal.pos_ned[axis]
                nominal = fuse_state(params, cov, i, nominal, POS + axis, axis_innov, var)
            aid = mark_fused(aid)
    return nominal, aid


@wp.func
def fuse_gnss_height(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    aid: Aid,
    bias: GnssHeightBias,
    sample: GnssSample,
    age_s: float,
    is_reference: bool,
):  # type: ignore[no-untyped-def]
    """Height: fused if it is the reference, else the offset between it and the estimate follows it."""
    std = VERTICAL_FACTOR * gnss_pos_std(params, sample)
    var = std * std
    if (params.gnss_ctrl & GPS_CTRL_HEIGHT) != 0:
        pos_d = sample.pos_ned[2] + nominal.vel_ned[2] * age_s
        if bias.is_known == 0:
            bias.is_known = 1
            bias.bias_m = pos_d - nominal.pos_ned[2]
            bias.var_m2 = var
        walk = VERTICAL_FACTOR * params.gnss_pos_walk
        since_s = wp.min(seconds_since(sample.time_us, aid.judged_time_us), 10.0)
        if not is_reference:
            bias.var_m2 = bias.var_m2 + walk * walk * since_s
        starved_s = seconds_since(sample.time_us, aid.fused_time_us)
        innov = pos_d - bias.bias_m - nominal.pos_ned[2]
        innov_var = cov[i, POS + 2][POS + 2] + var
        if not is_reference:
            innov_var = innov_var + bias.var_m2
        aid = judge(aid, sample.time_us, wp.vec3(innov, 0.0, 0.0), wp.vec3(innov_var, 1.0, 1.0), params.gnss_pos_gate)
        aid.is_active = 1
        if aid.test_ratio <= 1.0:
            if is_reference:
                nominal = fuse_state(params, cov, i, nominal, POS + 2, innov, var)
            else:
                share = bias.var_m2 / innov_var
                bias.bias_m = bias.bias_m + share * innov
                bias.var_m2 = bias.var_m2 * (1.0 - share)
            aid = mark_fused(aid)
        elif starved_s > _RESET_AFTER_S:
            if is_reference:
                nominal.pos_jump_ned = nominal.pos_jump_ned + wp.vec3(0.0, 0.0, innov)
                nominal.pos_ned = nominal.pos_ned + wp.vec3(0.0, 0.0, innov)
                nominal.reset_count += 1
                set_variance(cov, i, POS + 2, var)
            else:
                bias.bias_m = bias.bias_m + innov
                bias.var_m2 = var
            aid = mark_reset(aid)
    return nominal, aid, bias
