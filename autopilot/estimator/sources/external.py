"""External positioning: position, height, velocity and heading that a client measures (motion capture, cameras).

A position is taken as one in ned whose origin is the boot home, without slow errors of its own. Each part is used if
EKF2_EV_CTRL asks for it and the sample holds it. Starts with the first sample (position and velocity once heading is
known, which the sample itself may tell). Stops when samples stop. Sets the state when nothing passed for a while, when
the first sample is far off, and when the client says that it was set anew.
"""

import warp as wp

from autopilot.estimator.delay import MAX_AGE_S, receive
from autopilot.estimator.fuse import (
    fuse_state,
    judge,
    mark_fused,
    mark_reset,
    noise_variance,
    seconds_since,
    set_variance,
)
from autopilot.estimator.health import listen
from autopilot.estimator.params import EstimatorParams
from autopilot.estimator.state import ATT, EXTERNAL_RING, POS, VEL, Aid, Ekf, Nominal
from autopilot.ports import (
    EXTERNAL_HOLDS_HEIGHT,
    EXTERNAL_HOLDS_POS,
    EXTERNAL_HOLDS_VEL,
    EXTERNAL_HOLDS_YAW,
    ExternalSample,
)
from common.kernels import vec24
from common.rotation import quat_from_yaw, wrap_pi, yaw_from_quat

wp.set_module_options({"enable_backward": False})

EXTERNAL_STUCK_AFTER = wp.constant(5)  # equal samples in a row: floats of a camera system never repeat
EXTERNAL_STUCK_MOVED = wp.constant(1.0)  # [m]
_LOST_VAR = wp.constant(1.1e4)  # [m²] beyond 100 m the position is set: float32 would not subtract well
_RESET_AFTER_S = wp.constant(5.0)  # nothing passed for so long: believe the sample rather than the dead reckoning
_MIN_STD = wp.constant(1.0e-3)  # [m], [m/s], [rad]


@wp.struct
class ExternalAxes:
    """Axes of a sample that pass or fail together: those of position, of velocity, or height alone."""

    measured_ned: wp.vec3  # position [m] or velocity [m/s], of which the axes are a part
    std: float  # of each axis
    first: int  # their first error: VEL, POS, or POS + 2 for height alone
    count: int
    gate: float  # standard deviations beyond which the sample is rejected


@wp.func
def external_axes(measured_ned: wp.vec3, std: float, first: int, count: int, gate: float) -> ExternalAxes:
    axes = ExternalAxes()
    axes.measured_ned = measured_ned
    axes.std = std
    axes.first = first
    axes.count = count
    axes.gate = gate
    return axes


@wp.func
def external_repeats(sample: ExternalSample, previous: ExternalSample) -> bool:
    """Both samples hold the same values."""
    return (
        sample.holds == previous.holds
        and sample.pos_ned == previous.pos_ned
        and sample.vel_ned == previous.vel_ned
        and sample.yaw == previous.yaw
    )


@wp.func
def set_external_axes(
    cov: wp.array2d(dtype=vec24), i: int, nominal: Nominal, axes: ExternalAxes, innov: wp.vec3, var: float
) -> Nominal:
    """The state as the axes measure it: moved by their innovations, as sure as they are."""
    is_velocity = axes.first < POS
    offset = axes.first - POS
    if is_velocity:
        offset = axes.first - VEL
    nominal.reset_count += 1
    for axis in range(axes.count):
        jump = wp.vec3()
        jump[offset + axis] = innov[axis]
        if is_velocity:
            nominal.vel_jump_ned = nominal.vel_jump_ned + jump
            nominal.vel_ned = nominal.vel_ned + jump
        else:
            nominal.pos_jump_ned = nominal.pos_jump_ned + jump
            nominal.pos_ned = nominal.pos_ned + jump
        set_variance(cov, i, axes.first + axis, var)
    return nominal


@wp.func
def fuse_external_axes(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    aid: Aid,
    time_us: wp.int64,
    axes: ExternalAxes,
    is_anew: bool,
) -> tuple[Nominal, Aid]:
    """Axes of position or velocity: fused if they pass; set if the state is lost or nothing has passed for long.

    Args:
        params: of the estimator.
        cov: covariances.
        i: which vehicle.
        nominal: the state.
        aid: of these axes.
        time_us: of the sample.
        axes: what is measured.
        is_anew: the client has set its answer anew: the state is set, whatever the gate says.
    """
    var = noise_variance(aid, wp.max(axes.std, _MIN_STD))
    first = axes.first
    is_velocity = first < POS
    offset = first - POS
    predicted = nominal.pos_ned
    if is_velocity:
        offset = first - VEL
        predicted = nominal.vel_ned
    innov = wp.vec3()
    innov_var = wp.vec3(1.0, 1.0, 1.0)
    for axis in range(axes.count):
        innov[axis] = axes.measured_ned[offset + axis] - predicted[offset + axis]
        innov_var[axis] = cov[i, first + axis][first + axis] + var
    starved_s = seconds_since(time_us, aid.fused_time_us)
    aid = judge(aid, time_us, innov, innov_var, axes.count, axes.gate)
    aid.is_active = 1
    is_set = is_anew or cov[i, first][first] > _LOST_VAR
    if aid.test_ratio <= 1.0 and not is_set:
        for axis in range(axes.count):
            believed = nominal.pos_ned[offset + axis]
            if is_velocity:
                believed = nominal.vel_ned[offset + axis]
            nominal = fuse_state(
                params, cov, i, nominal, first + axis, axes.measured_ned[offset + axis] - believed, var
            )
        aid = mark_fused(aid)
    elif is_set or starved_s > _RESET_AFTER_S:
        nominal = set_external_axes(cov, i, nominal, axes, innov, var)
        aid = mark_reset(aid)
    return nominal, aid


@wp.func
def fuse_external_yaw(
    params: EstimatorParams,
    cov: wp.array2d(dtype=vec24),
    i: int,
    nominal: Nominal,
    aid: Aid,
    sample: ExternalSample,
    is_anew: bool,
) -> tuple[Nominal, Aid]:
    """Heading: how far the attitude must be turned about down.

    What tilt errors add to the innovation is left out: a degree of them adds a third of one at a pitch of 20 deg.
    """
    var = noise_variance(aid, wp.max(sample.yaw_std, _MIN_STD))
    innov = wrap_pi(sample.yaw - yaw_from_quat(nominal.q_ned_from_frd))
    innov_var = cov[i, ATT + 2][ATT + 2] + var
    starved_s = seconds_since(sample.time_us, aid.fused_time_us)
    aid = judge(
        aid, sample.time_us, wp.vec3(innov, 0.0, 0.0), wp.vec3(innov_var, 1.0, 1.0), 1, params.external_pos_gate
    )
    aid.is_active = 1
    if aid.test_ratio <= 1.0 and not is_anew:
        nominal = fuse_state(params, cov, i, nominal, ATT + 2, innov, var)
        aid = mark_fused(aid)
    elif is_anew or starved_s > _RESET_AFTER_S:
        nominal.q_ned_from_frd = wp.normalize(quat_from_yaw(innov) * nominal.q_ned_from_frd)
        nominal.yaw_jump = nominal.yaw_jump + innov
        nominal.reset_count += 1
        set_variance(cov, i, ATT + 2, var)
        aid = mark_reset(aid)
    return nominal, aid


@wp.func
def receive_external(ekf: Ekf, i: int) -> None:
    """A new external sample is put into its ring."""
    sample = ekf.external[i]
    head = ekf.rows[i].external_inbox.head
    is_same = head > 0 and external_repeats(sample, ekf.external_ring[i, (head - 1) % EXTERNAL_RING])
    ekf.external_ring[i, head % EXTERNAL_RING] = sample
    ekf.rows[i].external_inbox = receive(
        ekf.rows[i].external_inbox,
        sample.time_us,
        EXTERNAL_RING,
        is_same,
        ekf.rows[i].stillness.is_still == 1,
        ekf.rows[i].nominal.vel_ned,
        EXTERNAL_STUCK_AFTER,
        EXTERNAL_STUCK_MOVED,
    )


@wp.func
def take_external(ekf: Ekf, i: int, params: EstimatorParams, now_us: wp.int64) -> None:
    """Fuses the oldest waiting external sample if the horizon has passed it: heading first, the rest needs it."""
    sample = ekf.external_ring[i, ekf.rows[i].external_inbox.tail % EXTERNAL_RING]
    if sample.time_us > now_us:
        return
    ekf.rows[i].external_inbox.tail += 1
    age_s = seconds_since(now_us, sample.time_us)
    held = sample.holds & params.external_ctrl
    if age_s > MAX_AGE_S or held == 0:
        return
    is_anew = sample.reset_count != ekf.rows[i].external_reset_count
    ekf.rows[i].external_reset_count = sample.reset_count
    cov = ekf.covariance
    nominal = ekf.rows[i].nominal
    if (held & EXTERNAL_HOLDS_YAW) != 0:
        is_first = ekf.rows[i].is_yaw_aligned == 0
        nominal, yaw_aid = fuse_external_yaw(
            params, cov, i, nominal, ekf.rows[i].external_yaw, sample, is_anew or is_first
        )
        ekf.rows[i].external_yaw = yaw_aid
        ekf.rows[i].is_yaw_aligned = 1
    pos_ned = sample.pos_ned + nominal.vel_ned * age_s
    resets_before = nominal.reset_count
    if (held & EXTERNAL_HOLDS_HEIGHT) != 0:
        axes = external_axes(pos_ned, sample.pos_v_std, POS + 2, 1, params.external_pos_gate)
        nominal, height_aid = fuse_external_axes(
            params, cov, i, nominal, ekf.rows[i].external_height, sample.time_us, axes, is_anew
        )
        ekf.rows[i].external_height = height_aid
        if nominal.reset_count != resets_before:
            ekf.rows[i].baro.is_active = 0  # it starts anew, with a reference that fits
    if ekf.rows[i].is_yaw_aligned == 1:
        if (held & EXTERNAL_HOLDS_VEL) != 0:
            axes = external_axes(sample.vel_ned, sample.vel_std, VEL, 3, params.external_vel_gate)
            nominal, vel_aid = fuse_external_axes(
                params, cov, i, nominal, ekf.rows[i].external_vel, sample.time_us, axes, is_anew
            )
            ekf.rows[i].external_vel = vel_aid
        if (held & EXTERNAL_HOLDS_POS) != 0:
            axes = external_axes(pos_ned, sample.pos_h_std, POS, 2, params.external_pos_gate)
            nominal, pos_aid = fuse_external_axes(
                params, cov, i, nominal, ekf.rows[i].external_pos, sample.time_us, axes, is_anew
            )
            ekf.rows[i].external_pos = pos_aid
    ekf.rows[i].nominal = nominal


@wp.func
def listen_external(ekf: Ekf, i: int, now_us: wp.int64) -> None:
    """Switches the parts of silent and frozen external samples off."""
    inbox = ekf.rows[i].external_inbox
    ekf.rows[i].external_pos = listen(ekf.rows[i].external_pos, inbox, now_us)
    ekf.rows[i].external_height = listen(ekf.rows[i].external_height, inbox, now_us)
    ekf.rows[i].external_vel = listen(ekf.rows[i].external_vel, inbox, now_us)
    ekf.rows[i].external_yaw = listen(ekf.rows[i].external_yaw, inbox, now_us)
