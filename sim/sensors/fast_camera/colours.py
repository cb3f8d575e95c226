"""The fast camera's colours: tables instead of noise functions, in the tones of `sim.sensors.shading`.

Linear light until `encoded`. One set of tables is shared by all worlds and repeats every 128 m. Left out: what the
exact renderer alone does, sharp shadows, shadows on trees and walls, bark.
"""

from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from sim.sensors.fast_camera.flags import FAST
from sim.sensors.shading import HAZE, SKY_LIGHT, SUN_LIGHT, ZENITH

wp.set_module_options(FAST)

SIDE = 256  # texels per side of a table
_SIDE = wp.constant(SIDE)
_MASK = wp.constant(SIDE - 1)
_PATCHES_PER_M = wp.constant(2.0)
_DETAIL_PER_M = wp.constant(16.0)
_BLEND_M = wp.constant(0.08)  # pixels finer than a texel
_TONES = 256
_LAST_CODE = wp.constant(2047)
_DARKEST = wp.constant(2.0**-12)
_BRIGHTEST = wp.constant(15.99)
_DARKEST_BITS = wp.constant((127 - 12) << 23)
_DROPPED_BITS = wp.constant(16)  # of a float's, so that 128 codes are in each doubling of the light
_CLOUD = wp.constant(wp.vec3(0.93, 0.94, 0.96))


@wp.struct
class Paints:
    """The tables."""

    tones: wp.array[wp.vec3]  # from grass over meadow to bare earth, (256,)
    patches: wp.array[wp.uint8]  # which tone, half a metre a texel, (256 * 256,)
    detail: wp.array[wp.uint8]  # 128 is the mean, (256 * 256,)
    clouds: wp.array[wp.uint8]
    codes: wp.array[wp.uint8]  # sRGB of light from 2^-12 to 16 in steps of its floats' bits, (2048,)


@wp.func
def blended(table: wp.array[wp.uint8], x: float, y: float) -> float:
    """A repeating table between four texels, -1..1."""
    x_low = wp.floor(x)
    y_low = wp.floor(y)
    u = x - x_low
    v = y - y_low
    row = (int(x_low) & _MASK) * _SIDE
    next_row = ((int(x_low) + 1) & _MASK) * _SIDE
    column = int(y_low) & _MASK
    next_column = (column + 1) & _MASK
    low = float(table[row + column]) + v * (float(table[row + next_column]) - float(table[row + column]))
    high = float(table[next_row + column]) + v * (
        float(table[next_row + next_column]) - float(table[next_row + column])
    )
    return (low + u * (high - low)) * (1.0 / 128.0) - 1.0


@wp.func
def nearest(table: wp.array[wp.uint8], x: float, y: float) -> float:
    """A repeating table at its nearest texel, -1..1."""
    texel = (int(wp.floor(x)) & _MASK) * _SIDE + (int(wp.floor(y)) & _MASK)
    return float(table[texel]) * (1.0 / 128.0) - 1.0


@wp.func
def ground_colour(paints: Paints, north: float, east: float, sun: float, footprint_m: float) -> wp.vec3:
    """Light sent back by the ground.

    Args:
        paints: the tables.
        north: [m].
        east: [m].
        sun: cosine of the sun on the ground, 0 in a shadow.
        footprint_m: width of a pixel there: detail finer than it is faded out.
    """
    fade = wp.clamp(1.2 - 2.0 * footprint_m, 0.12, 1.0)
    detail = float(0.0)
    if footprint_m < _BLEND_M:
        detail = fade * blended(paints.detail, north * _DETAIL_PER_M, east * _DETAIL_PER_M)
    else:
        detail = fade * nearest(paints.detail, north * _DETAIL_PER_M, east * _DETAIL_PER_M)
    x = int(wp.floor(north * _PATCHES_PER_M + 0.9 * detail)) & _MASK
    y = int(wp.floor(east * _PATCHES_PER_M - 0.9 * detail)) & _MASK
    tone = int(float(paints.patches[x * _SIDE + y]) + 34.0 * detail)
    albedo = paints.tones[wp.clamp(tone, 0, 255)] * (1.0 + 0.45 * detail)
    return 2.2 * wp.cw_mul(albedo, sun * SUN_LIGHT + SKY_LIGHT)


@wp.func
def sky_light(paints: Paints, north: float, east: float, climb: float, length: float) -> wp.vec3:
    """Light of the sky along a ray: haze at the horizon, blue above, thin clouds.

    Args:
        paints: the tables.
        north: part of the ray.
        east: part of the ray.
        climb: part of the ray.
        length: of the ray.
    """
    if climb <= 0.0:
        return HAZE
    up = climb / length
    blue = 3.2 * up / (0.55 + 2.65 * up)
    colour = HAZE + blue * (ZENITH - HAZE)
    scale = 26.0 / (climb + 0.06 * length)
    cover = wp.clamp(1.3 * blended(paints.clouds, north * scale, east * scale), 0.0, 0.8) * wp.min(6.0 * up, 1.0)
    return colour + cover * (_CLOUD - colour)


@wp.func
def code(paints: Paints, light: float) -> wp.uint8:
    """8-bit sRGB of linear light, its highlights rolled off: by its exponent and the first bits of its mantissa."""
    bits = wp.cast(wp.clamp(light, _DARKEST, _BRIGHTEST), wp.int32)
    return paints.codes[((bits - _DARKEST_BITS) >> _DROPPED_BITS) & _LAST_CODE]


def _smooth_noise(rng: np.random.Generator, steepness: float, longest: float) -> NDArray[np.float64]:
    """Repeating noise of unit variance whose amplitude falls with a power of the frequency.

    Args:
        rng: draws it.
        steepness: that power.
        longest: wavelengths above this fraction of the side are left out.
    """
    along = np.fft.fftfreq(SIDE) * SIDE
    frequency = np.hypot(along[:, None], along[None, :])
    weight = np.where(frequency >= 1.0 / longest, np.maximum(frequency, 1.0) ** -steepness, 0.0)
    noise: NDArray[np.float64] = np.fft.ifft2(np.fft.fft2(rng.normal(size=(SIDE, SIDE))) * weight).real
    return noise / noise.std()


def _bytes(values: NDArray[np.float64]) -> NDArray[np.uint8]:
    return np.clip(np.round(values), 0, 255).astype(np.uint8).ravel()


def make_paints(device: str) -> Any:
    """The tables on a device."""
    rng = np.random.default_rng(11)
    position = np.linspace(0.0, 1.0, _TONES)
    stops = [0.0, 0.45, 0.80, 1.0]
    colours = np.array([[0.060, 0.118, 0.024], [0.092, 0.150, 0.034], [0.160, 0.185, 0.058], [0.170, 0.140, 0.075]])
    tones = np.stack([np.interp(position, stops, colours[:, i]) for i in range(3)], axis=-1)
    steps = np.arange(2048)
    light = 2.0 ** (steps // 128 - 12) * (1.0 + (steps % 128 + 0.5) / 128.0)
    rolled = light * (1.0 + 0.12 * light) / (1.0 + light)
    paints = Paints()
    paints.tones = wp.array(tones, dtype=wp.vec3, device=device)
    patches = 105.0 + 52.0 * _smooth_noise(rng, 1.3, 0.4)
    paints.patches = wp.array(_bytes(patches), dtype=wp.uint8, device=device)
    paints.detail = wp.array(_bytes(128.0 + 42.0 * _smooth_noise(rng, 0.75, 0.1)), dtype=wp.uint8, device=device)
    paints.clouds = wp.array(_bytes(105.0 + 60.0 * _smooth_noise(rng, 1.8, 0.35)), dtype=wp.uint8, device=device)
    codes = 255.0 * np.minimum(1.25 * rolled, 1.0) ** (1.0 / 2.2)
    paints.codes = wp.array(_bytes(codes), dtype=wp.uint8, device=device)
    return paints
