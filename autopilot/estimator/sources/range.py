"""Range finder: the distance along body down observes the height of the terrain, and nothing else.

Only the terrain state is corrected: unknown ground must not move the vehicle's height. Starts by setting the terrain,
and sets it again when several samples in a row do not fit: the edge of a crown, of a roof, of a bank.
"""

import warp as wp

from autopilot.estimator.delay import MAX_AGE_S, receive
from autopilot.estimator.fuse import fuse_gain, judge, mark_fused, mark_reset, seconds_since, set_sum_variance
from autopilot.estimator.generated import range_products
from autopilot.estimator.params import EstimatorParams
from autopilot.estimator.sensor_spec import AidSpec, SensorSpec
from autopilot.estimator.state import POS, RANGE_RING, TERRAIN, Aid, Ekf, Inbox, Nominal
from autopilot.ports import RangeSample
from common.kernels import vec24

wp.set_module_options({"enable_backward": False})

RANGE_STUCK_AFTER = wp.constant(12)
RANGE_STUCK_MOVED = wp.constant(1.0)  # [m]
_RESET_AFTER_REJECTS = wp.constant(2)
_MIN_DOWN = wp.constant(0.7)  # cosine of the largest tilt, 45 deg: beyond it the beam meets ground that is elsewhere
_RESTART_AFTER_S = wp.constant(5.0)


@wp.func
def range_repeats(sample: RangeSample, previous: RangeSample) -> bool:
    """Both samples hold the same distance; out of range, a live sensor repeats its limit."""
    return sample.is_valid == 1 and sample.distance_m == previous.distance_m


@wp.func
def range_time(inbox: Inbox, sample: RangeSample) -> wp.int64:
    """The time of the sample; that of the one before if it is no number."""
    if wp.isfinite(sample.distance_m):
        return sample.time_us
    return inbox.arrived_time_us


@wp.func
def receive_range(ekf: Ekf, i: int, sample: RangeSample, is_still: bool, vel_ned: wp.vec3) -> None:
    """Puts a new sample into the ring."""
    inbox = ekf.rows[i].range_inbox
    if sample.time_us != inbox.arrived_time_us:
        is_repeat = inbox.head > 0 and range_repeats(sample, ekf.range_ring[i, (inbox.head - 1) % RANGE_RING])
        ekf.range_ring[i, inbox.head % RANGE_RING] = sample
        rate = wp.vec3(0.0, 0.0, vel_ned[2])
        ekf.rows[i].range_inbox = receive(
            inbox, sample.time_us, RANGE_RING, is_repeat, is_still, rate, RANGE_STUCK_AFTER, RANGE_STUCK_MOVED
        )


@wp.func
def fuse_range(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    aid: Aid,
    sample: RangeSample,
) -> tuple[Nominal, Aid]:
    """The terrain's down coordinate."""
    down_ned = wp.quat_rotate(nominal.q_ned_from_frd, wp.vec3(0.0, 0.0, 1.0))
    if sample.is_valid == 1 and down_ned[2] > _MIN_DOWN:
        std = wp.max(params.range_noise, params.range_noise_fraction * sample.distance_m)
        var = std * std
        measured_d = nominal.pos_ned[2] + sample.distance_m * down_ned[2]
        if seconds_since(sample.time_us, aid.fused_time_us) > _RESTART_AFTER_S:
            aid.is_active = 0
        height = nominal.terrain_d - nominal.pos_ned[2]
        ph, ph_slow, hph = range_products(cov, i, down_ned, height)
        innov = sample.distance_m - height / down_ned[2]
        innov_var = hph + var
        aid = judge(aid, sample.time_us, wp.vec3(innov, 0.0, 0.0), wp.vec3(innov_var, 1.0, 1.0), 1, params.range_gate)
        if aid.is_active == 0 or aid.reject_count >= _RESET_AFTER_REJECTS:
            nominal.terrain_d = measured_d
            set_sum_variance(cov, i, TERRAIN, POS + 2, var)
            aid = mark_reset(aid)
            aid.is_active = 1
        elif aid.test_ratio <= 1.0:
            # The gain that is best for the height above ground: the best one for the terrain alone would keep it from
            # following slow errors of the vehicle's own height.
            gain = vec24()
            gain[TERRAIN] = hph / innov_var * down_ned[2]
            nominal = fuse_gain(params, cov, i, nominal, ph, ph_slow, gain, innov, innov_var)
            aid = mark_fused(aid)
    return nominal, aid


@wp.func
def take_range(ekf: Ekf, i: int, params: EstimatorParams, now_us: wp.int64) -> None:
    """Fuses the oldest waiting distance if the horizon has passed it."""
    sample = ekf.range_ring[i, ekf.rows[i].range_inbox.tail % RANGE_RING]
    if sample.time_us > now_us:
        return
    ekf.rows[i].range_inbox.tail += 1
    if params.range_ctrl == 1 and seconds_since(now_us, sample.time_us) < MAX_AGE_S:
        nominal, aid = fuse_range(params, ekf.covariance, i, ekf.rows[i].nominal, ekf.rows[i].range, sample)
        ekf.rows[i].nominal = nominal
        ekf.rows[i].range = aid


RANGE = SensorSpec(
    name="range",
    label="range finder",
    Sample=RangeSample,
    ring_size=RANGE_RING,
    aids=(AidSpec("range", 1, "m", {"rng_vpos": slice(0, 1)}),),
    status_bit=1 << 8,
    is_optional=True,
    failure_unit=7,
    bias_unit="m",
    wrong_bias=5.0,
)
