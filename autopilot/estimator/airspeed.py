"""Airspeed from a pitot tube: what the control law and telemetry are told. No filter fuses it.

In: dynamic pressure. Out: indicated airspeed, that is at the density of sea level, as PX4's FW_AIRSPD_* mean it.
"""

import warp as wp

from autopilot.ports import AIRSPEED_VALID, AirspeedSample, Estimate

wp.set_module_options({"enable_backward": False})

SEA_LEVEL_DENSITY_KG_M3 = wp.constant(1.225)  # ISO 2533
_SILENT_US = wp.constant(1_000_000)  # guess


@wp.func
def airspeed_of(pressure_pa: float) -> float:
    """[m/s] indicated; negative pressure, as of noise at rest, is a negative speed."""
    return wp.sign(pressure_pa) * wp.sqrt(2.0 * wp.abs(pressure_pa) / SEA_LEVEL_DENSITY_KG_M3)


@wp.func
def with_airspeed(estimate: Estimate, sample: AirspeedSample) -> Estimate:
    """The estimate with the speed of the latest sample; not valid once the tube is silent, or tells no number."""
    out = estimate
    out.flags = estimate.flags & ~AIRSPEED_VALID
    if estimate.time_us - sample.time_us <= wp.int64(_SILENT_US) and wp.isfinite(sample.pressure_pa):
        out.flags = out.flags | AIRSPEED_VALID
        out.airspeed = airspeed_of(sample.pressure_pa)
    return out
