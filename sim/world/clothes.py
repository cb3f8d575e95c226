"""How people look: what they wear, and how broad they are. Colours are albedos of linear light.

In: a seed. Out: the blue shirt that owners have worn since the first pictures, or anything that people wear.
"""

from typing import Any

import warp as wp

from common.rng import draw_key
from sim.rng_streams import CLOTHES

wp.set_module_options({"enable_backward": False})

_SKIN_DARK = wp.constant(wp.vec3(0.060, 0.032, 0.020))  # guess, as all of these
_SKIN_FAIR = wp.constant(wp.vec3(0.560, 0.360, 0.270))
_HAIR_DARK = wp.constant(wp.vec3(0.010, 0.007, 0.005))
_HAIR_FAIR = wp.constant(wp.vec3(0.420, 0.300, 0.140))
_GIRTH = wp.constant(wp.vec2(0.85, 1.35))  # least and most


@wp.struct
class Clothes:
    """One person's looks."""

    shirt: wp.vec3
    trousers: wp.vec3
    skin: wp.vec3
    shoes: wp.vec3
    hair: wp.vec3
    girth: float  # of all limbs over that of an average body


def usual_clothes() -> Any:
    """A blue shirt and dark trousers."""
    clothes = Clothes()
    clothes.shirt = wp.vec3(0.030, 0.090, 0.550)
    clothes.trousers = wp.vec3(0.060, 0.060, 0.075)
    clothes.skin = wp.vec3(0.480, 0.290, 0.200)
    clothes.shoes = wp.vec3(0.320, 0.300, 0.280)
    clothes.hair = wp.vec3(0.060, 0.035, 0.020)
    clothes.girth = 1.0
    return clothes


@wp.func
def hue_colour(hue: float, saturation: float, value: float) -> wp.vec3:
    """A colour of a hue in [0, 1); as HSV, of linear light."""
    out = wp.vec3()
    for c in range(3):
        k = wp.mod(5.0 - 2.0 * float(c) + 6.0 * hue, 6.0)
        out[c] = value * (1.0 - saturation * wp.clamp(wp.min(k, 4.0 - k), 0.0, 1.0))
    return out


@wp.func
def any_clothes(seed: int, i: int, k: int) -> Clothes:
    """Drawn from all hues, from greys to bright colours, from dark to white; skin and hair likewise.

    Args:
        seed: of the draws.
        i: row of the batch.
        k: which of its people.
    """
    state = draw_key(seed, i, k, CLOTHES)
    clothes = Clothes()
    brightness = wp.randf(state)
    clothes.shirt = hue_colour(wp.randf(state), wp.sqrt(wp.randf(state)), 0.02 + 0.7 * brightness * brightness)
    darkness = wp.randf(state)
    clothes.trousers = hue_colour(wp.randf(state), 0.7 * wp.randf(state), 0.02 + 0.4 * darkness * darkness)
    tone = wp.randf(state)
    clothes.skin = (1.0 - tone) * _SKIN_DARK + tone * _SKIN_FAIR
    fair = wp.randf(state)
    clothes.hair = (1.0 - fair) * _HAIR_DARK + fair * _HAIR_FAIR
    shade = 0.03 + 0.5 * wp.randf(state)
    clothes.shoes = wp.vec3(shade, shade, shade)
    clothes.girth = _GIRTH[0] + (_GIRTH[1] - _GIRTH[0]) * wp.randf(state)
    return clothes
