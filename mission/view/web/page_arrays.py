"""Arrays and triangles for the pages that draw with `webgl.js`: base64 of little-endian numbers. Light to import."""

from base64 import b64encode
from typing import Any

from numpy.typing import NDArray

from mission.view.vehicle_shapes.mesh import Mesh

Json = dict[str, Any]


def array_data(values: NDArray[Any]) -> Json:
    """Numbers for JavaScript's typed arrays."""
    kind = {"f": "f4", "u": "u4", "i": "u4"}[values.dtype.kind] if values.dtype.itemsize > 1 else "u1"
    return {"type": kind, "data": b64encode(values.astype(f"<{kind}").tobytes()).decode()}


def mesh_data(mesh: Mesh) -> Json:
    """Triangles for `Renderer.mesh`."""
    return {name: array_data(getattr(mesh, name)) for name in ("vertices", "faces", "colours")}
