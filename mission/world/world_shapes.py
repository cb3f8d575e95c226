"""Solids of a world file as meshes of trimesh, with their colours and images: for the live page and for export."""

from typing import Any

import numpy as np
import trimesh
from PIL import Image

from sim.world.custom.solid_parts import SolidPart


def part_mesh(part: SolidPart) -> trimesh.Trimesh:
    """One part as glTF shows it, in ned."""
    linear = (np.array(part.rgb) / 255.0) ** 2.2  # glTF's colours are linear light, its images sRGB
    visuals: Any = trimesh.visual  # untyped
    material = visuals.material.PBRMaterial(
        baseColorFactor=[*linear, 1.0] if part.image is None else [1.0, 1.0, 1.0, 1.0],
        baseColorTexture=None if part.image is None else Image.fromarray(part.image),
        metallicFactor=0.0,
        roughnessFactor=0.9,
        doubleSided=True,
    )
    uv = np.zeros((len(part.vertices_ned), 2)) if part.uv is None else part.uv
    # triangles of their own corners: a viewer that shades smoothly would round off the edges
    corners, own = part.vertices_ned[part.faces.ravel()], np.arange(3 * len(part.faces)).reshape(-1, 3)
    visual = visuals.TextureVisuals(uv=uv[part.faces.ravel()], material=material)
    return trimesh.Trimesh(corners, own, visual=visual, process=False)
