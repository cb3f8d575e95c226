"""What a camera adds to a perfect image: noise of sensor and depth, smear of what moves, a lens that bends lines.

In: perfect images, and per camera an `Optics` that kernels write before each. Out: the images as they are handed
on. Exposure and white balance belong to the `Lens`. Draws are named by a camera's seed and tick and the pixel.
"""

import warp as wp

from common.rng import draw_key
from sim.rng_streams import CAMERA, DEPTH_HOLES
from sim.sensors.camera import SKY_DEPTH_M, Lens
from sim.sensors.fast_camera.flags import FAST
from sim.sensors.ray import RAY_MAX_M

wp.set_module_options(FAST)

_READ_STD = wp.constant(2.5)  # [levels] guess, a small sensor by day
_SHOT_STD = wp.constant(4.5)  # [levels] of a white pixel; guess
_DEPTH_STD_FRACTION = wp.constant(0.02)  # Intel D435: below 2 % up to 2 m
_UNIFORM_WIDTH = wp.constant(3.4641016)  # of a uniform draw of unit variance
_TAPS_MAX = wp.constant(6)  # places that a smeared pixel is the mean of
_SMEAR_MAX = wp.constant(16.0)  # [pixels]
_HOLE_PIXELS = wp.constant(6)  # width and height of a hole in the depth; guess
_HOLE_TICKS = wp.constant(50)  # and for how long it stays; guess
_STILL_SQUARED = wp.constant(0.01)  # [pixels²] a smear that nobody sees


@wp.struct
class Optics:
    """One camera's imperfections; all 0: none."""

    read_std: float  # [levels] noise of a black pixel
    shot_std: float  # [levels] more noise of a white one, growing with the root of the level
    depth_std_fraction: float  # error of a pixel's depth as a fraction of it
    has_depth_limit: int  # what is farther than the next returns no depth
    depth_max_m: float
    depth_holes: float  # fraction of the picture without depth, in patches that come and go
    shutter_s: float  # time in which what moves is smeared; 0 smears nothing
    vel_rdf: wp.vec3  # [m/s] of the camera, while the shutter is open
    rate_rdf: wp.vec3  # [rad/s]
    distortion: float  # see `undistorted`
    seed: int
    tick: int


@wp.func
def sensor_noise(optics: Optics, scale: float, seed: int, tick: int) -> Optics:
    """The camera with the noise of a small sensor by day, times a factor, as drawn for one tick."""
    optics.read_std = scale * _READ_STD
    optics.shot_std = scale * _SHOT_STD
    optics.depth_std_fraction = scale * _DEPTH_STD_FRACTION
    optics.seed = seed
    optics.tick = tick
    return optics


@wp.func
def is_perfect(optics: Optics) -> bool:
    """Whether the camera neither errs nor smears."""
    noise = optics.read_std + optics.shot_std + optics.depth_std_fraction
    bends = wp.abs(optics.distortion)
    return noise + optics.shutter_s + optics.depth_holes + bends == 0.0 and optics.has_depth_limit == 0


@wp.func
def has_depth(optics: Optics, depth_m: float, row: int, column: int) -> bool:
    """Whether a pixel's depth is measured: it is near enough, and in no hole."""
    if optics.has_depth_limit == 1 and depth_m > optics.depth_max_m:
        return False
    if optics.depth_holes <= 0.0:
        return True
    patch = 1024 * (row / _HOLE_PIXELS) + column / _HOLE_PIXELS
    state = draw_key(optics.seed, patch, optics.tick / _HOLE_TICKS, DEPTH_HOLES)
    return wp.randf(state) >= optics.depth_holes


@wp.func
def even(bits: wp.uint32, byte: int) -> float:
    """A draw of unit variance from one byte: uniform, which a network cannot tell from normal."""
    level = float(int(bits >> wp.uint32(8 * byte)) & 255)
    return _UNIFORM_WIDTH * ((level + 0.5) * (1.0 / 256.0) - 0.5)


@wp.func
def smear(optics: Optics, x: float, y: float, depth_m: float, per_pixel: float) -> wp.vec2:
    """Columns and rows that a point which stands still moves by while the shutter is open."""
    position = wp.vec3(x, y, 1.0)
    flow = -optics.vel_rdf / wp.max(depth_m, 0.05) - wp.cross(optics.rate_rdf, position)
    way = wp.vec2(flow[0] - x * flow[2], flow[1] - y * flow[2]) * (optics.shutter_s / per_pixel)
    length = wp.length(way)
    if length > _SMEAR_MAX:
        way = way * (_SMEAR_MAX / length)
    return way


@wp.func
def undistorted(distortion: float, place: wp.vec2) -> wp.vec2:
    """Where a lens that bends nothing shows what this one shows at a place: Brown's first radial term.

    Args:
        distortion: [1] above 0 a barrel, below a cushion; the middles of the edges stay where they are.
        place: from the image's middle, in halves of its width.
    """
    return place * ((1.0 + distortion * wp.dot(place, place)) / (1.0 + distortion))


@wp.func
def between(rgb: wp.array[wp.uint8], first: int, size: wp.vec2i, row: float, column: float) -> wp.vec3:
    """Levels between four pixels of the image that begins at an index; those of its edge beyond it."""
    v = wp.clamp(row, 0.0, float(size[1]) - 1.001)
    u = wp.clamp(column, 0.0, float(size[0]) - 1.001)
    i = int(v)
    j = int(u)
    v = v - float(i)
    u = u - float(j)
    upper = 3 * (first + i * size[0] + j)
    lower = upper + 3 * size[0]
    above = (1.0 - u) * levels_of(rgb, upper) + u * levels_of(rgb, upper + 3)
    below = (1.0 - u) * levels_of(rgb, lower) + u * levels_of(rgb, lower + 3)
    return (1.0 - v) * above + v * below


@wp.func
def levels_of(rgb: wp.array[wp.uint8], k: int) -> wp.vec3:
    """Red, green and blue from an index on."""
    return wp.vec3(float(rgb[k]), float(rgb[k + 1]), float(rgb[k + 2]))


@wp.func
def smeared(rgb: wp.array[wp.uint8], first: int, size: wp.vec2i, row: float, column: float, way: wp.vec2) -> wp.vec3:
    """Mean level along the way of a place."""
    levels = wp.vec3()
    taps = wp.min(int(wp.length(way)) + 2, _TAPS_MAX)
    for tap in range(taps):
        fraction = (float(tap) + 0.5) / float(taps) - 0.5
        levels = levels + between(rgb, first, size, row + fraction * way[1], column + fraction * way[0])
    return levels / float(taps)


@wp.kernel
def expose(
    first_camera: int,
    lenses: wp.array[Lens],
    is_chosen: wp.array[wp.bool],
    all_optics: wp.array[Optics],
    size: wp.vec2i,
    perfect_rgb: wp.array[wp.uint8],
    perfect_depth_m: wp.array[float],
    rgb: wp.array[wp.uint8],
    depth_m: wp.array[float],
) -> None:
    i_row, row = wp.tid()
    i_camera = first_camera + i_row
    if not is_chosen[i_camera]:
        return
    optics = all_optics[i_camera]
    state = draw_key(optics.seed, row, optics.tick, CAMERA)
    per_pixel = 2.0 * lenses[i_camera].half_width / float(size[0])
    first_pixel = i_camera * size[0] * size[1]
    if is_perfect(optics):
        for k in range(first_pixel + row * size[0], first_pixel + (row + 1) * size[0]):
            for c in range(3):
                rgb[3 * k + c] = perfect_rgb[3 * k + c]
            depth_m[k] = perfect_depth_m[k]
        return
    half = 0.5 * float(size[0])
    middle = wp.vec2(half - 0.5, 0.5 * float(size[1]) - 0.5)
    for column in range(size[0]):
        k = first_pixel + row * size[0] + column
        at = wp.vec2(float(column), float(row))  # of what is shown there
        shown = k
        if optics.distortion != 0.0:
            at = undistorted(optics.distortion, (at - middle) / half) * half + middle
            nearest_row = wp.clamp(int(wp.round(at[1])), 0, size[1] - 1)
            nearest_column = wp.clamp(int(wp.round(at[0])), 0, size[0] - 1)
            shown = first_pixel + nearest_row * size[0] + nearest_column
        depth = perfect_depth_m[shown]
        levels = levels_of(perfect_rgb, 3 * shown)
        if optics.distortion != 0.0:
            levels = between(perfect_rgb, first_pixel, size, at[1], at[0])
        if optics.shutter_s > 0.0:
            off = (at - middle) * per_pixel
            way = smear(optics, off[0], off[1], depth, per_pixel)
            if wp.dot(way, way) > _STILL_SQUARED:
                levels = smeared(perfect_rgb, first_pixel, size, at[1], at[0], way)
        bits = wp.randu(state)
        read = optics.read_std * optics.read_std
        shot = optics.shot_std * optics.shot_std * (1.0 / 255.0)
        for c in range(3):
            level = levels[c] + wp.sqrt(read + shot * levels[c]) * even(bits, c)
            rgb[3 * k + c] = wp.uint8(wp.clamp(level + 0.5, 0.0, 255.0))
        if depth < RAY_MAX_M:
            depth = depth * (1.0 + optics.depth_std_fraction * even(bits, 3))
            if not has_depth(optics, depth, row, column):
                depth = SKY_DEPTH_M
        depth_m[k] = depth
