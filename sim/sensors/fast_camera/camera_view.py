"""One camera as the fast camera's kernels use it, and the cube-face angles in which the ground is searched.

A ray is d = ahead + x right + y down, not normalised: its parameter t is the depth along the optical axis [m]. Level
directions are counted from the camera's heading by a pseudo-angle: the coordinate on the face of a square round it,
-4..4, which one division gives. Distances are the parameter along that face's axis.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})

_TINY = wp.constant(1.0e-6)


@wp.struct
class View:
    """One camera."""

    pos_ned: wp.vec3  # [m]
    right: wp.vec3  # the axes of the image in ned, unit
    down: wp.vec3
    ahead: wp.vec3
    sun_rdf: wp.vec3  # unit, in the camera's frame
    north_rdf: wp.vec3
    east_rdf: wp.vec3
    up_rdf: wp.vec3
    heading: wp.vec2  # cosine and sine of the optical axis' course
    per_pixel: float  # of x and y
    gain: wp.vec3  # on red, green and blue light
    above_ground: float  # [m], at least a few centimetres
    eye: wp.vec3  # cells from the south edge and from the west edge, metres above home
    steep_squared: float  # no ground in this world is steeper [m²/m²]
    angle_low: float  # pseudo-angle of the first column
    left_edge: wp.vec2  # level normals of the image's outermost directions, pointing inwards; 0 for all round
    right_edge: wp.vec2
    columns: int  # 0: no ray of the image needs one
    columns_per_angle: float
    first_m: float  # distance of a column's first sample
    solids: int  # listed for this camera
    cell_base: int  # first index of its world's cells
    texel_base: int
    wall_top: float  # [m] above the home plane
    has_wall: bool  # a wall is within range
    inside: int  # what the camera is in: CROWN, TRUNK, PERSON, or SKY for the open


@wp.func
def face_length(a: float, b: float) -> float:
    """Distance along a face's axis per unit of t, for the level direction (a ahead, b right)."""
    return wp.max(wp.max(wp.abs(a), wp.abs(b)), _TINY)


@wp.func
def pseudo_angle(a: float, b: float, inverse: float) -> float:
    """-4..4 of a level direction: 0 ahead, 2 to the right, -2 to the left.

    Args:
        a: ahead.
        b: to the right.
        inverse: one over their `face_length`.
    """
    side = wp.where(b < 0.0, -1.0, 1.0)
    angle = side * 2.0 - side * a * inverse
    if wp.abs(b) <= wp.abs(a):
        angle = b * inverse
        if a < 0.0:
            angle = side * 4.0 - b * inverse
    return angle


@wp.func
def level_direction(angle: float) -> wp.vec2:
    """Ahead and right of a pseudo-angle, the larger of them 1 in size."""
    size = wp.abs(angle)
    side = wp.where(angle < 0.0, -1.0, 1.0)
    if size <= 1.0:
        return wp.vec2(1.0, angle)
    if size <= 3.0:
        return wp.vec2(2.0 - size, side)
    return wp.vec2(-1.0, side * (4.0 - size))
