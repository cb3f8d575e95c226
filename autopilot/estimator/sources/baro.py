"""Barometer: height above the origin by the standard atmosphere (ISO 2533:1975), fused as down position.

Its drift (weather, warm-up) is a slow error, a random walk. Starts with a reference height such that nothing jumps.
Stops when its value freezes or it falls silent; GNSS height takes over then. When its samples were rejected for long,
the reference is moved if GNSS height agrees with the estimate, and the height is set otherwise.
"""

import warp as wp

from autopilot.estimator.delay import MAX_AGE_S, receive
from autopilot.estimator.fuse import (
    fuse,
    judge,
    mark_fused,
    mark_reset,
    noise_variance,
    offset_products,
    seconds_since,
    set_offset_by_state,
    set_state_by_offset,
)
from autopilot.estimator.health import is_healthy
from autopilot.estimator.params import HEIGHT_REF_GNSS, EstimatorParams
from autopilot.estimator.sensor_spec import AidSpec, SampleTopic, SensorSpec
from autopilot.estimator.state import BARO_RING, POS, SLOW_BARO, SLOW_COUNT, SLOW_COV, Aid, Ekf, Inbox, Nominal
from autopilot.ports import BaroSample
from common.kernels import vec24

wp.set_module_options({"enable_backward": False})

BARO_STUCK_AFTER = wp.constant(12)  # equal values in a row; 0.24 s at 50 Hz
BARO_STUCK_MOVED = wp.constant(1.0)  # [m]
_RESET_AFTER_S = wp.constant(5.0)
_MAX_STEP_S = wp.constant(1.0)
_HEIGHT_SCALE_M = wp.constant(44330.77)  # T0 / L = 288.15 K / 0.0065 K/m
_SEA_LEVEL_PA = wp.constant(101325.0)
_EXPONENT = wp.constant(0.19026324)  # R L / (g M)


@wp.func
def baro_height(pressure_pa: float) -> float:
    """[m] height in the standard atmosphere; single precision resolves 3 mm."""
    return _HEIGHT_SCALE_M * (1.0 - wp.pow(wp.max(pressure_pa, 1.0) / _SEA_LEVEL_PA, _EXPONENT))


@wp.func
def baro_repeats(sample: BaroSample, previous: BaroSample) -> bool:
    """Both samples hold the same pressure."""
    return sample.pressure_pa == previous.pressure_pa


@wp.func
def baro_time(inbox: Inbox, sample: BaroSample) -> wp.int64:
    """The time of the sample; that of the one before if it is no number."""
    if wp.isfinite(sample.pressure_pa):
        return sample.time_us
    return inbox.arrived_time_us


@wp.func
def receive_baro(ekf: Ekf, i: int, sample: BaroSample, is_still: bool, vel_ned: wp.vec3) -> None:
    """Puts a new sample into the ring."""
    inbox = ekf.rows[i].baro_inbox
    if sample.time_us != inbox.arrived_time_us:
        is_repeat = inbox.head > 0 and baro_repeats(sample, ekf.baro_ring[i, (inbox.head - 1) % BARO_RING])
        ekf.baro_ring[i, inbox.head % BARO_RING] = sample
        rate = wp.vec3(0.0, 0.0, vel_ned[2])
        ekf.rows[i].baro_inbox = receive(
            inbox, sample.time_us, BARO_RING, is_repeat, is_still, rate, BARO_STUCK_AFTER, BARO_STUCK_MOVED
        )


@wp.func
def drift_baro(params: EstimatorParams, cov: wp.array2d(dtype=vec24), i: int, dt_s: float) -> None:
    """The variance of the drift after `dt_s`."""
    slow_row = cov[i, SLOW_COV]
    diagonal = (SLOW_COUNT + 1) * SLOW_BARO
    slow_row[diagonal] = slow_row[diagonal] + params.baro_walk * params.baro_walk * dt_s
    cov[i, SLOW_COV] = slow_row


@wp.func
def start_baro(
    cov: wp.array2d(dtype=vec24), i: int, nominal: Nominal, height: float, var: float
) -> tuple[Nominal, float]:
    """The nominal state and the height of the origin with which a standard-atmosphere height fits the position."""
    nominal.slow[SLOW_BARO] = 0.0
    set_offset_by_state(cov, i, POS + 2, SLOW_BARO, var)
    return nominal, height + nominal.pos_ned[2]


@wp.func
def fuse_baro(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    aid: Aid,
    origin_height: float,
    sample: BaroSample,
    age_s: float,
    is_gnss_height_good: bool,
) -> tuple[Nominal, Aid, float]:
    """Down position, against the standard-atmosphere height `origin_height` [m] of the origin."""
    var = noise_variance(aid, params.baro_noise)
    height = baro_height(sample.pressure_pa)
    if aid.is_active == 0:
        nominal, origin_height = start_baro(cov, i, nominal, height, var)
        aid.is_active = 1
    drift_baro(params, cov, i, wp.min(seconds_since(sample.time_us, aid.judged_time_us), _MAX_STEP_S))
    pos_d = origin_height - height + nominal.vel_ned[2] * age_s
    innov = pos_d - nominal.pos_ned[2] - nominal.slow[SLOW_BARO]
    ph, ph_slow, hph = offset_products(cov, i, POS + 2, SLOW_BARO)
    innov_var = hph + var
    starved_s = seconds_since(sample.time_us, aid.fused_time_us)
    aid = judge(aid, sample.time_us, wp.vec3(innov, 0.0, 0.0), wp.vec3(innov_var, 1.0, 1.0), 1, params.baro_gate)
    if aid.test_ratio <= 1.0:
        nominal = fuse(params, cov, i, nominal, ph, ph_slow, innov, innov_var)
        aid = mark_fused(aid)
    elif starved_s > _RESET_AFTER_S:
        if is_gnss_height_good:
            nominal, origin_height = start_baro(cov, i, nominal, height, var)
        else:
            nominal.pos_jump_ned = nominal.pos_jump_ned + wp.vec3(0.0, 0.0, innov)
            nominal.pos_ned = nominal.pos_ned + wp.vec3(0.0, 0.0, innov)
            nominal.reset_count += 1
            set_state_by_offset(cov, i, POS + 2, SLOW_BARO, var)
        aid = mark_reset(aid)
    return nominal, aid, origin_height


@wp.func
def take_baro(ekf: Ekf, i: int, params: EstimatorParams, now_us: wp.int64) -> None:
    """Fuses the oldest waiting pressure if the horizon has passed it, unless GNSS height is preferred and alive."""
    sample = ekf.baro_ring[i, ekf.rows[i].baro_inbox.tail % BARO_RING]
    if sample.time_us > now_us:
        return
    ekf.rows[i].baro_inbox.tail += 1
    age_s = seconds_since(now_us, sample.time_us)
    is_gnss_good = is_healthy(ekf.rows[i].gnss_height)
    if params.baro_ctrl == 0 or age_s > MAX_AGE_S or (params.height_ref == HEIGHT_REF_GNSS and is_gnss_good):
        ekf.rows[i].baro.is_active = 0
        return
    before = ekf.rows[i].baro
    nominal, aid, origin_height = fuse_baro(
        params,
        ekf.covariance,
        i,
        ekf.rows[i].nominal,
        ekf.rows[i].baro,
        ekf.rows[i].origin_baro_height,
        sample,
        age_s,
        is_gnss_good or is_healthy(ekf.rows[i].external_height),
    )
    if before.is_active == 0 or nominal.slow[SLOW_BARO] == 0.0:
        ekf.rows[i].baro_drift_var = 0.0
    step_s = wp.min(seconds_since(sample.time_us, before.judged_time_us), _MAX_STEP_S)
    ekf.rows[i].baro_drift_var += params.baro_walk * params.baro_walk * step_s
    ekf.rows[i].nominal = nominal
    ekf.rows[i].baro = aid
    ekf.rows[i].origin_baro_height = origin_height


BARO = SensorSpec(
    name="baro",
    label="barometer",
    Sample=BaroSample,
    ring_size=BARO_RING,
    aids=(AidSpec("baro", 1, "m", {"baro_vpos": slice(0, 1)}),),
    topic=SampleTopic(
        "sensor_baro",
        {"timestamp_sample": "uint64_t", "pressure": "float", "temperature": "float"},
        {"timestamp_sample": "time_us", "pressure": "pressure_pa", "temperature": "temperature_c"},
    ),
    is_needed_to_arm=True,
    status_bit=1 << 3,
    failure_unit=3,
    bias_unit="Pa",
    wrong_bias=-600.0,  # 50 m too high
)
