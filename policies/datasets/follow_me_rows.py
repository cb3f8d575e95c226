"""FollowMe's own functions over logged rows: sights, rewards, ends, and the actions that lead to what was flown."""

import warp as wp

from policies.tasks.flight.own_state import Command, action_command
from policies.tasks.follow_me.follow_me_params import FollowParams
from policies.tasks.follow_me.owner_visibility import Sight, see
from policies.tasks.follow_me.reward import follow_outcome, follow_reward
from policies.tasks.follow_me.tracked.vector import (
    APPROACH,
    CALM_APPROACH,
    CALM_M_S,
    command_fractions,
    next_command,
)
from sim.truth import Truth
from sim.world.people import Person
from sim.world.world import World

wp.set_module_options({"enable_backward": False})

_SAME = wp.constant(1.0e-3)  # [m/s], [rad/s] of what is flown: float32 in a log


@wp.kernel(enable_backward=False)
def sight_rows(
    worlds: wp.array(dtype=World),
    truths: wp.array(dtype=Truth),
    params: wp.array(dtype=FollowParams),
    people: wp.array(dtype=Person),
    out: wp.array(dtype=Sight),
) -> None:
    """How a vehicle and its owner truly stood to each other, of every row."""
    i = wp.tid()
    out[i] = see(worlds[0], truths[i], params[0], people[i], people[i])


@wp.kernel(enable_backward=False)
def follow_rows(
    params: wp.array(dtype=FollowParams),
    sights: wp.array(dtype=Sight),
    has_touched: wp.array(dtype=int),
    unseen_s: wp.array(dtype=float),
    actions: wp.array(dtype=wp.vec4),
    rewards: wp.array(dtype=float),
    outcomes: wp.array(dtype=int),
) -> None:
    """What every step pays, and how the episode stands after it; a flight's time is never up.

    Args:
        params: one row.
        sights: after each step, (steps,).
        has_touched: as the others, 1 or 0.
        unseen_s: since the owner was in view.
        actions: of each step.
        rewards: are written.
        outcomes: are written.
    """
    i = wp.tid()
    n = params[0]
    last = wp.vec4()
    if i > 0:
        last = actions[i - 1]
    outcome = follow_outcome(n, sights[i], has_touched[i] == 1, unseen_s[i], 0)
    outcomes[i] = outcome
    rewards[i] = follow_reward(n, sights[i], outcome, actions[i], last)


@wp.func
def said_command(last: Command, flown: Command) -> Command:
    """What an action has to say that `next_command` flies this after that: its inverse, but for the limits."""
    step = flown.vel_ned - last.vel_ned
    size = wp.length(step)
    said = size / APPROACH
    if size < APPROACH * CALM_M_S:
        square = (APPROACH - CALM_APPROACH) / CALM_M_S
        said = (wp.sqrt(CALM_APPROACH * CALM_APPROACH + 4.0 * square * size) - CALM_APPROACH) / (2.0 * square)
    out = Command()
    out.vel_ned = last.vel_ned + step * (said / wp.max(size, 1.0e-9))
    out.yaw_rate = last.yaw_rate + (flown.yaw_rate - last.yaw_rate) / APPROACH
    return out


@wp.kernel(enable_backward=False)
def command_rows(
    fractions: wp.array(dtype=wp.vec4), q_ned_from_frd: wp.array(dtype=wp.quat), out: wp.array(dtype=Command)
) -> None:
    """The command that a frame tells as fractions, of every row."""
    i = wp.tid()
    out[i] = action_command(fractions[i], q_ned_from_frd[i])


@wp.kernel(enable_backward=False)
def action_rows(
    asked: wp.array(dtype=wp.vec4),
    q_ned_from_frd: wp.array(dtype=wp.quat),
    last: wp.array(dtype=Command),
    flown: wp.array(dtype=Command),
    out: wp.array(dtype=wp.vec4),
) -> None:
    """The action of every row: what was asked for if that was flown, else what leads to what was flown."""
    i = wp.tid()
    led_to = next_command(last[i], asked[i], q_ned_from_frd[i])
    off = wp.length(led_to.vel_ned - flown[i].vel_ned) + wp.abs(led_to.yaw_rate - flown[i].yaw_rate)
    if off < _SAME:  # no NaN is
        out[i] = asked[i]
        return
    fractions = command_fractions(said_command(last[i], flown[i]), q_ned_from_frd[i])
    for k in range(4):
        fractions[k] = wp.clamp(fractions[k], -1.0, 1.0)
    out[i] = fractions
