"""What a decision of Navigate pays, and how an episode ends.

Paid is the way made towards the goal, up to the wanted speed; arriving is paid once. Costs: little room, the wrong
height, flying other than ahead, jerks; dear ones for touching anything and for leaving the forest upwards.
"""

import warp as wp

from common.rotation import yaw_from_quat
from policies.tasks.episode import HIT_OBSTACLE, LOST, RUNNING, SUCCESS, TIMEOUT
from policies.tasks.flight.own_state import level_from_ned
from policies.tasks.navigate.navigate_params import NavigateParams
from sim.truth import Truth

wp.set_module_options({"enable_backward": False})

_FOLLOWED_M = wp.constant(5.0)  # no farther behind than it was to stay is followed; guess
_MOVING_M_S = wp.constant(1.0)  # below it there is no course to look along


@wp.func
def navigate_outcome(
    n: NavigateParams, distance_m: float, has_touched: bool, height_m: float, time_s: float, start_distance_m: float
) -> int:
    """How the episode stands, `time_s` after its start."""
    if has_touched:
        return HIT_OBSTACLE
    if height_m > n.ceiling_m:
        return LOST
    if n.kept_m <= 0.0 and distance_m < n.goal_radius_m:
        return SUCCESS
    if time_s * n.slowest_m_s >= start_distance_m:
        if n.kept_m > 0.0 and distance_m < n.kept_m + _FOLLOWED_M:
            return SUCCESS
        return TIMEOUT
    return RUNNING


@wp.func
def navigate_reward(
    n: NavigateParams,
    truth: Truth,
    progress_m: float,
    step_s: float,
    room_m: float,
    outcome: int,
    action: wp.vec4,
    last_action: wp.vec4,
) -> float:
    """Of one decision that led `progress_m` nearer to the goal and left `room_m` to the nearest obstacle."""
    reward = n.progress_reward * wp.min(progress_m, n.speed_m_s * step_s) - n.time_cost
    tight = wp.max(1.0 - room_m / wp.max(n.clearance_m, 1.0e-3), 0.0)
    reward -= n.clearance_cost * tight * tight
    high = truth.height_agl_m - n.goal_height_m
    reward -= n.height_cost * high * high
    vel_hfrd = level_from_ned(truth.vel_ned, yaw_from_quat(truth.q_ned_from_frd))
    speed = wp.sqrt(vel_hfrd[0] * vel_hfrd[0] + vel_hfrd[1] * vel_hfrd[1])
    if speed > _MOVING_M_S:
        reward -= n.heading_cost * 0.5 * (1.0 - vel_hfrd[0] / speed)
    change = action - last_action
    reward -= n.jerk_cost * wp.dot(change, change)
    reward -= n.turn_cost * action[3] * action[3]
    if outcome == SUCCESS:
        reward += n.goal_reward
    if outcome == HIT_OBSTACLE:
        reward -= n.collision_cost
    if outcome == LOST:
        reward -= n.ceiling_cost
    return reward
