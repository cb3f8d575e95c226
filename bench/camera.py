"""How many pictures a second does the fast camera take on one core, of any poses, of the worst, and beside Bullet?"""

import time

import numpy as np
import pybullet

from bench.row import Row, require
from sim.sensors.quick_camera import QuickCamera
from sim.sensors.ray import SKY
from sim.world.world import WorldConfig, build_world

PICTURES = 64
ROUNDS = 12
COMMAND = "python -m bench camera"
# 200 trees on hills, walls round them
WORLD = WorldConfig(
    size_m=256.0, hill_height_m=8.0, hill_wavelength_m=120.0, clearing_blend_m=60.0, trees_per_ha=31.0, has_walls=True
)
PITCHES_DEG = (-90.0, -60.0, -45.0, -10.0, 60.0)  # level right axis


def measure() -> list[Row]:
    world = build_world(WORLD)
    camera, alone = QuickCamera(world, PICTURES), QuickCamera(world, 1)
    rng = np.random.default_rng(3)
    lenses = camera.lenses.numpy()
    north_east = rng.uniform(-110.0, 110.0, (PICTURES, 2))
    lenses["pos_ned"][:, :2] = north_east
    lenses["pos_ned"][:, 2] = -world.height(north_east[:, 0], north_east[:, 1]) - rng.uniform(1.0, 8.0, PICTURES)
    q = rng.normal(size=(PICTURES, 4))
    lenses["q_ned_from_rdf"] = q / np.linalg.norm(q, axis=1, keepdims=True)
    mixed = _rate(camera)
    require((camera.kind.numpy() != SKY).any(), "the pictures are empty")
    alone.lenses.numpy()[:] = lenses[:1]
    single = _rate(alone)
    rates = []
    for pitch in PITCHES_DEG:
        half = np.radians(pitch + 90.0) / 2.0  # from straight down, the picture's upper edge to the north
        lenses["q_ned_from_rdf"] = _product((0.0, np.sin(half), 0.0, np.cos(half)), (0.0, 0.0, 0.5**0.5, 0.5**0.5))
        rates.append(_rate(camera))
    bullet = _bullet_rate()
    return [
        Row("fast camera 64 x 64, any attitude", mixed, "pictures/s", "higher", 4000.0, COMMAND),
        Row("fast camera 64 x 64, worst pitch", min(rates), "pictures/s", "higher", 2500.0, COMMAND),
        Row("fast camera 64 x 64, one at a time", single, "pictures/s", "higher", None, COMMAND),
        Row("fast camera over Bullet's CPU renderer", mixed / bullet, "x", "higher", None, COMMAND),
    ]


def _rate(camera: QuickCamera) -> float:
    camera.render()
    best = np.inf
    for _ in range(ROUNDS):
        start = time.perf_counter()
        camera.render()
        best = min(best, time.perf_counter() - start)
    return float(len(camera.lenses) / best)


def _product(a: tuple[float, ...], b: tuple[float, ...]) -> tuple[float, ...]:
    x, y, z, w = a
    i, j, k, m = b
    return (
        w * i + x * m + y * k - z * j,
        w * j - x * k + y * m + z * i,
        w * k + x * j - y * i + z * m,
        w * m - x * i - y * j - z * k,
    )


def _bullet_rate() -> float:
    """Pictures a second of Bullet's CPU renderer: as many cells of ground, 200 trees of a cylinder and a ball."""
    client = pybullet.connect(pybullet.DIRECT)
    try:
        heights = np.random.default_rng(1).uniform(0.0, 0.5, 65 * 65)
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_HEIGHTFIELD, meshScale=[4.0, 4.0, 1.0], heightfieldData=heights, numHeightfieldRows=65,
            numHeightfieldColumns=65, physicsClientId=client,
        )  # fmt: skip
        pybullet.createMultiBody(0, shape, physicsClientId=client)
        trunk = pybullet.createVisualShape(pybullet.GEOM_CYLINDER, radius=0.15, length=4.0, physicsClientId=client)
        crown = pybullet.createVisualShape(pybullet.GEOM_SPHERE, radius=2.0, physicsClientId=client)
        for x, y in np.random.default_rng(2).uniform(-120.0, 120.0, (200, 2)):
            pybullet.createMultiBody(0, -1, trunk, [x, y, 2.0], physicsClientId=client)
            pybullet.createMultiBody(0, -1, crown, [x, y, 5.0], physicsClientId=client)
        projection = pybullet.computeProjectionMatrixFOV(90.0, 1.0, 0.1, 80.0)
        rates = []
        for yaw in np.linspace(0.0, 6.0, 12):
            view = pybullet.computeViewMatrix([0, 0, 3.0], [np.cos(yaw), np.sin(yaw), 2.8], [0, 0, 1.0])
            start = time.perf_counter()
            pybullet.getCameraImage(
                64, 64, view, projection, renderer=pybullet.ER_TINY_RENDERER, physicsClientId=client
            )
            rates.append(1.0 / (time.perf_counter() - start))
        return float(max(rates))
    finally:
        pybullet.disconnect(client)
