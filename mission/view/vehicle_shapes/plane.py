"""What a plane looks like, in frd: as large as its airframe file says, the rest as such planes usually are.

The left wing tip is red and the right one green, as their lights are.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from common.airframes.plane import Gear, PlaneAirframe
from mission.view.vehicle_shapes.mesh import Mesh, beam, box, divided, joined, painted

WHITE, NOSE, DARK = (236, 236, 232), (24, 74, 196), (40, 42, 46)
LEFT, RIGHT = (200, 40, 36), (40, 150, 60)
_RING = 8  # corners of a section of the fuselage
_TIP = 0.88  # of the half span, from where the wing is coloured
_TAPER = 0.65  # chord at the tip over that at the root
_THICK = 0.11  # of a wing, over its chord
_Point = tuple[float, float, float]


def plane(airframe: PlaneAirframe) -> Mesh:
    """The vehicle in one piece."""
    wing, hull = airframe.wing, airframe.hull
    root_m, half_m = wing.area_m2 / wing.span_m * 2.0 / (1.0 + _TAPER), 0.5 * wing.span_m
    wide_m = 0.3 * root_m
    tail_m, top_m = hull.tail_x_m, -0.6 * wide_m
    parts = [_fuselage(airframe, wide_m)]
    for side, tip_rgb in ((-1.0, LEFT), (1.0, RIGHT)):
        inner, outer = (0.0, _TIP), (_TIP, 1.0)
        for (begin, end), rgb in ((inner, WHITE), (outer, tip_rgb)):
            sections = [
                (0.3 * _chord(root_m, at), side * half_m * at, top_m + (hull.tip_z_m - top_m) * at, _chord(root_m, at))
                for at in (begin, end)
            ]
            parts.append(_panel(sections, rgb))
        span_m = 0.18 * wing.span_m
        tail = [(-tail_m + 0.5 * root_m, 0.0, hull.tail_z_m, 0.55 * root_m)]
        tail.append((-tail_m + 0.38 * root_m, side * span_m, hull.tail_z_m, 0.38 * root_m))
        parts.append(_panel(tail, WHITE))
    parts.append(_fin(tail_m, hull.tail_z_m, root_m, 0.13 * wing.span_m))
    radius_m = 0.5 * airframe.propeller.diameter_m
    parts.append(box((hull.nose_x_m, 0.0, 0.0), (0.02, 2.0 * radius_m, 0.1 * radius_m), DARK))
    if airframe.gear is not None:
        parts += _gear(airframe.gear)
    return divided(joined(parts))


def _chord(root_m: float, at: float) -> float:
    return root_m * (1.0 - (1.0 - _TAPER) * at)


def _fuselage(airframe: PlaneAirframe, wide_m: float) -> Mesh:
    """Rings from the nose to the tail; the nose is blue."""
    hull = airframe.hull
    deep_m = wide_m if airframe.belly is None else airframe.belly.depth_m
    rings = [
        (hull.nose_x_m, 0.25 * wide_m, 0.25 * deep_m, 0.0),
        (0.75 * hull.nose_x_m, 0.45 * wide_m, 0.8 * deep_m, 0.0),
        (0.0, 0.5 * wide_m, deep_m, 0.0),
        (-0.4 * hull.tail_x_m, 0.3 * wide_m, 0.55 * deep_m, 0.3 * hull.tail_z_m),
        (-hull.tail_x_m, 0.12 * wide_m, 0.2 * deep_m, hull.tail_z_m),
    ]
    return joined([_tube(a, b, NOSE if i == 0 else WHITE) for i, (a, b) in enumerate(pairwise(rings))])


def _tube(front: Sequence[float], rear: Sequence[float], rgb: tuple[int, int, int]) -> Mesh:
    """Between two rings: place along x, half width, half height, down."""
    angle = (np.arange(_RING) + 0.5) * 2.0 * np.pi / _RING
    points = [
        np.column_stack([np.full(_RING, x), y * np.cos(angle), z + h * np.sin(angle)]) for x, y, h, z in (front, rear)
    ]
    corners = np.concatenate(points)
    here, there = np.arange(_RING), (np.arange(_RING) + 1) % _RING
    faces = [np.stack([here, there, there + _RING], 1), np.stack([here, there + _RING, here + _RING], 1)]
    faces += [np.array([[first, first + k, first + k + 1] for k in range(1, _RING - 1)]) for first in (0, _RING)]
    return _convex(corners, np.concatenate(faces), rgb)


def _panel(sections: Sequence[tuple[float, float, float, float]], rgb: tuple[int, int, int]) -> Mesh:
    """A wing between two sections: leading edge, side, down, chord; thickest at a third of it."""
    corners = []
    for x, y, z, chord_m in sections:
        half_m = 0.5 * _THICK * chord_m
        corners += [
            (x, y, z),
            (x - 0.33 * chord_m, y, z - half_m),
            (x - chord_m, y, z),
            (x - 0.33 * chord_m, y, z + half_m),
        ]
    here, there = np.arange(4), (np.arange(4) + 1) % 4
    faces = [np.stack([here, there, there + 4], 1), np.stack([here, there + 4, here + 4], 1)]
    faces.append(np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]))
    return _convex(np.array(corners), np.concatenate(faces), rgb)


def _fin(tail_m: float, tail_z_m: float, root_m: float, tall_m: float) -> Mesh:
    """Upright on the tail."""
    lying = _panel(((0.5 * root_m, 0.0, 0.0, 0.55 * root_m), (0.35 * root_m, tall_m, 0.0, 0.33 * root_m)), NOSE)
    x, y, z = lying.vertices.T
    corners = np.column_stack([x - tail_m, z, tail_z_m - y])
    return Mesh(corners.astype(np.float32), lying.faces, lying.colours)  # turned, not mirrored


def _gear(gear: Gear) -> list[Mesh]:
    half_m, size_m = 0.5 * gear.track_m, 0.3 * gear.height_m
    parts = []
    for x, y in ((gear.nose_x_m, 0.0), (-gear.main_x_m, -half_m), (-gear.main_x_m, half_m)):
        hub: _Point = (x, y, gear.height_m - 0.5 * size_m)
        parts.append(
            beam((0.8 * x if y == 0.0 else 0.0, 0.3 * y, 0.0), np.array(hub, np.float32), 0.05 * gear.height_m, DARK)
        )
        parts.append(box(hub, (size_m, 0.3 * size_m, size_m), DARK))
    return parts


def _convex(corners: NDArray[np.float64], faces: NDArray[np.int64], rgb: tuple[int, int, int]) -> Mesh:
    """A convex solid, its faces turned so that they run counter-clockwise seen from outside."""
    a, b, c = (corners[faces[:, k]] for k in range(3))
    outward = (a + b + c) / 3.0 - corners.mean(axis=0)
    is_inside_out = (np.cross(b - a, c - a) * outward).sum(axis=1) < 0.0
    turned = np.where(is_inside_out[:, None], faces[:, ::-1], faces)
    return painted(corners.astype(np.float32), turned.astype(np.uint32), rgb)
