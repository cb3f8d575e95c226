"""Heightmaps: the ground from an image of heights, and back to one.

Each pixel is a point of the terrain's grid, the upper edge of the image north, its middle at home. A map that is no
square is continued level beyond its shorter sides, as every ground here goes on beyond its edges.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.world.custom.world_file import Heightmap, WorldError
from sim.world.terrain import TerrainMap

MAX_PIXELS = 4096  # per side: 64 MB of heights
_FILE = ("heightmap", "file")
_SCALES = ("metres_per_pixel", "height_min_m", "height_max_m")


def heightmap_terrain(heightmap: Heightmap) -> TerrainMap:
    """The ground of a heightmap, at height 0 at home.

    Raises:
        WorldError: the file cannot be read, or the scale of its pixels is not known.
    """
    is_geo = heightmap.file.suffix.lower() in (".tif", ".tiff")
    image, cell_m = _geotiff(heightmap) if is_geo else _png(heightmap)
    rows, columns = image.shape
    if not 2 <= min(rows, columns) <= max(rows, columns) <= MAX_PIXELS:
        raise WorldError(_FILE, f"{columns} x {rows} pixels, from 2 to {MAX_PIXELS} per side are allowed")
    heights = _squared(image[::-1])  # rows to the north
    terrain = TerrainMap(heights, (len(heights) - 1) * cell_m)
    level = (heights - np.float32(terrain.height(0.0, 0.0))).astype(np.float32)
    level.setflags(write=False)
    return TerrainMap(level, terrain.size_m)


def write_heightmap(terrain: TerrainMap) -> tuple[bytes, Heightmap]:
    """The ground as a PNG of 16 bits, and the heightmap that reads it back; its file is still to be named."""
    import cv2

    low, high = float(terrain.heights.min()), float(terrain.heights.max())
    span = max(high - low, 1.0e-3)
    codes = np.rint((terrain.heights[::-1].astype(np.float64) - low) * (65535.0 / span)).astype(np.uint16)
    _, png = cv2.imencode(".png", codes)
    cell_m = terrain.size_m / terrain.cells
    return png.tobytes(), Heightmap(
        file=Path("heights.png"), metres_per_pixel=cell_m, height_min_m=low, height_max_m=low + span
    )


def _squared(heights: NDArray[np.float32]) -> NDArray[np.float32]:
    """The shorter sides continued by their edges, the middle kept in the middle."""
    side = max(heights.shape)
    spare = [side - count for count in heights.shape]
    return np.pad(heights, [(s // 2, s - s // 2) for s in spare], mode="edge")


def _png(heightmap: Heightmap) -> tuple[NDArray[np.float32], float]:
    """Heights [m], the first row north, and the distance of pixels [m]."""
    import cv2

    missing = [name for name in _SCALES if getattr(heightmap, name) is None]
    if missing:
        raise WorldError(
            ("heightmap",), f"a PNG has no scale of its own: {' and '.join(missing)} must say what its pixels stand for"
        )
    low, high = heightmap.height_min_m, heightmap.height_max_m
    if low is None or high is None or heightmap.metres_per_pixel is None or high <= low:
        raise WorldError(("heightmap", "height_max_m"), f"must be above height_min_m, {low:g}, not {high:g}")
    try:
        data = np.frombuffer(heightmap.file.read_bytes(), np.uint8)
    except OSError as error:
        raise WorldError(_FILE, f"{heightmap.file}: {(error.strerror or 'cannot be read').lower()}") from error
    image: Any = cv2.imdecode(data, cv2.IMREAD_UNCHANGED) if len(data) else None
    if image is None or image.ndim != 2 or image.dtype not in (np.uint8, np.uint16):
        raise WorldError(_FILE, f"{heightmap.file} is no PNG of one channel with 8 or 16 bits")
    most = float(np.iinfo(image.dtype).max)
    heights = low + image.astype(np.float64) * ((high - low) / most)
    return heights.astype(np.float32), heightmap.metres_per_pixel


def _geotiff(heightmap: Heightmap) -> tuple[NDArray[np.float32], float]:
    """Heights [m], the first row north, and the distance of pixels [m]."""
    given = [name for name in _SCALES if getattr(heightmap, name) is not None]
    if given:
        raise WorldError(("heightmap", given[0]), "a GeoTIFF has its own scale: leave this key out")
    try:
        import rasterio
    except ImportError:
        raise WorldError(
            _FILE, "reading a GeoTIFF needs the extra 'geo': pip install 'honeyguide[geo]' brings rasterio"
        ) from None
    try:
        with rasterio.open(heightmap.file) as source:
            image = source.read(1, masked=True)
            transform, crs = source.transform, source.crs
    except rasterio.errors.RasterioIOError as error:
        raise WorldError(_FILE, f"{heightmap.file} cannot be read as a GeoTIFF: {_one_line(error)}") from error
    if crs is None or not crs.is_projected or transform.b or transform.d or abs(transform.a + transform.e) > 1e-6:
        raise WorldError(
            _FILE, f"{heightmap.file} must be in a projection in metres, north up, with square pixels, such as UTM"
        )
    heights: NDArray[np.float32] = image.filled(np.float32(image.min())).astype(np.float32)
    return heights, float(transform.a) * float(crs.linear_units_factor[1])


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())
