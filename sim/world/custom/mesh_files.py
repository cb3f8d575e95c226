"""Meshes from files, read by trimesh: STL, OBJ, PLY and glTF, in the axes of the body frame (frd)."""

from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim.world.custom.solid_images import read_image
from sim.world.custom.world_file import FARTHEST_M, MeshSolid, WorldError

KINDS = (".stl", ".obj", ".ply", ".gltf", ".glb")
MAX_TRIANGLES = 5_000_000
_GREY = (168, 164, 158)
# rows: front, right and down of the file's x, y, z
_FRD_FROM_Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]])  # x ahead, y left, as in ROS
_FRD_FROM_Y_UP = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])  # z ahead, as in glTF


class FilePart(NamedTuple):
    """One mesh of a file."""

    name: str
    vertices_frd: NDArray[np.float64]  # [m], (n, 3)
    faces: NDArray[np.int32]  # (m, 3)
    rgb: tuple[int, int, int]
    uv: NDArray[np.float32] | None
    image: NDArray[np.uint8] | None


def read_mesh(item: MeshSolid, loc: tuple[int | str, ...]) -> list[FilePart]:
    """The meshes of a file as the world file wants them.

    Raises:
        WorldError: the file cannot be used; the sentence says what is allowed.
    """
    up = item.up or ("y" if item.file.suffix.lower() in (".gltf", ".glb") else "z")
    frd = item.scale * (_FRD_FROM_Y_UP if up == "y" else _FRD_FROM_Z_UP)
    image = None if item.texture is None else read_image(item.texture, (*loc, "texture"))
    parts = []
    meshes = _loaded(item.file, (*loc, "file"))
    _check_closed(item, meshes, (*loc, "file"))
    for k, mesh in enumerate(meshes):
        rgb, uv, own_image = _appearance(mesh)
        if item.colour is not None:
            rgb, own_image = (int(item.colour[1:3], 16), int(item.colour[3:5], 16), int(item.colour[5:7], 16)), None
        if image is not None and uv is None:
            raise WorldError((*loc, "texture"), f"{item.file} has no texture coordinates to lay an image on by")
        shown = image if image is not None else own_image
        vertices = np.asarray(mesh.vertices, np.float64) @ frd.T
        if not np.isfinite(vertices).all() or np.abs(vertices).max() > FARTHEST_M:
            raise WorldError(
                (*loc, "scale"), f"{item.file} reaches {np.abs(vertices).max():.3g} m far, at most {FARTHEST_M:g}"
            )
        parts.append(
            FilePart(f"_{k}", vertices, np.asarray(mesh.faces, np.int32), rgb, None if shown is None else uv, shown)
        )
    return parts


def _loaded(file: Path, loc: tuple[int | str, ...]) -> list[Any]:
    """The meshes of a file as trimesh reads them, each where the file puts it."""
    if file.suffix.lower() not in KINDS:
        raise WorldError(loc, f"{file}: must be one of {', '.join(KINDS)}")
    try:
        stamp = file.stat().st_mtime_ns
    except OSError as error:
        raise WorldError(loc, f"{file}: {(error.strerror or 'cannot be read').lower()}") from error
    try:
        meshes = _read(file, stamp)
    except ImportError:
        raise WorldError(loc, "reading a mesh needs the extra 'worlds': pip install 'honeyguide[worlds]'") from None
    except Exception as error:  # whatever a reader of foreign formats raises
        raise WorldError(loc, f"{file} cannot be read as {file.suffix[1:]}: {' '.join(str(error).split())}") from error
    count = sum(len(mesh.faces) for mesh in meshes)
    if not 0 < count <= MAX_TRIANGLES:
        raise WorldError(loc, f"{file} has {count} triangles, from 1 to {MAX_TRIANGLES} are allowed")
    return meshes


@lru_cache(maxsize=8)
def _read(file: Path, _stamp_ns: int) -> list[Any]:
    import trimesh

    scene = trimesh.load_scene(file)
    return [mesh for mesh in scene.dump() if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces)]


def _check_closed(item: MeshSolid, meshes: list[Any], loc: tuple[int | str, ...]) -> None:
    """Refuses holes, unless surfaces are what is meant."""
    if item.thin:
        return
    holes = sum(_open_edges(mesh) for mesh in meshes)
    if holes:
        raise WorldError(
            loc, f"{item.file} has holes ({holes} open edges): close them, or say thin: true if surfaces are meant"
        )


def _open_edges(mesh: Any) -> int:
    """How many edges do not belong to just two triangles, corners at the same place being one."""
    corners, index = np.unique(np.asarray(mesh.vertices).round(9), axis=0, return_inverse=True)
    faces = index.reshape(-1)[np.asarray(mesh.faces)]
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    edges = edges[edges[:, 0] != edges[:, 1]]
    _, counts = np.unique(edges[:, 0].astype(np.int64) * len(corners) + edges[:, 1], return_counts=True)
    return int((counts % 2 == 1).sum())


def _appearance(mesh: Any) -> tuple[tuple[int, int, int], NDArray[np.float32] | None, NDArray[np.uint8] | None]:
    """Colour, texture coordinates and image of a mesh, as far as its file has them."""
    visual = mesh.visual
    uv = getattr(visual, "uv", None)
    coordinates = None if uv is None or len(uv) != len(mesh.vertices) else np.asarray(uv, np.float32)
    material = getattr(visual, "material", None)
    if material is None:
        rgb = np.asarray(visual.main_color)[:3] if getattr(visual, "defined", False) else _GREY
        return (int(rgb[0]), int(rgb[1]), int(rgb[2])), coordinates, None
    colour = getattr(material, "main_color", None)
    rgb = _GREY if colour is None else np.asarray(colour)[:3]
    picture = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
    image = None if picture is None else np.asarray(picture.convert("RGB"), np.uint8)
    return (int(rgb[0]), int(rgb[1]), int(rgb[2])), coordinates, None if coordinates is None else image
