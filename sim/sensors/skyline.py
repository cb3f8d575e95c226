"""Heights that rays may pass over: the highest point of ground and trees in squares of two sizes.

A camera ray skips the squares it passes above, and looks closely only at those it enters. Made once per world.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp
from numpy.typing import NDArray

from sim.world.world import WorldMap

wp.set_module_options({"enable_backward": False})

BLOCK_BUCKETS = wp.constant(4)  # buckets per side of a block; 32 m: measured best of 2, 4 and 8


@wp.struct
class Skyline:
    """Tops of the forest's buckets and of blocks of BLOCK_BUCKETS x BLOCK_BUCKETS of them."""

    bucket_top: wp.array2d[wp.float32]  # [m] above the home plane: ground and trees
    bucket_ground: wp.array2d[wp.float32]  # [m] ground alone
    block_top: wp.array2d[wp.float32]  # [m]


@dataclass(frozen=True, eq=False, slots=True)
class SkylineMap:
    """The same on the host."""

    bucket_top: NDArray[np.float32]
    bucket_ground: NDArray[np.float32]
    block_top: NDArray[np.float32]

    def kernel(self, device: str) -> Skyline:
        """The skyline as kernels read it."""
        skyline = Skyline()
        skyline.bucket_top = wp.array(self.bucket_top, dtype=wp.float32, device=device)
        skyline.bucket_ground = wp.array(self.bucket_ground, dtype=wp.float32, device=device)
        skyline.block_top = wp.array(self.block_top, dtype=wp.float32, device=device)
        return skyline


def make_skyline(world: WorldMap) -> SkylineMap:
    """The tops of a world's buckets and blocks."""
    buckets = int(world.kernel.forest.buckets)
    ground = _highest_ground(world, buckets)
    top = ground.copy()
    trees = world.trees
    scale = buckets / world.terrain.size_m
    reach = trees["crown_radius"]
    tree_top = trees["crown_high"] + trees["crown_radius"]
    low = [_cell(trees[axis] - reach, world.terrain.size_m, scale, buckets) for axis in ("north", "east")]
    high = [_cell(trees[axis] + reach, world.terrain.size_m, scale, buckets) for axis in ("north", "east")]
    for row in (low[0], high[0]):
        for column in (low[1], high[1]):
            np.maximum.at(top, (row, column), tree_top)  # a crown is narrower than a bucket: its corners tell
    side = int(BLOCK_BUCKETS)
    blocks = -(-buckets // side)
    padded = np.full((blocks * side, blocks * side), -np.inf, np.float32)
    padded[:buckets, :buckets] = top
    block_top = padded.reshape(blocks, side, blocks, side).max(axis=(1, 3))
    return SkylineMap(top, ground, np.ascontiguousarray(block_top))


def _highest_ground(world: WorldMap, buckets: int) -> NDArray[np.float32]:
    """The highest terrain grid point of any cell that touches each bucket [m]."""
    heights, cells = world.heights, world.terrain.cells
    cell_top = np.maximum.reduce([heights[:-1, :-1], heights[1:, :-1], heights[:-1, 1:], heights[1:, 1:]])
    first = np.arange(buckets) * cells // buckets
    last = np.minimum(-(-(np.arange(buckets) + 1) * cells // buckets), cells)
    rows = np.stack([cell_top[a:b].max(axis=0) for a, b in zip(first, last, strict=True)])
    columns = [rows[:, a:b].max(axis=1) for a, b in zip(first, last, strict=True)]
    return np.ascontiguousarray(np.stack(columns, axis=1), dtype=np.float32)


def _cell(coordinate: NDArray[np.float32], size_m: float, scale: float, buckets: int) -> NDArray[np.int64]:
    return np.clip(np.floor((coordinate + 0.5 * size_m) * scale), 0, buckets - 1).astype(np.int64)
