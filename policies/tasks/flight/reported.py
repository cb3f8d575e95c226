"""What a vehicle tells of itself and of what it sees, when that is wrong or late: attitudes with an error, old scans.

Of tasks that are shown ranges. What comes late is shown as it would be from where the vehicle is now, by what it
estimates that it has moved, as in flight too; what else has moved since is shown where it was.
"""

import math
from typing import Any

import warp as wp

from autopilot.ports import Estimate
from common.rng import normal3
from common.rotation import yaw_from_quat
from policies.tasks.flight.flown_vehicle import vehicle_estimate
from policies.tasks.flight.moved_ranges import Sectors, move_ranges
from policies.tasks.task_params import TaskParam

wp.set_module_options({"enable_backward": False})

KEPT_SCANS = 4  # the newest, and as many before it as the longest lag is decisions
_KEPT_SCANS = wp.constant(KEPT_SCANS)
_DECISION_S = wp.constant(0.1)
_RAD_PER_DEG = wp.constant(math.pi / 180.0)

REPORT_PARAMS = (
    TaskParam("scan_lag_s", 0.0, 0.0, 0.3, "s", "age of the ranges that are shown, in steps of 0.1 s", "guess"),
    TaskParam(
        "attitude_error_deg",
        0.0,
        0.0,
        10.0,
        "deg",
        "of the attitude that is told, about an axis drawn per episode",
        "guess",
    ),
)


@wp.func
def attitude_error(error_deg: float, seed: int, i: int, episode: int, stream: int) -> wp.quat:
    """The turn by which the attitude that is told is off in an episode, about an axis of the world that is drawn."""
    axis_ned = wp.normalize(normal3(seed, i, episode, stream))
    return wp.quat_from_axis_angle(axis_ned, error_deg * _RAD_PER_DEG)


@wp.func
def reported_estimate(rig: Any, i: int, has_estimator: int, attitude_errors: wp.array(dtype=wp.quat)) -> Estimate:
    """The state as the vehicle tells it, its attitude off by the error of the episode."""
    estimate = vehicle_estimate(rig, i, has_estimator)
    estimate.q_ned_from_frd = attitude_errors[i] * estimate.q_ned_from_frd
    return estimate


@wp.func
def level_pose(estimate: Estimate) -> wp.vec3:
    """North, east [m] and heading [rad]."""
    return wp.vec3(estimate.pos_ned[0], estimate.pos_ned[1], yaw_from_quat(estimate.q_ned_from_frd))


@wp.func
def show_late(
    lag_s: float,
    is_first: int,
    pose: wp.vec3,
    sectors: Sectors,
    scans_m: wp.array3d(dtype=float),
    poses: wp.array2d(dtype=wp.vec3),
    ranges_m: wp.array2d(dtype=float),
    i: int,
) -> None:
    """Keeps the scan of now and shows that of `lag_s` ago in its place, its sectors as they would be from here.

    Args:
        lag_s: how old the ranges are that are shown [s].
        is_first: an episode begins: who takes over has seen something.
        pose: where the vehicle takes itself to be, see `level_pose`.
        sectors: which way the ranges look.
        scans_m: the last ones [m], newest first, shape (rows, KEPT_SCANS, ranges).
        poses: where they were measured, shape (rows, KEPT_SCANS).
        ranges_m: those of now, then those that are shown [m], shape (rows, ranges).
        i: the row.
    """
    late = wp.min(int(wp.round(lag_s / _DECISION_S)), _KEPT_SCANS - 1)
    for back in range(_KEPT_SCANS - 1, 0, -1):
        poses[i, back] = wp.where(is_first == 1, pose, poses[i, back - 1])
    poses[i, 0] = pose
    for k in range(ranges_m.shape[1]):
        newest = ranges_m[i, k]
        for back in range(_KEPT_SCANS - 1, 0, -1):
            scans_m[i, back, k] = wp.where(is_first == 1, newest, scans_m[i, back - 1, k])
        scans_m[i, 0, k] = newest
        ranges_m[i, k] = scans_m[i, late, k]
    if late > 0:
        move_ranges(scans_m[i], late, poses[i, late], pose, sectors, ranges_m, i)
