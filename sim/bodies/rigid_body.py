"""What the rigid bodies of all classes share: attitude after a turn, air, first-order lags."""

import warp as wp

wp.set_module_options({"enable_backward": False})

_SEA_LEVEL_DENSITY_KG_M3 = wp.constant(1.225)  # ISO 2533 standard atmosphere


@wp.func
def turned_by(q_ned_from_frd: wp.quat, rotvec_frd: wp.vec3) -> wp.quat:
    """Attitude after a body rotation vector of less than 0.1 rad: series of the exponential, exact to float32."""
    square = wp.dot(rotvec_frd, rotvec_frd)
    half_sinc = 0.5 - square / 48.0
    turn = wp.quat(
        half_sinc * rotvec_frd[0], half_sinc * rotvec_frd[1], half_sinc * rotvec_frd[2], 1.0 - 0.125 * square
    )
    return wp.normalize(q_ned_from_frd * turn)


@wp.func
def hull_drag(drag_area_frd: wp.vec3, air_vel_frd: wp.vec3, density_ratio: float) -> wp.vec3:
    """Force [N] on a hull: -½ rho (c_d A) |v| v along each axis; the density is over that at sea level."""
    pressure = -0.5 * _SEA_LEVEL_DENSITY_KG_M3 * density_ratio * wp.length(air_vel_frd)
    return pressure * wp.cw_mul(drag_area_frd, air_vel_frd)


@wp.func
def lag_gain(time_constant_s: float, dt: float) -> float:
    """Fraction of the way to its target a first-order lag goes in dt: the bilinear form of 1 - exp(-dt / tau)."""
    return 2.0 * dt / (2.0 * time_constant_s + dt)


def density_ratio_at(alt_amsl_m: float) -> float:
    """Air density over that at sea level (ISO 2533, troposphere)."""
    ratio: float = (1.0 - 2.25577e-5 * alt_amsl_m) ** 4.25588
    return ratio
