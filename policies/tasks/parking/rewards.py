"""The rewards of the parking tasks as pure functions: the documents' rows 4 to 9 and 5 to 7, and ours by potential.

Rows are numbered as in the document's table 2. They are paid per applied action, before the car moves.
"""

import warp as wp

from policies.tasks.parking.parking_params import CarParams

wp.set_module_options({"enable_backward": False})


@wp.struct
class Approach:
    """What the distance rows remember."""

    best_m: float  # of this episode
    last_m: float
    reward: float  # of this application


@wp.func
def approach_rows(distance_m: float, best_m: float, last_m: float, params: CarParams, is_coded: bool) -> Approach:
    """Row 4, and exactly one of rows 5 (best), 6 (nearer) and 7 (farther).

    As coded, row 4 stores the distance as the last one first: within its radius row 6 cannot be, and what is nearer but
    not best is paid as farther.
    """
    out = Approach()
    out.best_m = best_m
    reward = float(0.0)
    last = last_m
    if distance_m < params.near_m:
        reward += params.near_reward
        if is_coded:
            last = distance_m
    if distance_m < best_m:
        reward += params.best_reward
        out.best_m = distance_m
    elif distance_m < last:
        reward += params.nearer_reward
    else:
        reward += params.farther_reward
    out.last_m = distance_m
    out.reward = reward
    return out


@wp.func
def near_row(distance_m: float, near_m: float, reward: float) -> float:
    """Rows 8 and 9, of one wall or obstacle."""
    return wp.where(distance_m < near_m, reward, 0.0)


@wp.func
def way_to_go(distance_m: float, heading_error_rad: float, needs_pose: bool, params: CarParams) -> float:
    """The route's length, and what is still to be turned as far as the goal is near [m]."""
    if needs_pose:
        nearness = wp.max(0.0, 1.0 - distance_m / 5.0)  # guess: aligning is of use in the last metres
        return distance_m + params.align_m_per_rad * wp.abs(heading_error_rad) * nearness
    return distance_m


@wp.func
def shaping(way_before_m: float, way_after_m: float, is_terminal: bool, params: CarParams) -> float:
    """Pays discount x Phi(after) - Phi(before) with Phi = -way (Ng, Harada and Russell 1999); Phi is 0 after an end."""
    after = wp.where(is_terminal, 0.0, way_after_m)
    return params.progress_per_m * (way_before_m - params.discount * after)
