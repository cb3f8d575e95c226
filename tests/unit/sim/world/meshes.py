"""Meshes for the tests, and an oracle of their own for rays and distances: NumPy in float64, every triangle."""

from pathlib import Path

import numpy as np
import trimesh

from sim.world.custom.world_file import MeshSolid, WorldFile
from sim.world.world import WorldMap, build_world


def lump(folder: Path, seed: int = 1, *, subdivisions: int = 3) -> Path:
    """A closed mesh without symmetry, about 6 m across, as STL with its middle at the origin."""
    rng = np.random.default_rng(seed)
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions, radius=3.0)
    waves = rng.normal(size=(6, 3))
    swell = 1.0 + 0.05 * np.sin(mesh.vertices @ waves.T + rng.uniform(0.0, 6.0, 6)).sum(axis=1)
    mesh.vertices *= swell[:, None]
    file = folder / f"lump{seed}.stl"
    mesh.export(file)
    return file


def world_of(**things) -> WorldMap:
    """A plain with these things on it."""
    return build_world(WorldFile(**things))


def lump_world(folder: Path, seed: int = 1, **more) -> WorldMap:
    """A lump whose middle is 5 m above a place north-east of home."""
    return world_of(
        meshes=[MeshSolid(file=lump(folder, seed, **more), position_ned_m=(12.0, 7.0, -5.0), heading_deg=35.0)]
    )


def ray_oracle(world: WorldMap, origins: np.ndarray, dirs: np.ndarray) -> np.ndarray:
    """Distance along each ray to the first triangle, inf for none (Moeller and Trumbore 1997)."""
    corners = world.solids.vertices_ned.astype(float)[world.solids.faces]
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    found = np.full(len(origins), np.inf)
    for i, (origin, direction) in enumerate(zip(origins, dirs, strict=True)):
        p = np.cross(direction, ac)
        det = (ab * p).sum(axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            off = origin - a
            u = (off * p).sum(axis=1) / det
            q = np.cross(off, ab)
            v = (q @ direction) / det
            t = (ac * q).sum(axis=1) / det
        hits = t[(u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t >= 0.0)]
        found[i] = hits.min(initial=np.inf)
    return found


def rays_at(middle: tuple[float, float, float], count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Rays from all round, above the ground, towards places near a middle."""
    rng = np.random.default_rng(seed)
    off = rng.normal(size=(count, 3))
    origins = np.array(middle) + 12.0 * off / np.linalg.norm(off, axis=1, keepdims=True)
    origins[:, 2] = np.minimum(origins[:, 2], -0.5)
    towards = np.array(middle) + rng.uniform(-2.5, 2.5, (count, 3)) - origins
    return origins, towards / np.linalg.norm(towards, axis=1, keepdims=True)
