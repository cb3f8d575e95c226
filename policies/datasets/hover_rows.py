"""Hover's own functions over logged rows."""

import warp as wp

from autopilot.ports import Estimate
from policies.tasks.hover.hover_kernels import HoverParams, hover_outcome, hover_reward, write_hover

wp.set_module_options({"enable_backward": False})


@wp.kernel(enable_backward=False)
def frame_rows(
    estimates: wp.array(dtype=Estimate),
    points_ned: wp.array(dtype=wp.vec3),
    actions: wp.array(dtype=wp.vec4),
    out: wp.array2d(dtype=float),
) -> None:
    """The frame of every row; the last action is that of the row before, none at first."""
    i = wp.tid()
    last = wp.vec4()
    if i > 0:
        last = actions[i - 1]
    write_hover(estimates[i], points_ned[i], last, out, i, 0)


@wp.kernel(enable_backward=False)
def hover_rows(
    params: wp.array(dtype=HoverParams),
    estimates: wp.array(dtype=Estimate),
    points_ned: wp.array(dtype=wp.vec3),
    has_touched: wp.array(dtype=int),
    rewards: wp.array(dtype=float),
    outcomes: wp.array(dtype=int),
) -> None:
    """What every step pays, and how the episode stands after it: step i leads to row i + 1."""
    i = wp.tid()
    after = estimates[i + 1]
    distance_m = wp.length(after.pos_ned - points_ned[i + 1])
    rewards[i] = hover_reward(params[0], distance_m, after.omega_frd)
    outcomes[i] = hover_outcome(params[0], distance_m, has_touched[i + 1] == 1, i + 1)
