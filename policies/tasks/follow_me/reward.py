"""What a decision pays, and how an episode ends.

Ours: near the best distance, the owner ahead and in sight, level with them; no jerks, no turning for nothing, room to
obstacles, no haste where the camera does not look; dear collisions and losses, which end the episode. The document's:
per payment more within 3 m than otherwise, and a fine for a collision. Time is up at the limit: a success if the owner
is followed then.
"""

import math

import warp as wp

from policies.tasks.episode import HIT_OBSTACLE, HIT_OTHER, LOST, RUNNING, SUCCESS, TIMEOUT
from policies.tasks.flight.own_state import SPEED_MAX_M_S
from policies.tasks.follow_me.follow_me_params import FollowParams
from policies.tasks.follow_me.owner_visibility import Sight

wp.set_module_options({"enable_backward": False})

PAYMENTS = wp.constant(5.0)  # per decision: one each 20 ms, Unity's physics step
_RADIANS = wp.constant(math.pi / 180.0)
_FAR_MAX_M = wp.constant(5.0)
_HEIGHT_MAX_M = wp.constant(3.0)
_NEAR_MARGIN = wp.constant(1.3)


@wp.func
def is_in_band(n: FollowParams, sight: Sight) -> bool:
    """Whether the owner is neither too near nor too far."""
    return sight.distance_m >= n.near_m and sight.distance_m <= n.far_m


@wp.func
def bell(off: float, width: float) -> float:
    """1 at 0, e^-0.5 at a width."""
    return wp.exp(-0.5 * off * off / (width * width))


@wp.func
def follow_outcome(n: FollowParams, sight: Sight, has_touched: bool, unseen_s: float, step: int) -> int:
    """How the episode stands after decision `step`, counted from 1."""
    if has_touched:
        return HIT_OBSTACLE
    if sight.reach_m < n.touch_m:
        return HIT_OTHER
    if sight.distance_m > n.lost_m or unseen_s > n.unseen_limit_s:
        return LOST
    if float(step) >= n.decision_limit:
        if is_in_band(n, sight) and sight.is_in_view == 1:
            return SUCCESS
        return TIMEOUT
    return RUNNING


@wp.func
def blind_speed(action: wp.vec4) -> float:
    """How fast an action asks to fly to where the camera, which sees 45 degrees to either side, does not look [m/s]."""
    aside = wp.max(wp.abs(action[1]) - wp.max(action[0], 0.0), 0.0)
    back = wp.max(-action[0], 0.0)
    return SPEED_MAX_M_S * wp.sqrt(aside * aside + back * back)


@wp.func
def jerk(change: wp.vec4, square_max: float) -> float:
    """The squared change of an action; what is more than so much counts by its size only: Huber's loss."""
    square = wp.dot(change, change)
    if square <= square_max:
        return square
    return 2.0 * wp.sqrt(square_max * square) - square_max


@wp.func
def follow_reward(n: FollowParams, sight: Sight, outcome: int, action: wp.vec4, last_action: wp.vec4) -> float:
    """Ours, of one decision."""
    distance = sight.distance_m
    reward = n.distance_reward * bell(distance - n.best_distance_m, n.distance_width_m)
    if sight.is_in_view == 1:
        reward += n.view_reward * bell(sight.bearing_rad, n.view_width_deg * _RADIANS)
    reward -= n.far_cost * wp.clamp(distance - n.far_m, 0.0, _FAR_MAX_M)
    reward -= n.near_cost * wp.max(_NEAR_MARGIN * n.near_m - distance, 0.0)
    height = sight.position_hfrd[2] - n.best_height_m  # the chest lies this much lower than it should
    reward -= n.height_cost * wp.min(wp.abs(height), _HEIGHT_MAX_M)
    reward -= n.jerk_cost * jerk(action - last_action, n.jerk_max)
    reward -= n.turn_cost * action[3] * action[3]
    blind = blind_speed(action)
    reward -= n.blind_cost * blind * blind
    tight = wp.max(1.0 - sight.room_m / wp.max(n.clearance_m, 1.0e-3), 0.0)
    reward -= n.clearance_cost * tight * tight
    if outcome == HIT_OBSTACLE or outcome == HIT_OTHER:  # noqa: SIM109  (kernels know no tuples)
        reward -= n.collision_cost
    if outcome == LOST:
        reward -= n.lost_cost
    return reward


@wp.func
def document_reward(n: FollowParams, sight: Sight, outcome: int) -> float:
    """The document's, of one decision: its payments at where the decision led, and a collision's fine once."""
    if outcome == HIT_OBSTACLE or outcome == HIT_OTHER:  # noqa: SIM109  (kernels know no tuples)
        return n.document_collision
    if sight.distance_m <= n.far_m:
        return PAYMENTS * n.document_within
    return PAYMENTS * n.document_beyond
