"""Triangles, and the plain solids that vehicles and trees are made of."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
SIDES = 7  # of a trunk: few triangles, and round enough
BARK = (104, 82, 62)
LEAVES = ((58, 98, 44), (94, 132, 62))  # darkest and lightest


@dataclass(frozen=True, eq=False, slots=True)
class Mesh:
    """Triangles."""

    vertices: Floats  # (n, 3)
    faces: NDArray[np.uint32]  # (m, 3)
    colours: NDArray[np.uint8]  # (n, 3)


def box(
    centre: tuple[float, float, float] | Floats, size: tuple[float, float, float], rgb: tuple[int, int, int]
) -> Mesh:
    """A box along the axes; no two sides share a vertex, so that its edges stay sharp."""
    vertices: list[NDArray[np.float64]] = []
    faces: list[int] = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            outward = np.zeros(3)
            outward[axis] = sign
            right, up = np.roll(np.abs(outward), 1), np.roll(np.abs(outward), 2)
            first = len(vertices)
            vertices += [outward - right - up, outward + right - up, outward + right + up, outward - right + up]
            order = (0, 1, 2, 0, 2, 3) if sign > 0.0 else (0, 2, 1, 0, 3, 2)
            faces += [first + k for k in order]
    corners = np.array(centre) + 0.5 * np.array(vertices) * np.array(size)
    return painted(corners.astype(np.float32), np.array(faces, np.uint32).reshape(-1, 3), rgb)


def beam(start: tuple[float, float, float], end: Floats, width_m: float, rgb: tuple[int, int, int]) -> Mesh:
    """A box from one place to another."""
    along = np.asarray(end, np.float32) - np.array(start, np.float32)
    length = float(np.linalg.norm(along))
    x = along / length
    y = np.cross((0.0, 0.0, 1.0), x)
    y /= np.linalg.norm(y)
    level = box((0.5 * length, 0.0, 0.0), (length, width_m, width_m), rgb)
    turned = level.vertices @ np.stack([x, y, np.cross(x, y)]).astype(np.float32)
    return Mesh(turned + np.array(start, np.float32), level.faces, level.colours)


def trunk() -> Mesh:
    """The side of a cylinder of radius 1 from z = -1 to 1."""
    angle = np.arange(SIDES) * 2.0 * np.pi / SIDES
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    vertices = np.concatenate([np.column_stack([ring, np.full(SIDES, z)]) for z in (-1.0, 1.0)])
    here, there = np.arange(SIDES), (np.arange(SIDES) + 1) % SIDES
    faces = np.concatenate(
        [np.stack([here, there, there + SIDES], axis=1), np.stack([here, there + SIDES, here + SIDES], axis=1)]
    )
    return painted(vertices.astype(np.float32), faces.astype(np.uint32), BARK)


def ball() -> Mesh:
    """An octahedron whose faces have been divided once and pushed out to radius 1: 32 triangles."""
    corners = [np.array(c, float) for c in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0), (0, -1, 0), (0, 0, -1))]
    coarse = [(x, y, z) for x in (0, 3) for y in (1, 4) for z in (2, 5)]
    vertices: list[NDArray[np.float64]] = []
    faces: list[tuple[int, int, int]] = []
    for x, y, z in coarse:
        a, b, c = (corners[i] for i in (x, y, z))
        if np.dot(np.cross(b - a, c - a), a + b + c) < 0.0:
            b, c = c, b
        middles = [m / np.linalg.norm(m) for m in (a + b, b + c, c + a)]
        first = len(vertices)
        vertices += [a, b, c, *middles]
        faces += [(first + i, first + j, first + k) for i, j, k in ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5))]
    unique, index = np.unique(np.round(np.array(vertices), 6), axis=0, return_inverse=True)
    return painted(unique.astype(np.float32), index.reshape(-1)[np.array(faces)].astype(np.uint32), LEAVES[0])


def painted(vertices: Floats, faces: NDArray[np.uint32], rgb: tuple[int, int, int]) -> Mesh:
    """In one colour."""
    return Mesh(vertices, faces, np.broadcast_to(np.array(rgb, np.uint8), (len(vertices), 3)).copy())


def joined(parts: list[Mesh]) -> Mesh:
    """Several meshes as one."""
    starts = np.cumsum([0] + [len(part.vertices) for part in parts[:-1]]).astype(np.uint32)
    return Mesh(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=True)]),
        np.concatenate([part.colours for part in parts]),
    )


def divided(mesh: Mesh) -> Mesh:
    """The same with four triangles for each: small ones can be painted in the order of their distance."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
    corners = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3)
    colours = np.repeat(mesh.colours[mesh.faces[:, 0]], 12, axis=0)
    return Mesh(corners.astype(np.float32), np.arange(len(corners), dtype=np.uint32).reshape(-1, 3), colours)
