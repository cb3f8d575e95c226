"""Kernel queries of a world, for the tests: many points or rays in one launch."""

import numpy as np
import warp as wp

from sim.world.batch import WorldBatch
from sim.world.world import World, WorldMap, ground_height, ground_normal_ned, obstacle_contact, ray_hit

wp.set_module_options({"enable_backward": False})


Place = WorldMap | tuple[WorldBatch, int]
"""A world of its own, or one of a batch."""


@wp.kernel
def _points(
    worlds: wp.array[World],
    i_world: int,
    radius: float,
    pos_ned: wp.array[wp.vec3],
    height: wp.array[wp.float32],
    normal_ned: wp.array[wp.vec3],
    contact: wp.array[wp.vec4],
):
    i = wp.tid()
    w = worlds[i_world]
    pos = pos_ned[i]
    height[i] = ground_height(w, pos[0], pos[1])
    normal_ned[i] = ground_normal_ned(w, pos[0], pos[1])
    contact[i] = obstacle_contact(w, pos, radius)


@wp.kernel
def _rays(
    worlds: wp.array[World],
    i_world: int,
    origin_ned: wp.array[wp.vec3],
    dir_ned: wp.array[wp.vec3],
    max_m: float,
    hit: wp.array[wp.float32],
):
    i = wp.tid()
    hit[i] = ray_hit(worlds[i_world], origin_ned[i], dir_ned[i], max_m)


def _kernels(world: Place) -> list:
    if isinstance(world, WorldMap):
        return [wp.array([world.kernel], dtype=World), 0]
    batch, i_world = world
    return [batch.kernels, i_world]


def query_points(world: Place, pos_ned: np.ndarray, radius: float = 0.3) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Height (n,), normal (n, 3) and contact (n, 4) at points (n, 3), from the kernel functions."""
    pos = wp.array(np.asarray(pos_ned, np.float32), dtype=wp.vec3)
    height = wp.zeros(len(pos), dtype=wp.float32)
    normal = wp.zeros(len(pos), dtype=wp.vec3)
    contact = wp.zeros(len(pos), dtype=wp.vec4)
    wp.launch(_points, dim=len(pos), inputs=[*_kernels(world), radius, pos, height, normal, contact])
    return height.numpy(), normal.numpy(), contact.numpy()


def query_rays(world: Place, origin_ned: np.ndarray, dir_ned: np.ndarray, max_m: float) -> np.ndarray:
    """Hit distances (n,) of rays (n, 3), from the kernel function."""
    origin = wp.array(np.asarray(origin_ned, np.float32), dtype=wp.vec3)
    direction = wp.array(np.asarray(dir_ned, np.float32), dtype=wp.vec3)
    hit = wp.zeros(len(origin), dtype=wp.float32)
    wp.launch(_rays, dim=len(origin), inputs=[*_kernels(world), origin, direction, max_m, hit])
    return hit.numpy()
