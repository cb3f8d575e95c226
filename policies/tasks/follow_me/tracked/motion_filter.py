"""A Kalman filter of level place and velocity, nearly constant: one model of how somebody moves.

In: places with variances. Out: place and velocity with variances, and how likely each place was.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.struct
class Motion:
    """Place and velocity, level, and their covariance."""

    pos: wp.vec2  # [m]
    vel: wp.vec2  # [m/s]
    pos_var: wp.mat22  # [m²]
    cross_var: wp.mat22  # [m²/s] of place and velocity
    vel_var: wp.mat22  # [m²/s²]


@wp.func
def even(m: wp.mat22) -> wp.mat22:
    """The symmetric part: rounding errors of the other would grow."""
    return 0.5 * (m + wp.transpose(m))


@wp.func
def moved(m: Motion, dt_s: float, accel_nsd2: float) -> Motion:
    """Carried on by so long; the velocity wanders with a spectral density [m²/s³]."""
    unit = wp.identity(n=2, dtype=float)
    noise = accel_nsd2 * dt_s
    m.pos = m.pos + dt_s * m.vel
    m.pos_var = m.pos_var + dt_s * (m.cross_var + wp.transpose(m.cross_var)) + dt_s * dt_s * m.vel_var
    m.pos_var = m.pos_var + noise * dt_s * dt_s / 3.0 * unit
    m.cross_var = m.cross_var + dt_s * m.vel_var + noise * dt_s / 2.0 * unit
    m.vel_var = m.vel_var + noise * unit
    return m


@wp.func
def bounded_innov(innov: wp.vec2, innov_var: wp.mat22, stds: float) -> wp.vec2:
    """An innovation, of which no more counts than so many standard deviations."""
    off = wp.sqrt(wp.max(wp.dot(innov, wp.inverse(innov_var) * innov), 0.0))
    return innov * wp.min(1.0, stds / wp.max(off, 1.0e-6))


@wp.func
def corrected(m: Motion, innov: wp.vec2, innov_var: wp.mat22) -> Motion:
    """With an innovation taken in."""
    innov_inv = wp.inverse(innov_var)
    pos_gain = m.pos_var * innov_inv
    vel_gain = wp.transpose(m.cross_var) * innov_inv
    m.pos = m.pos + pos_gain * innov
    m.vel = m.vel + vel_gain * innov
    m.vel_var = even(m.vel_var - vel_gain * m.cross_var)
    m.cross_var = m.cross_var - pos_gain * m.cross_var
    m.pos_var = even(m.pos_var - pos_gain * m.pos_var)
    return m


@wp.func
def likelihood(innov: wp.vec2, innov_var: wp.mat22) -> float:
    """Density of an innovation, but for a factor that all have."""
    return wp.exp(-0.5 * wp.dot(innov, wp.inverse(innov_var) * innov)) / wp.sqrt(
        wp.max(wp.determinant(innov_var), 1.0e-12)
    )


@wp.func
def mixed(a: Motion, b: Motion, fraction: float) -> Motion:
    """Both together, of which the second is a fraction [1]: mean, and covariance with what they differ."""
    out = Motion()
    keep = 1.0 - fraction
    out.pos = keep * a.pos + fraction * b.pos
    out.vel = keep * a.vel + fraction * b.vel
    pos, vel = b.pos - a.pos, b.vel - a.vel
    apart = keep * fraction
    out.pos_var = keep * a.pos_var + fraction * b.pos_var + apart * wp.outer(pos, pos)
    out.cross_var = keep * a.cross_var + fraction * b.cross_var + apart * wp.outer(pos, vel)
    out.vel_var = keep * a.vel_var + fraction * b.vel_var + apart * wp.outer(vel, vel)
    return out
