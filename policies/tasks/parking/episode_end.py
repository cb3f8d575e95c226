"""When an episode ends, and what our `progress` reward pays for a step: common to both levels."""

import warp as wp

from policies.tasks.episode import HIT_OBSTACLE, HIT_WALL, RUNNING, SUCCESS, TIMEOUT
from policies.tasks.parking.arena import forward_of, position_of, right_of
from policies.tasks.parking.car import box_of_car
from policies.tasks.parking.drive import Motion
from policies.tasks.parking.parking_params import CarParams
from policies.tasks.parking.rewards import shaping, way_to_go
from policies.tasks.parking.scene import OBSTACLE, PAD, WALL
from policies.tasks.parking.settings import Rules

wp.set_module_options({"enable_backward": False})


@wp.func
def heading_error(car: wp.vec4, goal: wp.vec4) -> float:
    """From the car's nose to the pad's [rad]."""
    nose = forward_of(goal)
    return wp.atan2(wp.dot(nose, right_of(car)), wp.dot(nose, forward_of(car)))


@wp.func
def is_in_pose(motion: Motion, goal: wp.vec4, params: CarParams) -> bool:
    """Whether the car's box is at the pad's centre, aligned and slow."""
    gap = position_of(box_of_car(motion.pose, params.box_ahead_m)) - position_of(goal)
    return (
        wp.length(gap) < params.reach_m
        and wp.length(motion.vel) < params.stop_m_s
        and wp.abs(heading_error(motion.pose, goal)) < wp.radians(params.align_deg)
    )


@wp.func
def outcome_of(contact: int, motion: Motion, goal: wp.vec4, rules: Rules, params: CarParams) -> int:
    """How the episode ends with this contact, or RUNNING."""
    if contact == WALL:
        return HIT_WALL
    if contact == OBSTACLE:
        return HIT_OBSTACLE
    if contact == PAD and (not rules.needs_pose or is_in_pose(motion, goal, params)):
        return SUCCESS
    return RUNNING


@wp.func
def end_reward(outcome: int, params: CarParams) -> float:
    """Rows 1, 2 and 3."""
    return wp.where(
        outcome == SUCCESS,
        params.park_reward,
        wp.where(
            outcome == HIT_WALL,
            params.wall_hit_reward,
            wp.where(outcome == HIT_OBSTACLE, params.obstacle_hit_reward, 0.0),
        ),
    )


@wp.func
def capped(outcome: int, steps: int, params: CarParams) -> int:
    """The outcome, or TIMEOUT where the step limit is reached."""
    if outcome == RUNNING and params.step_limit > 0.0 and float(steps + 1) >= params.step_limit:
        return TIMEOUT
    return outcome


@wp.func
def way_of(pose: wp.vec4, goal: wp.vec4, distance_m: float, rules: Rules, params: CarParams) -> float:
    """What is left of a route of this length, turning included [m]."""
    if rules.needs_pose:
        return way_to_go(distance_m, heading_error(pose, goal), True, params)
    return distance_m


@wp.func
def progress_reward(way_before_m: float, way_after_m: float, outcome: int, params: CarParams) -> float:
    """Shaping and the cost of time."""
    is_terminal = outcome != RUNNING and outcome != TIMEOUT
    return shaping(way_before_m, way_after_m, is_terminal, params) + params.time_reward
