"""Optical flow, with the distance known: velocity over ground along the body's x and y. Never resets anything."""

import warp as wp

from autopilot.estimator.delay import MAX_AGE_S, receive
from autopilot.estimator.fuse import fuse, judge, mark_fused, seconds_since, state_slow
from autopilot.estimator.params import EstimatorParams
from autopilot.estimator.sensor_spec import AidSpec, SampleTopic, SensorSpec
from autopilot.estimator.state import FLOW_RING, VEL, Ekf, Inbox
from autopilot.ports import FlowSample

wp.set_module_options({"enable_backward": False})

_STUCK_AFTER = wp.constant(12)
_STUCK_MOVED = wp.constant(3.0)  # [m]


@wp.func
def flow_time(inbox: Inbox, sample: FlowSample) -> wp.int64:
    """The time of the sample; that of the one before if it is no number."""
    if wp.isfinite(sample.vel_frd):
        return sample.time_us
    return inbox.arrived_time_us


@wp.func
def receive_flow(ekf: Ekf, i: int, sample: FlowSample, is_still: bool, vel_ned: wp.vec3) -> None:
    """Puts a new sample into the ring."""
    inbox = ekf.rows[i].flow_inbox
    if sample.time_us != inbox.arrived_time_us:
        before = ekf.flow_ring[i, (inbox.head - 1) % FLOW_RING]
        is_repeat = inbox.head > 0 and sample.vel_frd == before.vel_frd
        ekf.flow_ring[i, inbox.head % FLOW_RING] = sample
        ekf.rows[i].flow_inbox = receive(
            inbox, sample.time_us, FLOW_RING, is_repeat, is_still, vel_ned, _STUCK_AFTER, _STUCK_MOVED
        )


@wp.func
def take_flow(ekf: Ekf, i: int, params: EstimatorParams, now_us: wp.int64) -> None:
    """Fuses the oldest waiting velocity if the horizon has passed it; attitude counts as known."""
    sample = ekf.flow_ring[i, ekf.rows[i].flow_inbox.tail % FLOW_RING]
    if sample.time_us > now_us:
        return
    ekf.rows[i].flow_inbox.tail += 1
    if seconds_since(now_us, sample.time_us) > MAX_AGE_S:
        return
    cov = ekf.covariance
    innov = wp.vec3()
    innov_var = wp.vec3(1.0, 1.0, 1.0)
    for axis in range(2):
        axis_frd = wp.vec3()
        axis_frd[axis] = 1.0
        axis_ned = wp.quat_rotate(ekf.rows[i].nominal.q_ned_from_frd, axis_frd)
        ph = axis_ned[0] * cov[i, VEL] + axis_ned[1] * cov[i, VEL + 1] + axis_ned[2] * cov[i, VEL + 2]
        hph = axis_ned[0] * ph[VEL] + axis_ned[1] * ph[VEL + 1] + axis_ned[2] * ph[VEL + 2]
        ph_slow = axis_ned[0] * state_slow(cov, i, VEL)
        ph_slow = ph_slow + axis_ned[1] * state_slow(cov, i, VEL + 1) + axis_ned[2] * state_slow(cov, i, VEL + 2)
        innov[axis] = sample.vel_frd[axis] - wp.dot(axis_ned, ekf.rows[i].nominal.vel_ned)
        innov_var[axis] = hph + params.flow_noise * params.flow_noise
        if wp.abs(innov[axis]) <= params.flow_gate * wp.sqrt(innov_var[axis]):
            ekf.rows[i].nominal = fuse(params, cov, i, ekf.rows[i].nominal, ph, ph_slow, innov[axis], innov_var[axis])
    aid = judge(ekf.rows[i].flow, sample.time_us, innov, innov_var, 2, params.flow_gate)
    aid.is_active = 1
    if aid.test_ratio <= 1.0:
        aid = mark_fused(aid)
    ekf.rows[i].flow = aid


FLOW = SensorSpec(
    name="flow",
    label="optical flow",
    Sample=FlowSample,
    ring_size=FLOW_RING,
    aids=(AidSpec("flow", 2, "m/s", {"flow": slice(0, 2)}),),
    topic=SampleTopic(
        "vehicle_optical_flow_vel",
        {"timestamp_sample": "uint64_t", "vel_body": "float[2]"},
        {"timestamp_sample": "time_us", "vel_body": "vel_frd"},
    ),
    is_needed_to_arm=True,
    status_bit=1 << 6,  # MAV_SYS_STATUS_SENSOR_OPTICAL_FLOW
    is_optional=True,
    failure_unit=5,  # FAILURE_UNIT_SENSOR_OPTICAL_FLOW
    bias_unit="m/s",
    wrong_bias=10.0,
)
