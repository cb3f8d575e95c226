"""The sectors round a vehicle against rays through the same worlds."""

from typing import Any

import numpy as np
import warp as wp

from policies.tasks.flight.hover_bank import build_rig
from policies.tasks.flight.ranges import RANGE_M, RANGES, SECTORS, measure_ranges
from sim.world.batch import WorldBatch
from sim.world.world import WorldConfig

COUNT = 12
CONFIG = WorldConfig(size_m=128.0, hill_height_m=6.0, hill_wavelength_m=60.0, trees_per_ha=250.0, has_walls=True)


def _measured() -> tuple[Any, Any, Any]:
    """Vehicles anywhere between the trees, heading anywhere."""
    worlds = WorldBatch(CONFIG, COUNT)
    worlds.grow_all(3)
    rig = build_rig(worlds, COUNT, has_estimator=False, threads=1, device="cpu")
    rng = np.random.default_rng(0)
    body = rig.rows["truth"]
    yaw = rng.uniform(-np.pi, np.pi, COUNT)
    body["q_ned_from_frd"] = np.stack([0 * yaw, 0 * yaw, np.sin(0.5 * yaw), np.cos(0.5 * yaw)], axis=1)
    for i in range(COUNT):
        north, east = rng.uniform(-50.0, 50.0, 2)
        body["pos_ned"][i] = (north, east, -float(worlds.map(i).height(north, east)) - 1.5)
    out = wp.zeros((COUNT, RANGES), dtype=float)
    rows = wp.full(COUNT, value=True, dtype=wp.bool)
    wp.launch(measure_ranges, COUNT, [rig.arrays, rows, out])
    return worlds, body, (yaw, out.numpy())


def test_no_ray_of_a_sector_meets_a_trunk_nearer_than_the_sector_tells() -> None:
    worlds, body, (yaw, out) = _measured()
    range_m = float(RANGE_M)
    hits = 0
    for i in range(COUNT):
        forest = worlds.map(i).forest
        pos = body["pos_ned"][i].astype(np.float64)
        for degree in range(360):
            bearing = yaw[i] + np.radians(degree)
            along = np.array([np.cos(bearing), np.sin(bearing), 0.0])
            near = 1.0 - forest.ray_hit(pos, along, range_m) / range_m
            hits += near > 0.0
            assert out[i, round(degree / 15.0) % SECTORS] >= near - 1e-3
    assert hits > 100


def test_nearest_tree_is_pointed_at() -> None:
    worlds, body, (yaw, out) = _measured()
    for i in range(COUNT):
        trees = worlds.map(i).trees
        offset = np.stack([trees["north"], trees["east"]], axis=1) - body["pos_ned"][i, :2]
        near = float(np.hypot(*out[i, SECTORS + 2 :]))
        assert near <= out[i, :SECTORS].max() + 1e-5
        if near > 0.0:
            bearing = yaw[i] + np.arctan2(out[i, SECTORS + 3], out[i, SECTORS + 2])
            towards = np.array([np.cos(bearing), np.sin(bearing)])
            assert (offset @ towards / np.linalg.norm(offset, axis=1)).max() > 0.999


def test_height_above_ground_is_the_nearness_below() -> None:
    _, _, (_, out) = _measured()
    np.testing.assert_allclose(out[:, SECTORS + 1], 1.0 - 1.5 / float(RANGE_M), atol=1e-3)
