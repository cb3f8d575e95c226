"""A batch flown from power-on to a hover by its flight controllers, settled: where episodes and benchmarks start."""

from collections.abc import Sequence

from autopilot.navigator.setpoint import SetpointPort
from sim.rig import Rig

ALIGN_TICKS = 2000  # 8 s: power-on until the estimator is aligned and has used GNSS
CLIMB_TICKS = 2000  # 8 s: up, and settled

Hover = tuple[tuple[float, float, float], float]
"""Position in ned [m] and heading [rad]."""


def fly_to_hover(rig: Rig, hovers: Sequence[Hover]) -> None:
    """Flies each vehicle of a rig that has just booted to its hover and lets it settle.

    Args:
        rig: as many vehicles as hovers; everything that the estimators and integrators learn in 16 s they know then.
        hovers: of each vehicle.
    """
    rig.advance(ALIGN_TICKS)
    rows = rig.rows["autopilot.setpoint"]
    for i, (pos_ned, yaw_rad) in enumerate(hovers):
        port = SetpointPort(rows[i : i + 1])
        port.set_flags(is_armed=True, is_landed=False)
        port.fly_to(pos_ned, yaw_rad)
        port.write()
    rig.advance(CLIMB_TICKS)
