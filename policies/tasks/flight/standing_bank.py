"""The standing vehicles that episodes on wheels start from: powered on once per process, braked, each heading its way.

Every estimator has converged then. A row that starts an episode takes one of them over, in a world of its own.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import warp as wp

from autopilot.control.law import ControlLaw
from autopilot.navigator.setpoint import SetpointPort
from policies.tasks.flight.hover_bank import PLAIN, build_rig
from policies.tasks.task import SPLITS, Split
from sim.advance import rig_arrays
from sim.bodies.body import Body
from sim.hovering import ALIGN_TICKS
from sim.rig import Rig
from sim.sensors.sensors import SensorModel
from sim.world.world import build_world

STANDING_COUNT = 64
_SETTLE_TICKS = 1000  # 4 s more, with the brake on


@cache
def _stand_kernel(body: Body, law: ControlLaw) -> Any:
    """`@wp.kernel (Arrays, yaw_rad)`: puts vehicles at home, each with a heading of its own."""
    arrays: Any = rig_arrays(body, law)
    at_rest, truth_of, standing_height = body.at_rest, body.truth, body.standing_height

    @wp.kernel(enable_backward=False, module="unique")
    def stand(rig: arrays, yaw_rad: wp.array(dtype=float)) -> None:
        i = wp.tid()
        model = rig.model[i]
        state = at_rest(model, wp.vec3(0.0, 0.0, -standing_height(model)), yaw_rad[i])
        rig.body[i] = state
        rig.truth[i] = truth_of(state)

    return stand


@cache
def standing_bank(
    airframe_name: str,
    sensors: Callable[[float], SensorModel],
    has_estimator: bool,
    device: str,
    split: Split = "train",
) -> Rig:
    """Vehicles that stand at home on level ground, armed and braked, evenly in all directions, of each split others."""
    seed = SPLITS.index(split)
    rig = build_rig(
        build_world(PLAIN, device),
        STANDING_COUNT,
        has_estimator=has_estimator,
        threads=1,
        device=device,
        airframe_name=airframe_name,
        sensors=sensors,
        seed=seed,
    )
    between = 2.0 * np.pi / STANDING_COUNT * seed / len(SPLITS)
    headings = between + np.linspace(-np.pi, np.pi, STANDING_COUNT, endpoint=False)
    yaws = wp.array(headings, dtype=float, device=device)
    wp.launch(_stand_kernel(rig.body, rig.law), STANDING_COUNT, [rig.arrays, yaws], device=device)
    rig.power_on(wp.full(STANDING_COUNT, 1, dtype=int, device=device))
    rig.rows.fetch()
    rig.advance(ALIGN_TICKS)
    rows = rig.rows["autopilot.setpoint"]
    for i in range(STANDING_COUNT):
        port = SetpointPort(rows[i : i + 1])
        port.set_flags(is_armed=True, is_landed=False)
        port.drive(speed=0.0, yaw_rate=0.0)
        port.write()
    rig.advance(_SETTLE_TICKS)
    return rig
