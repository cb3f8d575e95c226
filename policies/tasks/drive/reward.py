"""What a decision of Drive pays, and how an episode ends.

Paid is the way that is left less (Ng, Harada and Russell 1999: as a difference it changes nothing that is best but the
hurry), and standing at the goal once. Costs: time, little room, jerks, and a dear one for touching anything.
"""

import warp as wp

from policies.tasks.drive.drive_params import DriveParams
from policies.tasks.episode import HIT_OBSTACLE, HIT_OTHER, LOST, RUNNING, SUCCESS, TIMEOUT
from sim.truth import Truth

wp.set_module_options({"enable_backward": False})

_TIPPED = wp.constant(0.5)  # cosine of the tilt: 60 deg
_IDLE_M_S = wp.constant(0.1)
_STRAYED_M = wp.constant(10.0)  # more way to go than at first


@wp.func
def drive_outcome(
    p: DriveParams, truth: Truth, distance_m: float, turn_rad: float, left_m: float, start_left_m: float, time_s: float
) -> int:
    """How the episode stands, `time_s` after its start."""
    if wp.quat_rotate(truth.q_ned_from_frd, wp.vec3(0.0, 0.0, 1.0))[2] < _TIPPED:
        return HIT_OTHER
    if truth.impact_speed > 0.0 or truth.is_crashed == 1:
        return HIT_OBSTACLE
    is_aligned = wp.abs(turn_rad) < wp.radians(p.align_deg)
    if distance_m < p.reach_m and is_aligned and wp.length(truth.vel_ned) < p.stop_m_s:
        return SUCCESS
    if left_m > start_left_m + _STRAYED_M:
        return LOST
    if time_s >= p.extra_time_s + start_left_m / p.slowest_m_s:
        return TIMEOUT
    return RUNNING


@wp.func
def drive_reward(
    p: DriveParams,
    progress_m: float,
    speed_m_s: float,
    room_m: float,
    outcome: int,
    action: wp.vec2,
    last_action: wp.vec2,
) -> float:
    """Of one decision that made the way shorter by `progress_m` and left `room_m` round the hull, at a speed."""
    change = action - last_action
    tight = wp.clamp(1.0 - room_m / wp.max(p.clearance_m, 1.0e-3), 0.0, 1.0)
    reward = p.progress_reward * progress_m - p.time_cost
    reward -= p.clearance_cost * tight * tight + p.jerk_cost * wp.dot(change, change)
    if speed_m_s < _IDLE_M_S and outcome != SUCCESS:
        reward -= p.idle_cost  # or a greedy policy waits for ever where it does not know what to do
    if outcome == SUCCESS:
        reward += p.arrive_reward
    elif outcome != RUNNING and outcome != TIMEOUT:
        reward -= p.hit_cost
    return reward
