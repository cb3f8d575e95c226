"""Small pieces every loop of the cascade uses: low-pass, bounded integral, vector limits."""

import warp as wp

from common.vectors import clamp3

wp.set_module_options({"enable_backward": False})

_TWO_PI = wp.constant(6.2831853)


@wp.func
def low_pass_fraction(cutoff_hz: float, dt_s: float) -> float:
    """Fraction of a new sample in a first-order low-pass (implicit Euler: stable for any cutoff)."""
    step = _TWO_PI * cutoff_hz * dt_s
    return step / (1.0 + step)


@wp.func
def integrate_unless_short(
    integral: wp.vec3, error: wp.vec3, gain: wp.vec3, shortfall: wp.vec3, limit: wp.vec3, dt_s: float
) -> wp.vec3:
    """The integral after `dt_s`; an element whose output already falls short on the error's side does not grow."""
    grown = integral
    for k in range(3):
        if error[k] * shortfall[k] <= 0.0:
            grown[k] = integral[k] + gain[k] * error[k] * dt_s
    return clamp3(grown, limit)


@wp.func
def clamp_horizontal(vector_ned: wp.vec3, limit: float) -> wp.vec3:
    """The vector with its horizontal part shortened to `limit`."""
    length = wp.sqrt(vector_ned[0] * vector_ned[0] + vector_ned[1] * vector_ned[1])
    if length <= limit:
        return vector_ned
    scale = limit / length
    return wp.vec3(vector_ned[0] * scale, vector_ned[1] * scale, vector_ned[2])


@wp.func
def finite_or(value: float, fallback: float) -> float:
    """The value, or the fallback where it is NaN or infinite."""
    if wp.isfinite(value):
        return value
    return fallback
