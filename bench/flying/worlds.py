"""How long does a fresh world for an episode take, one core?

One world of a batch is grown anew at a time, as at the end of an episode: as they are for FollowMe, with six times as
many trees, and on a grid twice as fine; then all worlds of the batch at once. And what flying over a mesh of 100 k
triangles costs, over what it costs over a plain: vehicles fall past it, from 6 m above to 1 m above.
"""

import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import trimesh
import warp as wp

from bench.row import Row, best_of, require
from common.airframe import load_airframe
from common.geodesy import DEFAULT_HOME
from policies.tasks.follow_me.world import FOLLOW_WORLD
from sim.rig import Rig
from sim.sensors.sensors import sensor_model
from sim.wind import wind_model
from sim.world.batch import WorldBatch
from sim.world.custom.world_file import MeshSolid, WorldFile
from sim.world.world import WorldConfig, WorldMap, build_world

WORLDS = 64
TIMES = 5
MESH_CELLS = 224  # per side: 100,352 triangles
VEHICLES, FALL_TICKS = 16, 250
COMMAND = "python -m bench worlds"


def measure() -> list[Row]:
    name = "fresh world of 256 m"
    dense = FOLLOW_WORLD.model_copy(update={"trees_per_ha": 600.0})
    fine = FOLLOW_WORLD.model_copy(update={"cell_m": 2.0})
    return [
        Row(f"{name}, 100 trees/ha, 65 x 65 heights", _one_ms(FOLLOW_WORLD), "ms", "lower", 2.0, COMMAND),
        Row(f"{name}, 600 trees/ha, 65 x 65 heights", _one_ms(dense), "ms", "lower", None, COMMAND),
        Row(f"{name}, 100 trees/ha, 129 x 129 heights", _one_ms(fine), "ms", "lower", None, COMMAND),
        Row(f"{name}, {WORLDS} at once: each", _each_ms(FOLLOW_WORLD), "ms", "lower", 2.0, COMMAND),
        Row(
            "flight over a mesh of 100,352 triangles, over that over a plain", _mesh_ratio(), "x", "lower", 2.0, COMMAND
        ),
    ]


def _mesh_ratio() -> float:
    """CPU time of the whole loop, sensors and estimator included."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "sheet.stl"
        side = np.linspace(-40.0, 40.0, MESH_CELLS + 1)
        north, west = np.meshgrid(side, side, indexing="ij")
        up = 0.5 + 0.5 * np.sin(0.3 * north) * np.cos(0.2 * west)
        corner = (np.arange(MESH_CELLS)[:, None] * (MESH_CELLS + 1) + np.arange(MESH_CELLS)).ravel()
        row = MESH_CELLS + 1
        faces = [
            np.stack([corner, corner + row, corner + row + 1], 1),
            np.stack([corner, corner + row + 1, corner + 1], 1),
        ]
        trimesh.Trimesh(np.stack([north, west, up], -1).reshape(-1, 3), np.concatenate(faces)).export(file)
        worlds = [build_world(WorldFile(meshes=meshes)) for meshes in ((), (MeshSolid(file=file, thin=True),))]
    require(len(worlds[1].solids.faces) == 2 * MESH_CELLS**2, "the mesh has other triangles")
    rigs = [_flying(world) for world in worlds]
    ratios = []
    for _ in range(TIMES):
        plain, over_mesh = (_fall_s(rig) for rig in rigs)
        ratios.append(over_mesh / plain)
    return float(np.median(ratios))


def _flying(world: WorldMap) -> Rig:
    sensors, wind = sensor_model(home=DEFAULT_HOME), wind_model(3.0, 0.0, 1.0, 1.0)
    rig = Rig(load_airframe("x500"), world, sensors, wind, home=DEFAULT_HOME, vehicle_count=VEHICLES)
    rig.prepare(FALL_TICKS)
    return rig


def _fall_s(rig: Rig) -> float:
    """CPU time of a second's fall, ten times."""
    bodies = rig.arrays.body.numpy()
    start = time.process_time()
    for _ in range(10):
        bodies["pos_ned"] = (3.0, 4.0, -7.0)
        bodies["vel_ned"] = 0.0
        rig.advance(FALL_TICKS)
    spent = time.process_time() - start
    require(bool((bodies["is_crashed"] == 0).all()), "a vehicle has struck the mesh")
    return spent


def _one_ms(config: WorldConfig) -> float:
    """Of one world at a time, the mean over a batch."""
    batch = _grown(config)
    is_chosen, seeds = wp.zeros(WORLDS, dtype=wp.bool), wp.zeros(WORLDS, dtype=wp.int32)

    def cpu_ms() -> float:
        start = time.process_time()
        for i_world in range(WORLDS):
            is_chosen.numpy()[:] = np.arange(WORLDS) == i_world
            seeds.numpy()[i_world] += 1
            batch.grow(is_chosen, seeds)
        return 1e3 * (time.process_time() - start) / WORLDS

    return best_of(TIMES, cpu_ms)


def _each_ms(config: WorldConfig) -> float:
    batch = _grown(config)

    def cpu_ms() -> float:
        start = time.process_time()
        batch.grow_all(1)
        return 1e3 * (time.process_time() - start) / WORLDS

    return best_of(TIMES, cpu_ms)


def _grown(config: WorldConfig) -> WorldBatch:
    """A batch with as many trees and hills as asked."""
    batch = WorldBatch(config, WORLDS)
    batch.grow_all(1)
    counts = batch.kernels.numpy()["forest"]["tree_count"]
    hectares = (config.size_m / 100.0) ** 2
    require(0.8 < counts.mean() / hectares / config.trees_per_ha < 1.1, f"{counts.mean():.0f} trees")
    world = batch.map(0)
    require(world.height(0.0, 0.0) == 0.0, "home is not level")
    highest = float(np.abs(world.heights).max())
    require(0.5 * config.hill_height_m < highest <= config.hill_height_m, f"hills of {highest:.1f} m")
    return batch
