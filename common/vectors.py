"""Arithmetic on vectors in kernels that Warp does not bring."""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.func
def clamp3(value: wp.vec3, limit: wp.vec3) -> wp.vec3:
    """Each element within ± its limit."""
    return wp.vec3(
        wp.clamp(value[0], -limit[0], limit[0]),
        wp.clamp(value[1], -limit[1], limit[1]),
        wp.clamp(value[2], -limit[2], limit[2]),
    )
