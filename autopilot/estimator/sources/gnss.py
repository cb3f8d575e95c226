"""GNSS: horizontal position, height and velocity, fused as the horizon passes the time of validity.

A position holds white noise and a wander that lasts minutes. The wander is estimated beside the filter, one scalar per
axis, decoupled from it, which costs 5 % in accuracy against the joint filter and saves three states (one-dimensional
Monte Carlo, 200 runs). So a vehicle that boots at the origin keeps its place though the receiver says otherwise.

Starts with the first good fix once heading is known. Stops with the fix. Sets position and velocity when the first fix
is far off or nothing passed the gate for a while.
"""

import warp as wp

from autopilot.estimator.fuse import (
    fuse,
    fuse_state,
    judge,
    mark_fused,
    mark_reset,
    noise_variance,
    seconds_since,
    set_variance,
)
from autopilot.estimator.params import GPS_CTRL_HEIGHT, GPS_CTRL_POS, GPS_CTRL_VEL, EstimatorParams
from autopilot.estimator.state import POS, VEL, Aid, GnssWander, Nominal
from autopilot.ports import GnssSample
from common.kernels import vec24

wp.set_module_options({"enable_backward": False})

GNSS_STUCK_AFTER = wp.constant(3)  # equal solutions in a row: floats of a live receiver never repeat
VERTICAL_FACTOR = wp.constant(1.5)  # vertical over horizontal error, from satellite geometry
# The receiver's accuracy figures hold both errors; guess at how they divide, for receivers worse than the parameters
_WHITE_SHARE_POS = wp.constant(0.3)
_SLOW_SHARE_POS = wp.constant(0.6)
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
) -> tuple[Nominal, Aid]:
    """Velocity: three axes that pass or fail together."""
    var = noise_variance(aid, gnss_vel_std(params, sample))
    if (params.gnss_ctrl & GPS_CTRL_VEL) != 0:
        innov = sample.vel_ned - nominal.vel_ned
        innov_var = wp.vec3(cov[i, VEL][VEL] + var, cov[i, VEL + 1][VEL + 1] + var, cov[i, VEL + 2][VEL + 2] + var)
        starved_s = seconds_since(sample.time_us, aid.fused_time_us)
        aid = judge(aid, sample.time_us, innov, innov_var, 3, params.gnss_vel_gate)
        aid.is_active = 1
        if aid.test_ratio <= 1.0:
            for axis in range(3):
                axis_innov = sample.vel_ned[axis] - nominal.vel_ned[axis]
                nominal = fuse_state(params, cov, i, nominal, VEL + axis, axis_innov, var)
            aid = mark_fused(aid)
        elif starved_s > _RESET_AFTER_S:
            nominal.vel_jump_ned = nominal.vel_jump_ned + innov
            nominal.vel_ned = sample.vel_ned
            nominal.reset_count += 1
            for axis in range(3):
                set_variance(cov, i, VEL + axis, var)
            aid = mark_reset(aid)
    return nominal, aid


@wp.func
def gnss_wander_std(params: EstimatorParams, sample: GnssSample) -> float:
    """[m] slow error per horizontal axis."""
    return wp.max(params.gnss_wander, _SLOW_SHARE_POS * sample.pos_h_std)


@wp.func
def propagate_wander(params: EstimatorParams, wander: GnssWander, sample: GnssSample) -> GnssWander:
    """The wander at the time of the sample: a first-order Gauss-Markov process on each axis."""
    std = gnss_wander_std(params, sample)
    stationary = wp.vec3(std * std, std * std, VERTICAL_FACTOR * VERTICAL_FACTOR * std * std)
    keep = float(0.0)
    if wander.time_us != wp.int64(0):
        keep = wp.exp(-seconds_since(sample.time_us, wander.time_us) / params.gnss_wander_time)
    wander.offset_ned = wander.offset_ned * keep
    wander.var_ned = stationary + (wander.var_ned - stationary) * (keep * keep)
    wander.time_us = sample.time_us
    return wander


@wp.func
def fuse_gnss_axis(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    wander: GnssWander,
    axis: int,
    measured: float,
    var: float,
) -> tuple[Nominal, GnssWander]:
    """One position axis: the innovation is shared between the state and the wander by their variances."""
    ph = cov[i, POS + axis]
    wander_var = wander.var_ned[axis]
    innov = measured - nominal.pos_ned[axis] - wander.offset_ned[axis]
    innov_var = ph[POS + axis] + wander_var + var
    wander.offset_ned[axis] = wander.offset_ned[axis] + wander_var / innov_var * innov
    wander.var_ned[axis] = wander_var - wander_var * wander_var / innov_var
    nominal = fuse(params, cov, i, nominal, ph, innov, innov_var)
    return nominal, wander


@wp.func
def fuse_gnss_pos(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    aid: Aid,
    wander: GnssWander,
    sample: GnssSample,
    age_s: float,
) -> tuple[Nominal, Aid, GnssWander]:
    """Horizontal position: two axes that pass or fail together."""
    var = noise_variance(aid, gnss_pos_std(params, sample))
    if (params.gnss_ctrl & GPS_CTRL_POS) != 0:
        pos_ned = sample.pos_ned + nominal.vel_ned * age_s
        innov = pos_ned - nominal.pos_ned - wander.offset_ned
        innov[2] = 0.0
        innov_var = wp.vec3(
            cov[i, POS][POS] + wander.var_ned[0] + var, cov[i, POS + 1][POS + 1] + wander.var_ned[1] + var, 1.0
        )
        starved_s = seconds_since(sample.time_us, aid.fused_time_us)
        aid = judge(aid, sample.time_us, innov, innov_var, 2, params.gnss_pos_gate)
        aid.is_active = 1
        if aid.test_ratio <= 1.0:
            for axis in range(2):
                nominal, wander = fuse_gnss_axis(params, cov, i, nominal, wander, axis, pos_ned[axis], var)
            aid = mark_fused(aid)
        elif starved_s > _RESET_AFTER_S:
            wander_std = gnss_wander_std(params, sample)
            wander_var = wander_std * wander_std
            jump = wp.vec3(pos_ned[0] - nominal.pos_ned[0], pos_ned[1] - nominal.pos_ned[1], 0.0)
            nominal.pos_jump_ned = nominal.pos_jump_ned + jump
            nominal.pos_ned = nominal.pos_ned + jump
            nominal.reset_count += 1
            set_variance(cov, i, POS, var + wander_var)
            set_variance(cov, i, POS + 1, var + wander_var)
            wander.offset_ned = wp.vec3(0.0, 0.0, wander.offset_ned[2])
            wander.var_ned = wp.vec3(wander_var, wander_var, wander.var_ned[2])
            aid = mark_reset(aid)
    return nominal, aid, wander


@wp.func
def fuse_gnss_height(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    aid: Aid,
    wander: GnssWander,
    sample: GnssSample,
    age_s: float,
    is_reference: bool,
) -> tuple[Nominal, Aid, GnssWander]:
    """Height. Nothing fits for long: the state is set if this is the height reference, else the wander is."""
    var = noise_variance(aid, VERTICAL_FACTOR * gnss_pos_std(params, sample))
    if (params.gnss_ctrl & GPS_CTRL_HEIGHT) != 0:
        pos_d = sample.pos_ned[2] + nominal.vel_ned[2] * age_s
        innov = pos_d - wander.offset_ned[2] - nominal.pos_ned[2]
        innov_var = cov[i, POS + 2][POS + 2] + wander.var_ned[2] + var
        starved_s = seconds_since(sample.time_us, aid.fused_time_us)
        aid = judge(
            aid, sample.time_us, wp.vec3(innov, 0.0, 0.0), wp.vec3(innov_var, 1.0, 1.0), 1, params.gnss_pos_gate
        )
        aid.is_active = 1
        if aid.test_ratio <= 1.0:
            nominal, wander = fuse_gnss_axis(params, cov, i, nominal, wander, 2, pos_d, var)
            aid = mark_fused(aid)
        elif starved_s > _RESET_AFTER_S:
            if is_reference:
                jump = wp.vec3(0.0, 0.0, innov)
                nominal.pos_jump_ned = nominal.pos_jump_ned + jump
                nominal.pos_ned = nominal.pos_ned + jump
                nominal.reset_count += 1
                set_variance(cov, i, POS + 2, innov_var)
            else:
                wander.offset_ned[2] = wander.offset_ned[2] + innov
            aid = mark_reset(aid)
    return nominal, aid, wander
