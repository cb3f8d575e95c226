"""The world a vehicle is in: terrain, trees, walls and boxes, asked together.

In: a `WorldConfig` with a seed. Out: a `WorldMap` with float64 queries for the host, and its `kernel`, the `World`
struct that every kernel gets. Body contact asks at 1 kHz, sensors at their own rates, summaries once per flight.
World frame ned with its origin at home; ground heights are metres up from the home plane: the ground is at d = -height.
"""

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
import warp as wp
from numpy.typing import ArrayLike, NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from common.warp_start import start_warp
from sim.world.boxes import Boxes, BoxesMap, boxes_contact, boxes_ray_hit, no_boxes
from sim.world.neighbours import Neighbours, neighbours_contact, neighbours_ray_hit
from sim.world.terrain import (
    FloatArray,
    Terrain,
    TerrainMap,
    make_heights,
    terrain_height,
    terrain_normal_ned,
    terrain_ray_hit,
)
from sim.world.trees import Forest, ForestMap, forest_contact, forest_ray_hit, make_trees
from sim.world.walls import Walls, WallsMap, walls_contact, walls_ray_hit

wp.set_module_options({"enable_backward": False})

MAX_CELLS = 1024  # per side: 4 MB of heights


@wp.struct
class World:
    """Everything solid, as kernels read it; the same for all vehicles of a batch."""

    terrain: Terrain
    forest: Forest
    walls: Walls
    boxes: Boxes
    neighbours: Neighbours  # other vehicles; as many for each vehicle as it is not alone


@wp.func
def world_at(w: World, tick: int) -> World:
    """A world with its movers where they are at a tick, as `common.rng.draw_tick` counts."""
    at_tick = w
    at_tick.boxes.tick = tick
    return at_tick


@wp.func
def ground_height(w: World, north: float, east: float) -> float:
    """Ground height above the home plane [m]; beyond the map that of its nearest edge."""
    return terrain_height(w.terrain, north, east)


@wp.func
def ground_normal_ned(w: World, north: float, east: float) -> wp.vec3:
    """Unit normal of the ground, pointing up (z < 0)."""
    return terrain_normal_ned(w.terrain, north, east)


@wp.func
def ray_hit(w: World, origin_ned: wp.vec3, dir_ned: wp.vec3, max_m: float) -> float:
    """Distance [m] along a ray to the first ground, trunk, crown, wall, box or other vehicle; `max_m` if none.

    From inside one it is 0.

    Args:
        w: the world.
        origin_ned: start of the ray [m].
        dir_ned: direction, unit.
        max_m: length of the ray [m].
    """
    ground = terrain_ray_hit(w.terrain, origin_ned, dir_ned, max_m)
    forest = forest_ray_hit(w.forest, origin_ned, dir_ned, ground)
    wall = walls_ray_hit(w.walls, origin_ned, dir_ned, forest)
    box = boxes_ray_hit(w.boxes, origin_ned, dir_ned, wall)
    return neighbours_ray_hit(w.neighbours, w.boxes.tick, origin_ned, dir_ned, box)


@wp.func
def obstacle_contact(w: World, pos_ned: wp.vec3, radius: float) -> wp.vec4:
    """Deepest contact of a sphere with a trunk, crown, wall, box or other vehicle; the ground is no obstacle.

    Args:
        w: the world.
        pos_ned: centre of the sphere [m].
        radius: of the sphere, at most `trees.CONTACT_MARGIN_M` [m].

    Returns:
        x, y, z: unit push-out normal in ned; w: penetration depth [m], > 0 when touching. All 0 for no contact.
    """
    contact = forest_contact(w.forest, pos_ned, radius)
    wall = walls_contact(w.walls, pos_ned, radius)
    if wall[3] > contact[3]:
        contact = wall
    box = boxes_contact(w.boxes, pos_ned, radius)
    if box[3] > contact[3]:
        contact = box
    neighbour = neighbours_contact(w.neighbours, w.boxes.tick, pos_ned, radius)
    if neighbour[3] > contact[3]:
        contact = neighbour
    return contact


class WorldConfig(BaseModel):
    """What a world is made from. The defaults keep every tree within 120 m of home below 15 m above the home plane."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    seed: int = Field(default=1, ge=0, le=2**32 - 1)
    """Seed of terrain and trees: same seed and settings, same bytes."""
    size_m: float = Field(default=1000.0, ge=50.0, le=10_000.0)
    """Side of the square map centred on home [m]."""
    cell_m: float = Field(default=4.0, ge=0.5, le=50.0)
    """Distance between grid points of the terrain [m], rounded so that the map holds whole cells."""
    hill_height_m: float = Field(default=12.0, ge=0.0, le=300.0)
    """Bound of the hills above and valleys below home [m]; 0 makes a plain."""
    hill_wavelength_m: float = Field(default=250.0, ge=20.0, le=5_000.0)
    """Wavelength of the broadest hills [m]."""
    octaves: int = Field(default=6, ge=1, le=8)
    """Layers of hills, each half the wavelength of the one before."""
    clearing_radius_m: float = Field(default=20.0, ge=0.0, le=1_000.0)
    """Radius round home that is exactly level and free of trees [m]."""
    clearing_blend_m: float = Field(default=230.0, ge=1.0, le=5_000.0)
    """Width of the ring round the clearing in which the hills grow to full height [m]."""
    trees_per_ha: float = Field(default=60.0, ge=0.0, le=1_000.0)
    """Trees per hectare outside the clearing; 0 plants none."""
    treeless_radius_m: float = Field(default=0.0, ge=0.0, le=1_000.0)
    """Radius round home that is free of trees, if it is more than the clearing's, hills or not [m]; not in worlds grown
    in batches."""
    tree_height_min_m: float = Field(default=5.0, ge=1.0, le=60.0)
    """Height of the lowest trees [m]."""
    tree_height_max_m: float = Field(default=10.0, ge=1.0, le=60.0)
    """Height of the highest trees [m]."""
    has_walls: bool = False
    """Whether walls stand along the edges of the map."""
    wall_height_m: float = Field(default=10.0, ge=1.0, le=200.0)
    """Height of the walls above the highest ground at the edges of the map [m]."""
    wall_count: int = Field(default=0, ge=0, le=100)
    """Free-standing walls, a fifth of them kerbs, scattered over the map; in worlds grown in batches alone."""
    mover_count: int = Field(default=0, ge=0, le=20)
    """Obstacles that run to and fro, in a car park along its aisle; in worlds grown in batches alone."""
    spot_count: int = Field(default=0, ge=0, le=20)
    """Spots in each of the two rows of a car park beside home, 0: none; in worlds grown in batches alone."""

    @property
    def has_boxes(self) -> bool:
        """Whether walls, movers or a car park stand in it: it is grown in a batch then."""
        return self.wall_count + self.mover_count + self.spot_count > 0

    @model_validator(mode="after")
    def _fits(self) -> Self:
        cells = self.size_m / self.cell_m
        if cells > MAX_CELLS:
            raise ValueError(f"size_m / cell_m makes {cells:.0f} cells per side, at most {MAX_CELLS} are allowed")
        if self.tree_height_min_m > self.tree_height_max_m:
            raise ValueError("tree_height_min_m is larger than tree_height_max_m")
        return self


@dataclass(frozen=True, eq=False, slots=True)
class WorldMap:
    """A world on the host, and the struct that kernels read."""

    config: WorldConfig
    terrain: TerrainMap
    forest: ForestMap
    walls: WallsMap
    kernel: World
    boxes: BoxesMap = field(default_factory=lambda: BoxesMap(no_boxes()))

    @property
    def heights(self) -> NDArray[np.float32]:
        """Terrain heights at the grid points [m], (cells + 1, cells + 1), rows to the north, columns to the east."""
        return self.terrain.heights

    @property
    def trees(self) -> NDArray[np.void]:
        """The trees: a structured array with the fields of `trees.Tree`, shape (trees,)."""
        return self.forest.trees

    def height(self, north: ArrayLike, east: ArrayLike) -> FloatArray:
        """Ground height above the home plane [m], shape of the broadcast arguments; beyond the map that of its edge."""
        return self.terrain.height(north, east)

    def normal_ned(self, north: ArrayLike, east: ArrayLike) -> FloatArray:
        """Unit normals of the ground pointing up (z < 0), shape (..., 3)."""
        return self.terrain.normal_ned(north, east)

    def ray_hit(self, origin_ned: ArrayLike, dir_ned: ArrayLike, max_m: float, tick: int = 0) -> float:
        """Distance [m] along a ray to the first ground, trunk, crown, wall or box; `max_m` if none, 0 from inside.

        Args:
            origin_ned: start of the ray [m], shape (3,).
            dir_ned: direction, unit, shape (3,).
            max_m: length of the ray [m].
            tick: at which the movers are where they are then.
        """
        origin, direction = np.asarray(origin_ned, np.float64), np.asarray(dir_ned, np.float64)
        ground = self.terrain.ray_hit(origin, direction, max_m)
        wall = self.walls.ray_hit(origin, direction, self.forest.ray_hit(origin, direction, ground))
        return self.boxes.ray_hit(origin, direction, wall, tick)

    def obstacle_distance(self, pos_ned: ArrayLike, tick: int = 0) -> FloatArray:
        """Distance [m] to the nearest trunk, crown, wall or box, negative inside, inf for none.

        Args:
            pos_ned: [m], shape (..., 3).
            tick: at which the movers are where they are then.
        """
        pos = np.asarray(pos_ned, np.float64)
        flat = pos.reshape(-1, 3)
        nearest = np.minimum(self.forest.distance(flat), self.walls.distance(flat))
        return np.minimum(nearest, self.boxes.distance(flat, tick)).reshape(pos.shape[:-1])

    def clearance(self, pos_ned: ArrayLike) -> FloatArray:
        """Distance [m] to the nearest trunk, crown, wall or ground; that to the ground is its height above ground.

        Args:
            pos_ned: [m], shape (..., 3).
        """
        pos = np.asarray(pos_ned, np.float64)
        return np.minimum(self.obstacle_distance(pos), -pos[..., 2] - self.height(pos[..., 0], pos[..., 1]))


def shared_world(world: WorldMap, neighbours: Neighbours) -> WorldMap:
    """The same world as one of several vehicles reads it: with the others in it."""
    kernel = World()
    for part in ("terrain", "forest", "walls", "boxes"):
        setattr(kernel, part, getattr(world.kernel, part))
    kernel.neighbours = neighbours
    return replace(world, kernel=kernel)


def build_world(config: WorldConfig | None = None, device: str = "cpu") -> WorldMap:
    """The world of a configuration, its kernel arrays on `device`."""
    start_warp()
    config = config or WorldConfig()
    cells = max(2, round(config.size_m / config.cell_m))
    heights = make_heights(
        config.seed,
        cells,
        config.size_m,
        config.hill_height_m,
        config.hill_wavelength_m,
        config.octaves,
        config.clearing_radius_m,
        config.clearing_blend_m,
    )
    terrain = TerrainMap(heights, config.size_m)
    trees = make_trees(
        config.seed,
        terrain,
        config.trees_per_ha,
        config.tree_height_min_m,
        config.tree_height_max_m,
        max(config.clearing_radius_m, config.treeless_radius_m),
    )
    forest = ForestMap(trees, config.size_m)
    edges = np.concatenate([heights[0], heights[-1], heights[:, 0], heights[:, -1]])
    walls = WallsMap(config.has_walls, 0.5 * config.size_m, float(edges.max()) + config.wall_height_m)
    kernel = World()
    kernel.terrain = terrain.kernel(device)
    kernel.forest = forest.kernel(device)
    kernel.walls = walls.kernel()
    kernel.boxes = BoxesMap(no_boxes()).kernel(device)
    return WorldMap(config, terrain, forest, walls, kernel)
