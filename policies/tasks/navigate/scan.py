"""What the scanning range finders of a batch of navigating drones tell (sim/sensors/scanner.py).

They are levelled by what each vehicle's flight controller estimates, as in flight.
"""

from typing import Any

import warp as wp

from common.rng import draw_tick
from policies.tasks.flight.flown_vehicle import vehicle_estimate
from policies.tasks.navigate.navigate_params import NavigateParams
from sim.sensors.scanner import ned_from_levelled, scan_ranges

wp.set_module_options({"enable_backward": False})


@wp.kernel(enable_backward=False)
def scan(
    rig: Any,
    params: wp.array(dtype=NavigateParams),
    rows: wp.array(dtype=wp.bool),
    has_estimator: int,
    ranges_m: wp.array2d(dtype=float),
) -> None:
    """The ranges of the chosen rows [m], shape (vehicles, RANGES)."""
    i = wp.tid()
    if not rows[i]:
        return
    truth = rig.truth[i]
    level = ned_from_levelled(truth.q_ned_from_frd, vehicle_estimate(rig, i, has_estimator).q_ned_from_frd)
    world = rig.worlds[rig.i_world[i]]
    tick = draw_tick(rig.tick[i])
    scan_ranges(world, truth.pos_ned, level, params[i].range_noise, rig.seed[i], tick, ranges_m, i)
