"""How much of its full voltage the battery has left, as control laws scale their commands by it."""

import warp as wp

from autopilot.ports import BatterySample
from common.kernels import TICK_S

wp.set_module_options({"enable_backward": False})

_TICK_S = wp.constant(TICK_S)
_VOLTAGE_TIME_S = wp.constant(0.25)  # slower than the loops that load the battery, faster than it empties
_VOLTAGE_FRACTION_MIN = wp.constant(0.6)


@wp.func
def voltage_step(fraction: float, full_voltage_v: float, battery: BatterySample) -> float:
    """Filtered battery voltage over the full one, a tick later; 1 without a battery sample.

    Args:
        fraction: before; 0: not started.
        full_voltage_v: of the whole pack.
        battery: the latest sample.
    """
    if battery.voltage_v <= 0.0 or full_voltage_v <= 0.0:
        return 1.0
    measured = wp.clamp(battery.voltage_v / full_voltage_v, _VOLTAGE_FRACTION_MIN, 1.05)
    if fraction == 0.0:
        return measured
    return fraction + (measured - fraction) * _TICK_S / _VOLTAGE_TIME_S
