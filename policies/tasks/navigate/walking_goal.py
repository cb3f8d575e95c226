"""A goal that walks, as somebody who is followed: through the forest, now and then standing, and how fast to follow."""

import warp as wp

from policies.tasks.flight.episode_draws import draw_angle

wp.set_module_options({"enable_backward": False})

CLOSING_HZ = wp.constant(0.5)  # speed at which a follower closes up, per metre that it is behind
_COURSE_STREAM, _GAIT_STREAM = wp.constant(8), wp.constant(9)
_GAIT_S, _TURN_S = wp.constant(9.0), wp.constant(17.0)  # from one stand to the next, from one turn to the next; guesses
_TURN_RAD = wp.constant(2.0)


@wp.func
def walk_vel(walk_m_s: float, seed: int, i: int, episode: int, time_s: float) -> wp.vec3:
    """Velocity of a goal so long after the start of an episode [m/s]: to and fro, on average straight on."""
    gait = 2.0 * wp.pi * time_s / _GAIT_S + draw_angle(seed, i, episode, _GAIT_STREAM)
    course = draw_angle(seed, i, episode, _COURSE_STREAM) + _TURN_RAD * wp.sin(2.0 * wp.pi * time_s / _TURN_S)
    speed = walk_m_s * wp.clamp(0.6 + wp.sin(gait), 0.0, 1.0)
    return wp.vec3(speed * wp.cos(course), speed * wp.sin(course), 0.0)


@wp.func
def follow_speed(to_goal: wp.vec3, goal_vel: wp.vec3, kept_m: float) -> float:
    """Level speed at which a follower stays so far behind a goal [m/s]."""
    away_m = wp.sqrt(to_goal[0] * to_goal[0] + to_goal[1] * to_goal[1])
    if away_m < kept_m:
        return 0.0
    leaving = (to_goal[0] * goal_vel[0] + to_goal[1] * goal_vel[1]) / away_m
    return wp.max(leaving, 0.0) + CLOSING_HZ * (away_m - kept_m)
