"""Scalar measurement updates: the only code that lowers the covariance or corrects the nominal state.

In: P H' (`ph`, and `ph_slow` for the slow errors of sensors) and H P H' + R of one scalar, and its innovation. Each
update subtracts an exactly symmetric product, which keeps a float32 covariance symmetric and positive where P - K H P
does not.
"""

import warp as wp

from autopilot.estimator.params import EstimatorParams
from autopilot.estimator.state import (
    ACCEL_BIAS,
    ATT,
    BODY,
    EARTH,
    GYRO_BIAS,
    POS,
    SLOW,
    SLOW_COUNT,
    SLOW_COV,
    TERRAIN,
    VEL,
    WIND,
    Aid,
    Nominal,
)
from common.kernels import ERROR_STATES, vec24
from common.rotation import quat_from_rotvec
from common.vectors import clamp3

wp.set_module_options({"enable_backward": False})

_RATIO_LPF_GAIN = wp.constant(0.1)  # per sample
_NOISE_GAIN = wp.constant(0.05)  # per sample: e-fold in 20 samples of twice the expected variance
_FAIR_EXCESS = wp.constant(1.4)  # mean 1 if the parameters are right; the margin keeps the scale at 1 then
_MAX_EXCESS = wp.constant(10.0)  # a single outlier counts no more than that
_MAX_NOISE_SCALE = wp.constant(1.0e4)


@wp.func
def part3(error: vec24, first: int) -> wp.vec3:
    """Three neighbouring elements of an error state."""
    return wp.vec3(error[first], error[first + 1], error[first + 2])


@wp.func
def bias_part(error: vec24) -> vec24:
    """The elements of the accelerometer bias; zero elsewhere."""
    out = vec24()
    for k in range(ACCEL_BIAS, ACCEL_BIAS + 3):
        out[k] = error[k]
    return out


@wp.func
def inject(params: EstimatorParams, nominal: Nominal, error: vec24, error_slow: wp.vec4) -> Nominal:
    """The nominal state corrected by an error estimate.

    The covariance is not turned into the new tangent space: the change is of second order in the correction.
    """
    nominal.q_ned_from_frd = wp.normalize(quat_from_rotvec(part3(error, ATT)) * nominal.q_ned_from_frd)
    nominal.vel_ned = nominal.vel_ned + part3(error, VEL)
    nominal.pos_ned = nominal.pos_ned + part3(error, POS)
    nominal.gyro_bias_frd = clamp3(nominal.gyro_bias_frd + part3(error, GYRO_BIAS), wp.vec3(params.gyro_bias_limit))
    nominal.accel_bias_frd = clamp3(nominal.accel_bias_frd + part3(error, ACCEL_BIAS), wp.vec3(params.accel_bias_limit))
    nominal.earth_field_ned = nominal.earth_field_ned + part3(error, EARTH)
    nominal.body_field_frd = nominal.body_field_frd + part3(error, BODY)
    nominal.wind_ned = nominal.wind_ned + wp.vec3(error[WIND], error[WIND + 1], 0.0)
    nominal.terrain_d = nominal.terrain_d + error[TERRAIN]
    nominal.slow = nominal.slow + error_slow
    return nominal


@wp.func
def state_slow(cov: wp.array2d(dtype=vec24), i: int, k: int) -> wp.vec4:
    """Covariances of the slow errors with error k."""
    return wp.vec4(cov[i, SLOW][k], cov[i, SLOW + 1][k], cov[i, SLOW + 2][k], cov[i, SLOW + 3][k])


@wp.func
def offset_products(cov: wp.array2d(dtype=vec24), i: int, k: int, j: int) -> tuple[vec24, wp.vec4, float]:
    """P H' (of the error state and of the slow errors) and H P H' of error k plus slow error j.

    Both may be large and cancel, so rounding could take H P H' below zero.
    """
    ph = cov[i, k] + cov[i, SLOW + j]
    slow_row = cov[i, SLOW_COV]
    first = SLOW_COUNT * j
    ph_slow = state_slow(cov, i, k) + wp.vec4(
        slow_row[first], slow_row[first + 1], slow_row[first + 2], slow_row[first + 3]
    )
    return ph, ph_slow, wp.max(ph[k] + ph_slow[j], 0.0)


@wp.func
def fuse(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    ph: vec24,
    ph_slow: wp.vec4,
    innov: float,
    innov_var: float,
) -> Nominal:
    """Kalman update with one scalar: P -= w w', w = P H' / sqrt(S).

    An accelerometer bias that is held is considered, not corrected (Schmidt 1966): its own block of P stays as it was,
    the rest is that of the full update.
    """
    inv_root = 1.0 / wp.sqrt(innov_var)
    w = ph * inv_root
    w_slow = ph_slow * inv_root
    for r in range(ERROR_STATES):
        cov[i, r] = cov[i, r] - w[r] * w
    slow_row = cov[i, SLOW_COV]
    for j in range(SLOW_COUNT):
        cov[i, SLOW + j] = cov[i, SLOW + j] - w_slow[j] * w
        for k in range(SLOW_COUNT):
            slow_row[SLOW_COUNT * j + k] = slow_row[SLOW_COUNT * j + k] - w_slow[j] * w_slow[k]
    cov[i, SLOW_COV] = slow_row
    if nominal.holds_accel_bias == 1:
        w_bias = bias_part(w)
        for r in range(ACCEL_BIAS, ACCEL_BIAS + 3):
            cov[i, r] = cov[i, r] + w[r] * w_bias
        w = w - w_bias
    return inject(params, nominal, w * (innov * inv_root), w_slow * (innov * inv_root))


@wp.func
def fuse_state(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    k: int,
    innov: float,
    obs_var: float,
) -> Nominal:
    """Kalman update with a direct measurement of error k."""
    ph = cov[i, k]
    return fuse(params, cov, i, nominal, ph, state_slow(cov, i, k), innov, ph[k] + obs_var)


@wp.func
def fuse_part(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    ph: vec24,
    ph_slow: wp.vec4,
    innov: float,
    innov_var: float,
    first: int,
    count: int,
) -> Nominal:
    """Update of `count` states from `first` on; the others are considered, not corrected (Schmidt 1966)."""
    gain = vec24()
    for r in range(first, first + count):
        gain[r] = ph[r] / innov_var
    return fuse_gain(params, cov, i, nominal, ph, ph_slow, gain, innov, innov_var)


@wp.func
def fuse_gain(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    ph: vec24,
    ph_slow: wp.vec4,
    gain: vec24,
    innov: float,
    innov_var: float,
) -> Nominal:
    """Update with any gain on the error state and none on the slow errors.

    P - K H P - P H' K' + K S K' stays positive, whatever K is.
    """
    if nominal.holds_accel_bias == 1:
        gain = gain - bias_part(gain)
    scaled = gain * wp.sqrt(innov_var)
    for r in range(ERROR_STATES):
        cov[i, r] = cov[i, r] - (ph[r] * gain + gain[r] * ph) + scaled[r] * scaled
    for j in range(SLOW_COUNT):
        cov[i, SLOW + j] = cov[i, SLOW + j] - ph_slow[j] * gain
    return inject(params, nominal, gain * innov, wp.vec4())


@wp.func
def set_variance(cov: wp.array2d(dtype=vec24), i: int, k: int, variance: float) -> None:
    """Forgets what is known of error k: its correlations vanish and its variance is set."""
    for r in range(SLOW_COV):
        row = cov[i, r]
        row[k] = 0.0
        cov[i, r] = row
    row_k = vec24()
    row_k[k] = variance
    cov[i, k] = row_k


@wp.func
def set_sum_variance(cov: wp.array2d(dtype=vec24), i: int, k: int, other: int, obs_var: float) -> None:
    """Error k after its state was set to state `other` plus a measurement: it is wrong by what that one is wrong."""
    row_k = cov[i, other]
    row_k[k] = row_k[other] + obs_var
    for r in range(SLOW_COV):
        row = cov[i, r]
        row[k] = row[other]
        cov[i, r] = row
    cov[i, k] = row_k


@wp.func
def set_slow_variance(cov: wp.array2d(dtype=vec24), i: int, j: int, variance: float) -> None:
    """Forgets what is known of slow error j."""
    cov[i, SLOW + j] = vec24()
    slow_row = cov[i, SLOW_COV]
    for k in range(SLOW_COUNT):
        slow_row[SLOW_COUNT * j + k] = 0.0
        slow_row[SLOW_COUNT * k + j] = 0.0
    slow_row[(SLOW_COUNT + 1) * j] = variance
    cov[i, SLOW_COV] = slow_row


@wp.func
def set_state_by_offset(cov: wp.array2d(dtype=vec24), i: int, k: int, j: int, obs_var: float) -> None:
    """Error k after its state was set to a measurement minus slow error j: wrong by what that one is wrong."""
    slow_row = cov[i, SLOW_COV]
    set_variance(cov, i, k, slow_row[(SLOW_COUNT + 1) * j] + obs_var)
    row_k = cov[i, k]
    for r in range(ERROR_STATES):
        if r != k:
            row_k[r] = -cov[i, SLOW + j][r]
            row = cov[i, r]
            row[k] = row_k[r]
            cov[i, r] = row
    cov[i, k] = row_k
    for m in range(SLOW_COUNT):
        row = cov[i, SLOW + m]
        row[k] = -slow_row[SLOW_COUNT * j + m]
        cov[i, SLOW + m] = row


@wp.func
def set_offset_by_state(cov: wp.array2d(dtype=vec24), i: int, k: int, j: int, obs_var: float) -> None:
    """Slow error j after it was set to a measurement minus state k: wrong by what that one is wrong."""
    row_k = cov[i, k]
    with_slow = state_slow(cov, i, k)
    set_slow_variance(cov, i, j, row_k[k] + obs_var)
    cov[i, SLOW + j] = -row_k
    slow_row = cov[i, SLOW_COV]
    for m in range(SLOW_COUNT):
        if m != j:
            slow_row[SLOW_COUNT * j + m] = -with_slow[m]
            slow_row[SLOW_COUNT * m + j] = -with_slow[m]
    cov[i, SLOW_COV] = slow_row


@wp.func
def judge(aid: Aid, time_us: wp.int64, innov: wp.vec3, innov_var: wp.vec3, components: int, gate_sigma: float) -> Aid:
    """The aid with its innovations, test ratio and noise scale.

    The variance of a source that has become noisier than its parameter says is learned from differences of successive
    innovations, which a bias or a jump leaves alone (after Mehra 1970, "On the identification of variances").

    Args:
        aid: of the source.
        time_us: of the sample.
        innov: measured minus predicted; 0 in components that the source lacks.
        innov_var: with the noise scale applied; 1 in components that the source lacks.
        components: that the source has.
        gate_sigma: standard deviations beyond which a sample is rejected.
    """
    change = innov - aid.innov
    novelty = wp.cw_div(wp.cw_mul(change, change), innov_var)
    excess = wp.min((novelty[0] + novelty[1] + novelty[2]) / (2.0 * float(components)), _MAX_EXCESS) - _FAIR_EXCESS
    if aid.judged_time_us != wp.int64(0):
        aid.noise_scale = wp.clamp(aid.noise_scale * wp.exp(_NOISE_GAIN * excess), 1.0, _MAX_NOISE_SCALE)
    aid.judged_time_us = time_us
    aid.innov = innov
    aid.innov_var = innov_var
    squared = wp.cw_div(wp.cw_mul(innov, innov), innov_var)
    aid.test_ratio = wp.max(squared[0], wp.max(squared[1], squared[2])) / (gate_sigma * gate_sigma)
    aid.test_ratio_lpf = aid.test_ratio_lpf + _RATIO_LPF_GAIN * (aid.test_ratio - aid.test_ratio_lpf)
    if aid.test_ratio > 1.0:
        aid.reject_count += 1
    else:
        aid.reject_count = 0
    return aid


@wp.func
def noise_variance(aid: Aid, std: float) -> float:
    """Variance of a source's noise: the square of `std`, times the scale learned."""
    return std * std * wp.max(aid.noise_scale, 1.0)


@wp.func
def mark_fused(aid: Aid) -> Aid:
    """The aid after its judged sample was fused."""
    aid.fused_time_us = aid.judged_time_us
    return aid


@wp.func
def mark_reset(aid: Aid) -> Aid:
    """The aid after the state was set to its judged sample."""
    aid.fused_time_us = aid.judged_time_us
    aid.reset_count += 1
    aid.reject_count = 0
    return aid


@wp.func
def seconds_since(now_us: wp.int64, then_us: wp.int64) -> float:
    """Seconds between two times; a million where `then` never was."""
    if then_us == wp.int64(0):
        return 1.0e6
    return float(now_us - then_us) * 1.0e-6
