"""Many worlds, each grown from its own seed and regrown in kernels whenever an episode wants a fresh one.

In: a `WorldConfig`, and per world a seed and `WorldParams` that a task may rewrite before it grows a world. Out: the
`World` rows that kernels read, and a `WorldMap` of any of them for the host. The size of the map, its grid and the
octaves are the same for all, and so is the ground if a heightmap is given. These worlds have the character of
`build_world`'s, not its bytes.
"""

from math import ceil, sqrt
from typing import Any

import numpy as np
import warp as wp

from common.warp_start import start_warp
from sim.world.boxes import Box, Boxes, BoxesMap
from sim.world.building import build, most_boxes
from sim.world.custom.heightmap import heightmap_terrain
from sim.world.custom.solid_parts import SolidPart, solid_parts
from sim.world.custom.solids import SolidsMap
from sim.world.custom.world_file import WorldFile
from sim.world.growing import (
    COVERAGE,
    EMPTY_M,
    PHASES,
    ROUNDS,
    Grid,
    Growing,
    WorldParams,
    choose,
    plant,
    settle,
)
from sim.world.hills import find_highest, keep_ground, raise_noise, shape_hills
from sim.world.terrain import Terrain, TerrainMap
from sim.world.trees import (
    BUCKET_M,
    CONTACT_MARGIN_M,
    CROWN_RADIUS_FRACTION,
    EDGE_M,
    NO_OBSTACLE_M,
    Forest,
    ForestMap,
    Tree,
)
from sim.world.walls import WallsMap
from sim.world.world import World, WorldConfig, WorldMap, edge_max_m

wp.set_module_options({"enable_backward": False})

_PACKING = 0.75  # points per spacing² that there is room for; darts come to 0.70 at most (Wei 2008)
_SPARE_TREES = 32  # along the edges of a small map there are more
_GROUPS = 256  # worlds grown side by side on a GPU
_FIELDS = tuple(WorldParams.cls.__annotations__)  # type: ignore[attr-defined]


class WorldBatch:
    """Worlds of one size, grown in kernels; level and empty until they are.

    There is room for the configuration's trees and boxes at their greatest. A world whose numbers ask for more or
    higher trees or for more boxes than the limits gets the limit; no array is ever overrun.

    Args:
        config: size, grid, octaves and heightmap of all worlds, and the numbers each begins with; its seed is not used.
        count: how many worlds.
        device: a Warp device.
        trees_per_ha_max: highest density that a world's numbers may ask for, None: the configuration's.
        tree_height_limit_m: highest tree that they may ask for [m], None: the configuration's.

    Raises:
        WorldError: a file that a `WorldFile` names cannot be used.
    """

    def __init__(
        self,
        config: WorldConfig,
        count: int,
        device: str = "cpu",
        *,
        trees_per_ha_max: float | None = None,
        tree_height_limit_m: float | None = None,
    ) -> None:
        start_warp()
        self._ground = _ground_of(config)
        if self._ground is not None:
            size_m = self._ground.size_m
            config = config.model_copy(update={"size_m": size_m, "cell_m": size_m / self._ground.cells})
        self.config = config
        self.count = count
        self.device = device
        growing = Growing()
        growing.octaves = config.octaves
        growing.trees_per_ha_max = config.trees_per_ha if trees_per_ha_max is None else trees_per_ha_max
        growing.tree_height_limit_m = config.tree_height_max_m if tree_height_limit_m is None else tree_height_limit_m
        self._growing = growing
        self.solids = SolidsMap(_parts(config, self._ground))
        self._make_worlds()
        self._make_scratch()
        self._commands: list[Any] = []

    @property
    def kernels(self) -> Any:
        """The worlds as kernels read them: an array of `World`, shape (count,)."""
        return self._growing.worlds

    @property
    def params(self) -> Any:
        """What each world is grown from the next time: an array of `WorldParams`, shape (count,)."""
        return self._growing.params

    def grow(self, is_chosen: Any, seeds: Any) -> None:
        """Grows the chosen worlds anew from their numbers; the others keep every byte.

        Args:
            is_chosen: which, array of bool on the device, shape (count,).
            seeds: of the chosen, array of int32 on the device, shape (count,); same seed and numbers, same bytes.
        """
        if not self._commands:
            self._commands = self._record()
        growing = self._growing
        growing.chosen_count.zero_()
        wp.launch(choose, self.count, inputs=[growing, is_chosen, seeds], device=self.device)
        if growing.chosen_count.device.is_cpu and growing.chosen_count.numpy()[0] == 0:
            return  # a GPU would have to be waited for
        for command in self._commands:
            command.launch()

    def grow_all(self, first_seed: int) -> None:
        """Grows every world, world i from `first_seed` + i."""
        is_chosen = wp.full(self.count, value=True, dtype=wp.bool, device=self.device)
        seeds = (np.arange(self.count, dtype=np.int64) + first_seed).astype(np.uint32).view(np.int32)
        self.grow(is_chosen, wp.array(seeds, dtype=wp.int32, device=self.device))

    def map(self, i_world: int) -> WorldMap:
        """A copy of one world as it is now, for the host and for flights; growing it anew leaves the copy alone."""
        growing = self._growing
        size_m = self.config.size_m
        row = growing.params.numpy()[i_world]
        params = {name: row[name].item() for name in _FIELDS} | {"has_walls": bool(row["has_walls"])}
        seed = int(growing.seeds.numpy()[i_world]) % 2**32
        world = growing.worlds.numpy()[i_world]
        heights = self._heights[i_world if self._ground is None else 0].numpy().copy()
        heights.setflags(write=False)
        terrain = TerrainMap(heights, size_m)
        forest = ForestMap(self._trees[i_world].numpy()[: int(world["forest"]["tree_count"])].copy(), size_m)
        walls = WallsMap(bool(world["walls"]["is_built"]), 0.5 * size_m, float(world["walls"]["top_m"]))
        boxes = BoxesMap(self._boxes[i_world].numpy()[: int(world["boxes"]["box_count"])].copy())
        kernel = World()
        kernel.terrain = terrain.kernel(self.device)
        kernel.forest = forest.kernel(self.device)
        kernel.walls = walls.kernel()
        kernel.boxes = boxes.kernel(self.device)
        kernel.solids = self.solids.kernel(self.device)
        config = self.config.model_copy(update=params | {"seed": seed})
        return WorldMap(config, terrain, forest, walls, kernel, boxes, self.solids)

    def _make_worlds(self) -> None:
        """The `World` rows, whose arrays are slices of stores for all worlds."""
        config, growing = self.config, self._growing
        cells = max(2, round(config.size_m / config.cell_m))
        buckets = max(1, ceil(config.size_m / BUCKET_M))
        most_trees, most_entries = _room(config.size_m, growing.trees_per_ha_max, growing.tree_height_limit_m)
        if self._ground is None:
            self._heights = self._zeros((self.count, cells + 1, cells + 1), wp.float32)
        else:  # one for all
            self._heights = wp.array(self._ground.heights[None], dtype=wp.float32, device=self.device)
        self._trees = self._zeros((self.count, most_trees), Tree)
        self._bucket_start = self._zeros((self.count, buckets * buckets + 1), wp.int32)
        self._bucket_trees = self._zeros((self.count, most_entries), wp.int32)
        most = most_boxes(config.wall_count, config.mover_count, config.spot_count)
        self._has_boxes = most > 0
        self._boxes = self._zeros((self.count, max(most, 1)), Box)
        walls = WallsMap(is_built=False, half_size_m=0.5 * config.size_m, top_m=0.0).kernel()
        worlds = []
        for i_world in range(self.count):
            terrain = Terrain()
            terrain.heights = self._heights[i_world if self._ground is None else 0]
            terrain.cells = cells
            terrain.cells_per_m = cells / config.size_m
            terrain.half_size_m = 0.5 * config.size_m
            forest = Forest()
            forest.trees = self._trees[i_world]
            forest.bucket_start = self._bucket_start[i_world]
            forest.bucket_trees = self._bucket_trees[i_world]
            forest.buckets = buckets
            forest.buckets_per_m = buckets / config.size_m
            forest.half_size_m = 0.5 * config.size_m
            forest.top_m = NO_OBSTACLE_M
            boxes = Boxes()
            boxes.boxes = self._boxes[i_world]
            boxes.top_m = NO_OBSTACLE_M
            world = World()
            world.terrain, world.forest, world.walls, world.boxes = terrain, forest, walls, boxes
            world.solids = self.solids.kernel(self.device)
            worlds.append(world)
        growing.worlds = wp.array(worlds, dtype=World, device=self.device)

    def _make_scratch(self) -> None:
        config, growing, count = self.config, self._growing, self.count
        params = WorldParams()
        for name in _FIELDS:
            setattr(params, name, getattr(config, name))
        growing.params = wp.array([params] * count, dtype=WorldParams, device=self.device)
        growing.seeds = self._zeros(count, wp.int32)
        growing.chosen = self._zeros(count, wp.int32)
        growing.chosen_count = self._zeros(1, wp.int32)
        growing.grids = self._zeros(count, Grid)
        growing.middle = self._zeros(count, wp.float32)
        growing.highest = self._zeros(count, wp.float32)
        growing.ground_max_m = self._zeros(count, wp.float32)
        growing.edge_max_m = self._zeros(count, wp.float32)
        side_m = max(0.0, config.size_m - 2.0 * EDGE_M)
        # one more: in float32 the quotient may round up
        growing.most_cells = ceil(side_m * sqrt(2.0) / _spacing_m(growing.trees_per_ha_max)) + 1
        empty = wp.vec2(EMPTY_M, EMPTY_M)
        growing.points = wp.full((count, growing.most_cells**2), empty, dtype=wp.vec2, device=self.device)

    def _record(self) -> list[Any]:
        """The launches that grow the chosen worlds, in order."""
        growing = self._growing
        groups = 1 if growing.seeds.device.is_cpu else min(self.count, _GROUPS)
        rows = self._heights.shape[1]
        positions = ceil(growing.most_cells / 3)
        launches: list[tuple[Any, tuple[int, ...], list[Any]]]
        if self._ground is None:
            launches = [(kernel, (groups, rows), []) for kernel in (raise_noise, find_highest, shape_hills)]
        else:
            launches = [(keep_ground, (groups,), [float(self._ground.heights.max()), edge_max_m(self._ground)])]
        launches += [(plant, (groups, positions, positions), [visit]) for visit in range(ROUNDS * PHASES)]
        launches.append((settle, (groups,), []))
        if self._has_boxes:
            launches.append((build, (groups,), []))
        return [
            wp.launch(kernel, dim, inputs=[growing, groups, *more], device=self.device, record_cmd=True)
            for kernel, dim, more in launches
        ]

    def _zeros(self, shape: Any, dtype: Any) -> Any:
        return wp.zeros(shape, dtype=dtype, device=self.device)


def grown_world(config: WorldConfig, seed: int, device: str = "cpu") -> WorldMap:
    """The world that a batch of this configuration grows from a seed, for a single flight in it."""
    batch = WorldBatch(config, 1, device)
    batch.grow_all(seed)
    return batch.map(0)


def _ground_of(config: WorldConfig) -> TerrainMap | None:
    """The ground of a heightmap; None: it is grown."""
    if not isinstance(config, WorldFile) or config.heightmap is None:
        return None
    return heightmap_terrain(config.heightmap)


def _parts(config: WorldConfig, ground: TerrainMap | None) -> tuple[SolidPart, ...]:
    """What stands in every world of a batch; positions without a height are on the home plane where ground is grown."""
    if not isinstance(config, WorldFile):
        return ()
    return solid_parts(config, ground or TerrainMap(np.zeros((3, 3), np.float32), config.size_m))


def _spacing_m(trees_per_ha: float) -> float:
    """Smallest distance between trees of a density [m], infinite without any."""
    return sqrt(COVERAGE * 1.0e4 / trees_per_ha) if trees_per_ha > 0.0 else float("inf")


def _room(size_m: float, trees_per_ha: float, tree_height_m: float) -> tuple[int, int]:
    """How many trees and how many entries of buckets one world has room for."""
    side_m = max(0.0, size_m - 2.0 * EDGE_M)
    trees = ceil(_PACKING * (side_m / _spacing_m(trees_per_ha)) ** 2) + _SPARE_TREES
    reach_m = CROWN_RADIUS_FRACTION[1] * tree_height_m + CONTACT_MARGIN_M
    # the mean over the places a tree can have
    entries_per_tree = (2.0 * reach_m / BUCKET_M + 1.0) ** 2
    return trees, ceil(trees * entries_per_tree)
