"""The colours of solids in images: of each triangle its part's colour, or the texel of the part's image.

Made once per camera from the parts that a world's solids are made of. Cameras alone carry it: bodies and range finders
need no colours.
"""

import numpy as np
import warp as wp
from numpy.typing import NDArray

from sim.world.custom.solids import SolidsMap

wp.set_module_options({"enable_backward": False})

_GAMMA = 2.2  # sRGB, nearly
_TEXEL_GAMMA = wp.constant(_GAMMA)


@wp.struct
class SolidPaint:
    """Colours of all solids of one world."""

    part: wp.array[wp.int32]  # of each triangle
    albedo: wp.array[wp.vec3]  # of each part, linear
    image: wp.array[wp.vec3i]  # of each part: first texel, -1 for none, width, height
    uv: wp.array2d[wp.vec2]  # of each triangle's corners, (triangles, 3)
    texels: wp.array[wp.uint8]  # sRGB of all images, row by row from the top, (texels * 3,)


@wp.func
def solid_albedo(paint: SolidPaint, face: int, u: float, v: float) -> wp.vec3:
    """Fraction of the light that a place on a triangle sends back: by its barycentric coordinates."""
    part = paint.part[face]
    image = paint.image[part]
    if image[0] < 0:
        return paint.albedo[part]
    place = u * paint.uv[face, 0] + v * paint.uv[face, 1] + (1.0 - u - v) * paint.uv[face, 2]
    across = place[0] - wp.floor(place[0])
    up = place[1] - wp.floor(place[1])
    column = wp.min(int(across * float(image[1])), image[1] - 1)
    row = wp.min(int((1.0 - up) * float(image[2])), image[2] - 1)
    texel = 3 * (image[0] + row * image[1] + column)
    return wp.vec3(
        wp.pow(float(paint.texels[texel]) / 255.0, _TEXEL_GAMMA),
        wp.pow(float(paint.texels[texel + 1]) / 255.0, _TEXEL_GAMMA),
        wp.pow(float(paint.texels[texel + 2]) / 255.0, _TEXEL_GAMMA),
    )


def make_paint(solids: SolidsMap, device: str) -> SolidPaint:
    """The colours of a world's solids on a device."""
    parts = solids.parts
    of_face, corners, images = [np.zeros(0, np.int32)], [np.zeros((0, 3, 2), np.float32)], []
    texels: list[NDArray[np.uint8]] = []
    first = 0
    for k, part in enumerate(parts):
        of_face.append(np.full(len(part.faces), k, np.int32))
        uv = np.zeros((len(part.vertices_ned), 2), np.float32) if part.uv is None else part.uv
        corners.append(_whole(uv[part.faces]))
        if part.image is None:
            images.append((-1, 0, 0))
            continue
        height, width, _ = part.image.shape
        images.append((first, width, height))
        texels.append(part.image.ravel())
        first += width * height
    paint = SolidPaint()
    paint.part = wp.array(np.concatenate(of_face), dtype=wp.int32, device=device)
    albedo = (np.array([part.rgb for part in parts], np.float32).reshape(-1, 3) / 255.0) ** _GAMMA
    paint.albedo = wp.array(albedo.astype(np.float32), dtype=wp.vec3, device=device)
    paint.image = wp.array(np.array(images, np.int32).reshape(-1, 3), dtype=wp.vec3i, device=device)
    paint.uv = wp.array(np.concatenate(corners), dtype=wp.vec2, device=device)
    paint.texels = wp.array(np.concatenate([*texels, np.zeros(3, np.uint8)]), dtype=wp.uint8, device=device)
    return paint


def _whole(corners: NDArray[np.float32]) -> NDArray[np.float32]:
    """Coordinates just inside an image's edges, so that its last texel is not followed by its first."""
    return np.where((corners >= 0.0) & (corners <= 1.0), corners * np.float32(0.9998) + np.float32(0.0001), corners)
