"""What the scanning range finders of a batch of navigating drones tell (sim/sensors/scanner.py), some decisions late.

They are levelled by what each vehicle's flight controller estimates, as in flight.
"""

from typing import Any

import warp as wp

from common.rng import draw_tick
from policies.tasks.flight.reported import reported_estimate, show_late
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
    scans_m: wp.array3d(dtype=float),
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
        scans_m: the last ones, newest first, (vehicles, KEPT_SCANS, RANGES).
        ranges_m: what is shown.
    """
    i = wp.tid()
    if not rows[i]:
        return
    truth = rig.truth[i]
    level = ned_from_levelled(
        truth.q_ned_from_frd, reported_estimate(rig, i, has_estimator, attitude_errors).q_ned_from_frd
    )
    world = rig.worlds[rig.i_world[i]]
    tick = draw_tick(rig.tick[i])
    scan_ranges(world, truth.pos_ned, level, params[i].range_noise, rig.seed[i], tick, ranges_m, i)
    show_late(params[i].scan_lag_s, is_first, scans_m, ranges_m, i)
