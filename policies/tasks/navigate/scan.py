"""What the scanning range finders of a batch of navigating drones tell (sim/sensors/scanner.py), some decisions late.

They are levelled, and those that are late moved to where the vehicle is, by what its flight controller estimates, as in
flight.
"""

from typing import Any

import warp as wp

from common.rng import draw_tick
from policies.tasks.flight.moved_ranges import Sectors
from policies.tasks.flight.reported import level_pose, reported_estimate, show_late
from policies.tasks.navigate.navigate_params import NavigateParams
from sim.sensors.scanner import ned_from_levelled, scan_ranges

wp.set_module_options({"enable_backward": False})


@wp.kernel(enable_backward=False)
def scan(
    rig: Any,
    params: wp.array(dtype=NavigateParams),
    rows: wp.array(dtype=wp.bool),
    has_estimator: int,
    attitude_errors: wp.array(dtype=wp.quat),
    is_first: int,
    sectors: Sectors,
    scans_m: wp.array3d(dtype=float),
    poses: wp.array2d(dtype=wp.vec3),
    ranges_m: wp.array2d(dtype=float),
) -> None:
    """The ranges of the chosen rows [m], shape (vehicles, RANGES), as late as their episodes have it.

    Args:
        rig: the vehicles.
        params: of the running episodes.
        rows: the chosen ones.
        has_estimator: the flight controller flies on its estimate.
        attitude_errors: of what it takes for its attitude, besides.
        is_first: an episode begins: who takes over has seen something.
        sectors: which way the ranges look.
        scans_m: the last ones, newest first, (vehicles, KEPT_SCANS, RANGES).
        poses: where they were measured, (vehicles, KEPT_SCANS).
        ranges_m: what is shown.
    """
    i = wp.tid()
    if not rows[i]:
        return
    truth = rig.truth[i]
    estimate = reported_estimate(rig, i, has_estimator, attitude_errors)
    level = ned_from_levelled(truth.q_ned_from_frd, estimate.q_ned_from_frd)
    world = rig.worlds[rig.i_world[i]]
    tick = draw_tick(rig.tick[i])
    scan_ranges(world, truth.pos_ned, level, params[i].range_noise, rig.seed[i], tick, ranges_m, i)
    show_late(params[i].scan_lag_s, is_first, level_pose(estimate), sectors, scans_m, poses, ranges_m, i)
