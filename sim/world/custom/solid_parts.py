"""What a world file says stands there, as triangles in ned: each thing a part with its colour or its image.

The triangles are what vehicles touch, rays meet and cameras see; what people are shown and what is exported are these
parts as well.
"""

from dataclasses import dataclass
from itertools import pairwise
from math import ceil, cos, pi, radians, sin, sqrt
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sim.world.custom.mesh_files import read_mesh
from sim.world.custom.solid_images import pad_mark, read_image
from sim.world.custom.world_file import (
    BoxSolid,
    CylinderSolid,
    PadSolid,
    Position,
    WallSolid,
    WorldFile,
)
from sim.world.terrain import TerrainMap

Vertices = NDArray[np.float64]
Faces = NDArray[np.int32]

_ROUND_M = 5.0e-4  # how far a cylinder's sides may be from the round one
_SIDES = (12, 720)  # at least and at most
_STEP_M = 0.1  # along a wall, at which the ground is looked up
_FOOT_M = 0.5  # how far walls go under the ground
_PAD_RGB = (84, 84, 80)


@dataclass(frozen=True, eq=False, slots=True)
class SolidPart:
    """One thing: triangles of one colour, or with one image on them."""

    name: str
    vertices_ned: NDArray[np.float32]  # [m], (n, 3)
    faces: NDArray[np.int32]  # (m, 3), counter-clockwise seen from outside
    rgb: tuple[int, int, int]  # sRGB
    uv: NDArray[np.float32] | None = None  # (n, 2) of the image, its lower left corner (0, 0)
    image: NDArray[np.uint8] | None = None  # (height, width, 3), sRGB


def solid_parts(world: WorldFile, terrain: TerrainMap) -> tuple[SolidPart, ...]:
    """Everything that stands in a world.

    Raises:
        WorldError: a file cannot be used.
    """
    parts = [_box(item, terrain, k) for k, item in enumerate(world.boxes)]
    parts += [_wall(item, terrain, k) for k, item in enumerate(world.walls)]
    parts += [_cylinder(item, terrain, k) for k, item in enumerate(world.cylinders)]
    for k, pad in enumerate(world.pads):
        parts += _pad(pad, terrain, k)
    for k, item in enumerate(world.meshes):
        place = _place(item.position_ned_m, terrain)
        for name, vertices, faces, rgb, uv, image in read_mesh(item, ("meshes", k)):
            turned = turned_ned(vertices, item.heading_deg) + place
            parts.append(SolidPart(f"mesh{k}{name}", turned.astype(np.float32), faces, rgb, uv, image))
    return tuple(parts)


def turned_ned(vertices: Vertices, heading_deg: float) -> Vertices:
    """Turned clockwise about the vertical."""
    c, s = cos(radians(heading_deg)), sin(radians(heading_deg))
    return np.asarray(vertices @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]))


def rgb_of(colour: str) -> tuple[int, int, int]:
    """The numbers of #rrggbb."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def _place(position: Position, terrain: TerrainMap) -> NDArray[np.float64]:
    """A position; one of two numbers is on the ground."""
    north, east, *given = position
    down = given[0] if given else -float(terrain.height(north, east))
    return np.array([north, east, down])


def _box(item: BoxSolid, terrain: TerrainMap, k: int) -> SolidPart:
    vertices, faces, uv = _cuboid(item.size_m)
    turned = turned_ned(vertices, item.heading_deg) + _place(item.position_ned_m, terrain)
    return _part(f"box{k}", turned, faces, item.colour, uv, item.texture, ("boxes", k))


def _wall(item: WallSolid, terrain: TerrainMap, k: int) -> SolidPart:
    """A box for each stretch, long enough to close the corners."""
    stretches: list[Vertices] = []
    points = np.array(item.points_ne_m)
    for start, end in pairwise(points):
        along = end - start
        length = float(np.hypot(*along))
        line = start + np.linspace(0.0, 1.0, max(2, ceil(length / _STEP_M)))[:, None] * along
        ground = terrain.height(line[:, 0], line[:, 1])
        low, high = float(ground.min()) - _FOOT_M, float(ground.max()) + item.height_m
        vertices, _, _ = _cuboid((length + item.thickness_m, item.thickness_m, high - low))
        heading_deg = float(np.degrees(np.arctan2(along[1], along[0])))
        stretches.append(turned_ned(vertices, heading_deg) + np.array([*(0.5 * (start + end)), -low]))
    _, faces, uv = _cuboid((1.0, 1.0, 1.0))
    count = len(stretches)
    all_faces = np.concatenate([faces + 24 * i for i in range(count)])
    return _part(
        f"wall{k}",
        np.concatenate(stretches),
        all_faces,
        item.colour,
        np.tile(uv, (count, 1)),
        item.texture,
        ("walls", k),
    )


def _cuboid(size_m: tuple[float, ...]) -> tuple[Vertices, Faces, NDArray[np.float32]]:
    """A box on its bottom's middle, four corners a side, so that each side has its own image."""
    height = size_m[2]
    corners: list[list[float]] = []
    faces: list[list[int]] = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            outward = np.eye(3)[axis] * sign
            up = np.array([0.0, 0.0, -1.0]) if axis < 2 else np.array([1.0, 0.0, 0.0])
            right = np.cross(up, outward)  # as the side is seen from outside, down being positive
            first = len(corners)
            square = (-right - up, right - up, right + up, -right + up)
            corners += [(outward + corner).tolist() for corner in square]
            faces += [[first, first + 1, first + 2], [first, first + 2, first + 3]]
    vertices = 0.5 * np.array(corners) * np.array(size_m) - np.array([0.0, 0.0, 0.5 * height])
    uv = np.tile(np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32), (6, 1))
    return vertices, np.array(faces, np.int32), uv


def sides_of(radius_m: float) -> int:
    """How many sides a prism needs to be within `_ROUND_M` of the cylinder in and out."""
    return int(np.clip(ceil(pi / sqrt(2.0 * 2.0 * _ROUND_M / radius_m)), *_SIDES))


def _prism(radius_m: float, height_m: float) -> tuple[Vertices, Faces, int]:
    """A prism on its bottom's middle: the ring of its side, then its bottom, then its top; and how many sides."""
    sides = sides_of(radius_m)
    angle = np.arange(sides) * (2.0 * pi / sides)
    # half of the sides' sagitta outwards: the round one is between corners and middles of the sides
    radius = radius_m * 2.0 / (1.0 + cos(pi / sides))
    ring = radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    low, high = np.column_stack([ring, np.zeros(sides)]), np.column_stack([ring, np.full(sides, -height_m)])
    middles = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -height_m]])
    here, there = np.arange(sides), (np.arange(sides) + 1) % sides
    side = [
        np.stack([here, there, there + sides], axis=1),
        np.stack([here, there + sides, here + sides], axis=1),
    ]
    bottom = np.stack([np.full(sides, 4 * sides), there + 2 * sides, here + 2 * sides], axis=1)
    top = np.stack([np.full(sides, 4 * sides + 1), here + 3 * sides, there + 3 * sides], axis=1)
    vertices = np.concatenate([low, high, low, high, middles])
    return vertices, np.concatenate([*side, bottom, top])[:, ::-1].astype(np.int32), sides


def _cylinder(item: CylinderSolid, terrain: TerrainMap, k: int) -> SolidPart:
    vertices, faces, _ = _prism(item.radius_m, item.height_m)
    place = _place(item.position_ned_m, terrain)
    return SolidPart(f"cylinder{k}", (vertices + place).astype(np.float32), faces, rgb_of(item.colour))


def _pad(item: PadSolid, terrain: TerrainMap, k: int) -> list[SolidPart]:
    """Its side and bottom, and its top with the mark."""
    vertices, faces, sides = _prism(item.radius_m, item.height_m)
    uv = 0.5 + 0.5 * np.stack([vertices[:, 1], vertices[:, 0]], axis=-1) / np.abs(vertices[:, :2]).max()
    placed = (turned_ned(vertices, item.heading_deg) + _place(item.position_ned_m, terrain)).astype(np.float32)
    image = pad_mark() if item.texture is None else read_image(item.texture, ("pads", k, "texture"))
    return [
        SolidPart(f"pad{k}", placed, faces[:-sides], _PAD_RGB),
        SolidPart(f"pad{k}top", placed, faces[-sides:], _PAD_RGB, uv.astype(np.float32), image),
    ]


def _part(
    name: str,
    vertices: Vertices,
    faces: Faces,
    colour: str,
    uv: NDArray[np.float32],
    texture: Path | None,
    loc: tuple[int | str, ...],
) -> SolidPart:
    image = None if texture is None else read_image(texture, (*loc, "texture"))
    return SolidPart(name, vertices.astype(np.float32), faces, rgb_of(colour), None if image is None else uv, image)
