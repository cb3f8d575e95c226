"""The world a vehicle is in: terrain, trees, walls and boxes, asked together.

In: a `WorldConfig` with a seed. Out: a `WorldMap` with float64 queries for the host, and its `kernel`, the `World`
struct that every kernel gets. Body contact asks at 1 kHz, sensors at their own rates, summaries once per flight.
World frame ned with its origin at home; ground heights are metres up from the home plane: the ground is at d = -height.
"""

from dataclasses import dataclass, field, replace

import numpy as np
import warp as wp
from numpy.typing import ArrayLike, NDArray

from common.warp_start import start_warp
from sim.world.boxes import Boxes, BoxesMap, boxes_contact, boxes_ray_hit, no_boxes
from sim.world.custom.heightmap import heightmap_terrain
from sim.world.custom.solid_parts import solid_parts
from sim.world.custom.solids import Solids, SolidsMap, solids_contact, solids_height, solids_ray_hit
from sim.world.custom.world_file import WorldFile
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
from sim.world.world_config import WorldConfig

wp.set_module_options({"enable_backward": False})

__all__ = [
    "World", "WorldConfig", "WorldMap", "build_world", "ground_height", "ground_normal_ned", "obstacle_contact",
    "ray_hit", "shared_world", "surface_height", "top_surface", "world_at",
]  # fmt: skip


@wp.struct
class World:
    """Everything solid, as kernels read it; the same for all vehicles of a batch."""

    terrain: Terrain
    forest: Forest
    walls: Walls
    boxes: Boxes
    neighbours: Neighbours  # other vehicles; as many for each vehicle as it is not alone
    solids: Solids  # of a world file


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
def surface_height(w: World, pos_ned: wp.vec3) -> float:
    """Height above the home plane [m] of what is straight below a point: a roof, or the ground, wherever the point."""
    height = ground_height(w, pos_ned[0], pos_ned[1])
    if w.solids.count > 0:
        height = wp.max(height, solids_height(w.solids, pos_ned))
    return height


@wp.func
def top_surface(w: World, north: float, east: float) -> float:
    """Height above the home plane [m] of the highest that a vehicle can be put on: a roof, or the ground."""
    if w.solids.count == 0:
        return ground_height(w, north, east)
    above_m = wp.max(w.solids.top_m, w.terrain.ground_max_m) + 1.0
    return surface_height(w, wp.vec3(north, east, -above_m))


@wp.func
def ray_hit(w: World, origin_ned: wp.vec3, dir_ned: wp.vec3, max_m: float) -> float:
    """Distance [m] along a ray to the first ground, trunk, crown, wall, box, solid or other vehicle; `max_m` if none.

    From inside one it is 0, but for solids, which are surfaces.

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
    if w.solids.count > 0:
        box = solids_ray_hit(w.solids, origin_ned, dir_ned, box)
    return neighbours_ray_hit(w.neighbours, w.boxes.tick, origin_ned, dir_ned, box)


@wp.func
def obstacle_contact(w: World, pos_ned: wp.vec3, radius: float) -> wp.vec4:
    """Deepest contact of a sphere with a trunk, crown, wall, box, solid or other vehicle.

    The ground is no obstacle, nor are the floors of solids.

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
    if w.solids.count > 0:
        solid = solids_contact(w.solids, pos_ned, radius)
        if solid[3] > contact[3]:
            contact = solid
    return contact


@dataclass(frozen=True, eq=False, slots=True)
class WorldMap:
    """A world on the host, and the struct that kernels read."""

    config: WorldConfig
    terrain: TerrainMap
    forest: ForestMap
    walls: WallsMap
    kernel: World
    boxes: BoxesMap = field(default_factory=lambda: BoxesMap(no_boxes()))
    solids: SolidsMap = field(default_factory=SolidsMap)

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

    def surface(self, north: ArrayLike, east: ArrayLike) -> FloatArray:
        """Height above the home plane [m] of the highest that one can stand on: ground or a solid."""
        return np.maximum(self.height(north, east), self.solids.height(np.asarray(north), np.asarray(east)))

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
        return self.solids.ray_hit(origin, direction, self.boxes.ray_hit(origin, direction, wall, tick))

    def obstacle_distance(self, pos_ned: ArrayLike, tick: int = 0) -> FloatArray:
        """Distance [m] to the nearest trunk, crown, wall or box, negative inside, inf for none.

        Args:
            pos_ned: [m], shape (..., 3).
            tick: at which the movers are where they are then.
        """
        pos = np.asarray(pos_ned, np.float64)
        flat = pos.reshape(-1, 3)
        nearest = np.minimum(self.forest.distance(flat), self.walls.distance(flat))
        nearest = np.minimum(nearest, self.solids.distance(flat))
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
    for part in ("terrain", "forest", "walls", "boxes", "solids"):
        setattr(kernel, part, getattr(world.kernel, part))
    kernel.neighbours = neighbours
    return replace(world, kernel=kernel)


def build_world(config: WorldConfig | None = None, device: str = "cpu") -> WorldMap:
    """The world of a configuration, its kernel arrays on `device`.

    Raises:
        WorldError: a file that a `WorldFile` names cannot be used.
    """
    start_warp()
    config = config or WorldConfig()
    terrain = _terrain(config)
    if isinstance(config, WorldFile) and config.heightmap is not None:
        config = config.model_copy(update={"size_m": terrain.size_m, "cell_m": terrain.size_m / terrain.cells})
    trees = make_trees(
        config.seed,
        terrain,
        config.trees_per_ha,
        config.tree_height_min_m,
        config.tree_height_max_m,
        max(config.clearing_radius_m, config.treeless_radius_m),
    )
    forest = ForestMap(trees, terrain.size_m)
    walls = WallsMap(config.has_walls, 0.5 * terrain.size_m, edge_max_m(terrain) + config.wall_height_m)
    boxes = BoxesMap(no_boxes())
    solids = SolidsMap(solid_parts(config, terrain) if isinstance(config, WorldFile) else ())
    kernel = World()
    kernel.terrain = terrain.kernel(device)
    kernel.forest = forest.kernel(device)
    kernel.walls = walls.kernel()
    kernel.boxes = boxes.kernel(device)
    kernel.solids = solids.kernel(device)
    return WorldMap(config, terrain, forest, walls, kernel, boxes, solids)


def edge_max_m(terrain: TerrainMap) -> float:
    """Height of the highest ground at the edges of the map [m]."""
    heights = terrain.heights
    return float(np.concatenate([heights[0], heights[-1], heights[:, 0], heights[:, -1]]).max())


def _terrain(config: WorldConfig) -> TerrainMap:
    """The ground: as a heightmap has it, or grown."""
    if isinstance(config, WorldFile) and config.heightmap is not None:
        return heightmap_terrain(config.heightmap)
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
    return TerrainMap(heights, config.size_m)
