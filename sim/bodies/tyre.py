"""The tyre law: force over load, by slip over the slip of the peak; one direction of a tyre, or both together."""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.struct
class Tyre:
    """A slip curve."""

    peak: float  # force over load at the extremum
    tail: float  # force over load from the asymptote on
    knee: float  # asymptote slip over extremum slip
    per_slip: float  # 1 over extremum slip


@wp.func
def tyre_of(extremum_slip: float, extremum: float, asymptote_slip: float, asymptote: float) -> Tyre:
    """A tyre of stiffness 1, as Unity's WheelFrictionCurve names its numbers."""
    tyre = Tyre()
    tyre.peak = extremum
    tyre.tail = asymptote
    tyre.per_slip = 1.0 / extremum_slip
    tyre.knee = wp.max(asymptote_slip * tyre.per_slip, 1.001)
    return tyre


@wp.func
def force_per_slip(tyre: Tyre, slip: float) -> float:
    """Force over load, divided by `slip` (at least 0; 1 is the peak).

    Unity's curve is a two-piece spline, flat at the extremum and at the asymptote; from the origin to the extremum we
    take the parabola, the only quadratic that is.
    """
    if slip < 1.0:
        return tyre.peak * (2.0 - slip)
    fraction = wp.min((slip - 1.0) / (tyre.knee - 1.0), 1.0)
    return (tyre.peak + (tyre.tail - tyre.peak) * fraction * fraction * (3.0 - 2.0 * fraction)) / slip
