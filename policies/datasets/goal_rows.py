"""Navigate's and Drive's own functions over logged rows."""

import warp as wp

from policies.tasks.drive.drive_params import DriveParams
from policies.tasks.drive.observe import SPEED_MAX_M_S, YAW_RATE_MAX_RAD_S, drive_command
from policies.tasks.drive.reward import drive_outcome, drive_reward
from policies.tasks.flight.own_state import Command, action_command
from policies.tasks.follow_me.tracked.vector import command_fractions
from policies.tasks.navigate.navigate_params import NavigateParams
from policies.tasks.navigate.reward import navigate_outcome, navigate_reward
from sim.truth import Truth

wp.set_module_options({"enable_backward": False})

_SAME = wp.constant(1.0e-3)  # [m/s], [rad/s] of what is flown: float32 in a log
_STRUCK_M_S = wp.constant(1.0)  # any: it is not paid by
_ENDLESS_M = wp.constant(1.0e9)  # of the way at the start: a flight's time is never up


@wp.kernel(enable_backward=False)
def navigate_rows(
    params: wp.array(dtype=NavigateParams),
    truths: wp.array(dtype=Truth),
    goals_ned: wp.array(dtype=wp.vec3),
    rooms_m: wp.array(dtype=float),
    has_touched: wp.array(dtype=int),
    actions: wp.array(dtype=wp.vec4),
    step_s: float,
    rewards: wp.array(dtype=float),
    outcomes: wp.array(dtype=int),
) -> None:
    """What every step pays, and how the episode stands after it.

    Args:
        params: one row.
        truths: before the first step, and after each, (steps + 1,).
        goals_ned: [m] at each of them; a step is judged by the goal that it was decided on.
        rooms_m: to the nearest obstacle.
        has_touched: 1 or 0.
        actions: of the steps.
        step_s: [s] between two decisions.
        rewards: are written, (steps,).
        outcomes: are written, (steps,).
    """
    i = wp.tid()
    last = wp.vec4()
    if i > 0:
        last = actions[i - 1]
    distance_m = wp.length(goals_ned[i] - truths[i + 1].pos_ned)
    progress_m = wp.length(goals_ned[i] - truths[i].pos_ned) - distance_m
    touched = has_touched[i + 1] == 1
    outcome = navigate_outcome(params[0], distance_m, touched, truths[i + 1].height_agl_m, 0.0, _ENDLESS_M)
    outcomes[i] = outcome
    rewards[i] = navigate_reward(
        params[0], truths[i + 1], progress_m, step_s, rooms_m[i + 1], outcome, actions[i], last
    )


@wp.kernel(enable_backward=False)
def drive_rows(
    params: wp.array(dtype=DriveParams),
    truths: wp.array(dtype=Truth),
    distances_m: wp.array(dtype=float),
    turns_rad: wp.array(dtype=float),
    rooms_m: wp.array(dtype=float),
    has_touched: wp.array(dtype=int),
    actions: wp.array(dtype=wp.vec2),
    rewards: wp.array(dtype=float),
    outcomes: wp.array(dtype=int),
) -> None:
    """As `navigate_rows`; the way that is left is the distance, for a log has no field of ways."""
    i = wp.tid()
    last = wp.vec2()
    if i > 0:
        last = actions[i - 1]
    left_m = distances_m[i + 1]
    truth = truths[i + 1]
    if has_touched[i + 1] == 1:
        truth.impact_speed = _STRUCK_M_S
    outcome = drive_outcome(params[0], truth, left_m, turns_rad[i + 1], left_m, _ENDLESS_M, 0.0)
    outcomes[i] = outcome
    rewards[i] = drive_reward(
        params[0],
        distances_m[i] - left_m,
        wp.length(truth.vel_ned),
        rooms_m[i + 1],
        outcome,
        actions[i],
        last,
    )


@wp.kernel(enable_backward=False)
def navigate_action_rows(
    asked: wp.array(dtype=wp.vec4),
    q_ned_from_frd: wp.array(dtype=wp.quat),
    flown: wp.array(dtype=Command),
    out: wp.array(dtype=wp.vec4),
) -> None:
    """The action of every row: what was asked for if that was flown, else what asks for that.

    Where no yaw rate was flown, NaN, a rover was: what an action says of climb and turn is not looked at.
    """
    i = wp.tid()
    led_to = action_command(asked[i], q_ned_from_frd[i])
    is_level = wp.isnan(flown[i].yaw_rate)
    difference = led_to.vel_ned - flown[i].vel_ned
    off = wp.sqrt(difference[0] * difference[0] + difference[1] * difference[1])
    if not is_level:
        off += wp.abs(difference[2]) + wp.abs(led_to.yaw_rate - flown[i].yaw_rate)
    fractions = asked[i]
    if not off < _SAME:  # NaN is not
        fractions = command_fractions(flown[i], q_ned_from_frd[i])
        if is_level:
            for k in range(2, 4):
                fractions[k] = wp.where(wp.isnan(asked[i][k]), 0.0, asked[i][k])
    for k in range(4):
        fractions[k] = wp.clamp(fractions[k], -1.0, 1.0)
    out[i] = fractions


@wp.kernel(enable_backward=False)
def drive_action_rows(
    asked: wp.array(dtype=wp.vec2), flown: wp.array2d(dtype=float), out: wp.array(dtype=wp.vec2)
) -> None:
    """As `navigate_action_rows`; flown is a speed along the nose [m/s], and in column 3 a yaw rate [rad/s]."""
    i = wp.tid()
    led_to = drive_command(asked[i])
    fractions = asked[i]
    if not wp.abs(led_to.speed - flown[i, 0]) + wp.abs(led_to.yaw_rate - flown[i, 3]) < _SAME:
        fractions = wp.vec2(flown[i, 0] / SPEED_MAX_M_S, flown[i, 3] / YAW_RATE_MAX_RAD_S)
    for k in range(2):
        fractions[k] = wp.clamp(fractions[k], -1.0, 1.0)
    out[i] = fractions
