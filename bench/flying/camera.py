"""How many images a second does the fast camera take on one core, of any poses, of the worst, and beside Bullet?

RGB, depth and classes of 64 x 64 pixels over hills with 200 trees and walls. Times are those of the thread's own work,
the best of several, so that others on the machine do not count.
"""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pybullet
from numpy.typing import NDArray

from bench.row import Row, best_of, require
from sim.sensors.fast_camera.fast_camera import QuickCamera
from sim.sensors.ray import SKY
from sim.world.batch import WorldBatch
from sim.world.world import WorldConfig, WorldMap, build_world

PICTURES = 64
ROUNDS = 12
COPIES = 16  # of a single pose: a batch as training has it
WORLDS = 8
COMMAND = "python -m bench camera"
WORLD = WorldConfig(
    size_m=256.0, hill_height_m=8.0, hill_wavelength_m=120.0, clearing_blend_m=60.0, trees_per_ha=31.0, has_walls=True
)
TREES = 200
PITCHES_DEG = (-90.0, -60.0, -45.0, -30.0, -10.0, 0.0, 60.0)
HEIGHTS_M = (0.2, 2.0, 5.0, 10.0, 30.0)


def measure() -> list[Row]:
    world = build_world(WORLD)
    require(abs(len(world.trees) - TREES) <= 10, f"the world has {len(world.trees)} trees")
    poses = mixed_poses(world)
    camera = QuickCamera(world, PICTURES)
    camera.lenses.numpy()[["pos_ned", "q_ned_from_rdf"]] = poses
    mixed = PICTURES / _seconds(camera.render)
    require((camera.kind.numpy() != SKY).any(), "the pictures are empty")
    alone = QuickCamera(world, 1)
    alone.lenses.numpy()[:] = camera.lenses.numpy()[0]
    batch = WorldBatch(WORLD, WORLDS)
    batch.grow_all(1)
    many = QuickCamera(batch, WORLDS)
    return [
        Row("fast camera 64 x 64, mixed poses", mixed, "pictures/s", "higher", 4000.0, COMMAND),
        Row("fast camera 64 x 64, worst single pose", _worst(world, poses), "pictures/s", "higher", 2500.0, COMMAND),
        Row("fast camera 64 x 64, one at a time", 1.0 / _seconds(alone.render), "pictures/s", "higher", None, COMMAND),
        Row("fast camera over Bullet's CPU renderer", mixed / _bullet_rate(world, poses), "x", "higher", 10.0, COMMAND),
        Row("fast camera, a fresh world", 1e3 / WORLDS * _seconds(many.refresh), "ms", "lower", 2.0, COMMAND),
    ]


def _seconds(work: Callable[[], None], rounds: int = ROUNDS) -> float:
    """CPU time of the fastest of several rounds."""

    def once() -> float:
        start = time.thread_time()
        work()
        return time.thread_time() - start

    work()
    return best_of(rounds, once)


def mixed_poses(world: WorldMap) -> NDArray[Any]:
    """Places in the open, 1 to 8 m above the ground, with any attitude: fields as a lens has them."""
    rng = np.random.default_rng(3)
    poses = np.zeros(PICTURES, [("pos_ned", "<f4", 3), ("q_ned_from_rdf", "<f4", 4)])
    for pose in poses:
        while True:
            north, east = rng.uniform(-110.0, 110.0, 2)
            position = np.array([north, east, -float(world.height(north, east)) - rng.uniform(1.0, 8.0)])
            if world.obstacle_distance(position) > 0.1:
                break
        q = rng.normal(size=4)
        pose["pos_ned"], pose["q_ned_from_rdf"] = position, q / np.linalg.norm(q)
    return poses


def _worst(world: WorldMap, poses: NDArray[Any]) -> float:
    """Images a second of the slowest pose: of the mixed ones, and of level flight at many pitches and heights."""
    camera = QuickCamera(world, COPIES)
    lenses = camera.lenses.numpy()
    rates = []
    for pose in [*poses, *_level_poses(world)]:
        lenses["pos_ned"], lenses["q_ned_from_rdf"] = pose["pos_ned"], pose["q_ned_from_rdf"]
        rates.append(COPIES / _seconds(camera.render))
    return min(rates)


def _level_poses(world: WorldMap) -> NDArray[Any]:
    positions = [(0.0, 0.0), (70.0, -60.0), (110.0, 110.0)]
    poses = np.zeros(len(positions) * len(PITCHES_DEG) * len(HEIGHTS_M), mixed_poses(world).dtype)
    k = 0
    for north, east in positions:
        for height in HEIGHTS_M:
            for pitch in PITCHES_DEG:
                half = np.radians(pitch + 90.0) / 2.0  # from straight down, the image's upper edge to the north
                poses[k]["pos_ned"] = (north, east, -float(world.height(north, east)) - height)
                poses[k]["q_ned_from_rdf"] = (
                    0.5**0.5 * np.sin(half), 0.5**0.5 * np.sin(half), 0.5**0.5 * np.cos(half), 0.5**0.5 * np.cos(half)
                )  # fmt: skip
                k += 1
    return poses


def _bullet_rate(world: WorldMap, poses: NDArray[Any]) -> float:
    """Images a second of Bullet's CPU renderer over the same ground and trees, from the same poses."""
    client = pybullet.connect(pybullet.DIRECT)
    try:
        _fill(client, world)
        projection = pybullet.computeProjectionMatrixFOV(90.0, 1.0, 0.1, 80.0)
        views = [_bullet_view(pose) for pose in poses]

        def all_pictures() -> None:
            for view in views:
                pybullet.getCameraImage(
                    64, 64, view, projection, renderer=pybullet.ER_TINY_RENDERER, physicsClientId=client
                )

        return len(poses) / _seconds(all_pictures, 3)
    finally:
        pybullet.disconnect(client)


def _fill(client: int, world: WorldMap) -> None:
    """The ground and the trees in Bullet's frame: x north, y west, z up."""
    heights = world.heights
    rows, columns = heights.shape
    shape = pybullet.createCollisionShape(
        pybullet.GEOM_HEIGHTFIELD, meshScale=[WORLD.cell_m, WORLD.cell_m, 1.0], numHeightfieldRows=rows,
        heightfieldData=heights.T[::-1].ravel().tolist(), numHeightfieldColumns=columns, physicsClientId=client,
    )  # fmt: skip
    middle = 0.5 * float(heights.max() + heights.min())
    pybullet.createMultiBody(0, shape, basePosition=[0.0, 0.0, middle], physicsClientId=client)
    for tree in world.trees:
        north, west = float(tree["north"]), -float(tree["east"])
        low, high = float(tree["crown_low"]), float(tree["crown_high"])
        root, radius = float(tree["root_height"]), float(tree["crown_radius"])
        trunk = pybullet.createVisualShape(
            pybullet.GEOM_CYLINDER, radius=float(tree["trunk_radius"]), length=low - root, physicsClientId=client
        )
        crown = pybullet.createVisualShape(
            pybullet.GEOM_CAPSULE, radius=radius, length=high - low, physicsClientId=client
        )
        for visual, up in ((trunk, 0.5 * (root + low)), (crown, 0.5 * (low + high))):
            pybullet.createMultiBody(0, -1, visual, [north, west, up], physicsClientId=client)


def _bullet_view(pose: NDArray[Any]) -> list[float]:
    """View matrix of a pose."""
    rotation = pybullet.getMatrixFromQuaternion([float(value) for value in pose["q_ned_from_rdf"]])
    axes = np.reshape(rotation, (3, 3)) * np.array([[1.0], [-1.0], [-1.0]])  # columns: right, down, ahead
    eye = np.array(pose["pos_ned"], float) * (1.0, -1.0, -1.0)
    view: list[float] = pybullet.computeViewMatrix(eye.tolist(), (eye + axes[:, 2]).tolist(), (-axes[:, 1]).tolist())
    return view
