"""A world as files of others: everything that stands in it and its ground as glTF, and its ground as a heightmap."""

from pathlib import Path
from typing import Any

import numpy as np
import trimesh
import yaml

from common.files import write_whole
from mission.console.option_checks import UserError
from mission.view import shapes
from mission.world.world_shapes import part_mesh
from sim.world.custom.heightmap import write_heightmap
from sim.world.world import WorldMap

_GLTF_FROM_NED = np.array([[0.0, -1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""y is up and z points north, as glTF's models look ahead; `up: y` reads it back."""
_GROUND_CELLS = 512


def export_world(world: WorldMap, file: Path) -> None:
    """Writes ground, trees and solids as glTF (.glb), or the ground's heights as a PNG with a `.yaml` of their scale.

    Raises:
        UserError: the file's ending says neither, or it cannot be written.
    """
    kind = file.suffix.lower()
    if kind not in (".glb", ".png"):
        raise UserError(f"--export {file}: must end with .glb (everything) or .png (the ground's heights)")
    try:
        if kind == ".glb":
            write_whole(file, glb_bytes(world))
        else:
            _write_heights(world, file)
    except OSError as error:
        raise UserError(f"--export {file}: {error.strerror or error}") from error


def glb_bytes(world: WorldMap) -> bytes:
    """Everything that stands still, as one glTF file."""
    scene: Any = trimesh.Scene()
    _add(scene, "ground", _coloured(shapes.ground(world, _GROUND_CELLS)))
    for name, mesh in (("edge_walls", shapes.walls(world)), ("boxes", shapes.boxes(world))):
        if mesh is not None:
            _add(scene, name, _coloured(mesh))
    for name, many in _trees(world):
        _add(scene, name, many)
    for part in world.solids.parts:
        _add(scene, part.name, part_mesh(part))
    return bytes(scene.export(file_type="glb"))


def _add(scene: trimesh.Scene, name: str, mesh: trimesh.Trimesh) -> None:
    scene.add_geometry(mesh.apply_transform(_GLTF_FROM_NED), node_name=name, geom_name=name)


def _coloured(mesh: shapes.Mesh) -> trimesh.Trimesh:
    linear = (255.0 * (mesh.colours / 255.0) ** 2.2).astype(np.uint8)
    return trimesh.Trimesh(mesh.vertices, mesh.faces, vertex_colors=linear, process=False)


def _trees(world: WorldMap) -> list[tuple[str, trimesh.Trimesh]]:
    """All trunks as one mesh and all crowns as another."""
    forest = shapes.trees(world)
    if len(forest.trunk_ned) == 0:
        return []
    bark = np.tile(np.array(shapes.BARK, np.uint8), (len(forest.trunk_ned), 1))
    found = []
    for name, mesh, places, sizes, tints in (
        ("trunks", shapes.trunk(), forest.trunk_ned, forest.trunk_size, bark),
        ("crowns", shapes.ball(), forest.crown_ned, forest.crown_size, forest.crown_colours),
    ):
        count, corners = len(places), len(mesh.vertices)
        vertices = (mesh.vertices[None] * sizes[:, None] + places[:, None]).reshape(-1, 3)
        firsts = np.arange(count, dtype=np.uint32)[:, None, None] * np.uint32(corners)
        faces = (mesh.faces[None] + firsts).reshape(-1, 3)
        found.append(
            (name, _coloured(shapes.Mesh(vertices.astype(np.float32), faces, np.repeat(tints, corners, axis=0))))
        )
    return found


def _write_heights(world: WorldMap, file: Path) -> None:
    png, heightmap = write_heightmap(world.terrain)
    scale = {name: getattr(heightmap, name) for name in ("metres_per_pixel", "height_min_m", "height_max_m")}
    write_whole(file, png)
    text = yaml.safe_dump({"heightmap": {"file": file.name} | scale}, sort_keys=False)
    write_whole(file.with_suffix(".yaml"), text.encode())
