"""What the scanning range finders of a batch of navigating drones tell (sim/sensors/scanner.py), some decisions late.

They are levelled by what each vehicle's flight controller estimates, as in flight. What comes late is shown as it was
measured, as in flight too: round where the vehicle was then, and from the nose of then.
"""

from typing import Any

import warp as wp

from common.range_sectors import RANGES
from common.rng import draw_tick
from policies.tasks.navigate.navigate_params import NavigateParams
from policies.tasks.navigate.vehicles import reported_estimate
from sim.sensors.scanner import ned_from_levelled, scan_ranges

wp.set_module_options({"enable_backward": False})

KEPT_SCANS = 4  # the newest, and as many before it as the longest lag is decisions
_RANGES = wp.constant(RANGES)
_KEPT_SCANS = wp.constant(KEPT_SCANS)
_DECISION_S = wp.constant(0.1)


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
    late = wp.min(int(wp.round(params[i].scan_lag_s / _DECISION_S)), _KEPT_SCANS - 1)
    for k in range(_RANGES):
        newest = ranges_m[i, k]
        for back in range(_KEPT_SCANS - 1, 0, -1):
            scans_m[i, back, k] = wp.where(is_first == 1, newest, scans_m[i, back - 1, k])
        scans_m[i, 0, k] = newest
        ranges_m[i, k] = scans_m[i, late, k]
