import numpy as np
import pytest
import warp as wp

from sim.sensors.fast_camera.ground import make_ground
from sim.sensors.fast_camera.light import light_corners, light_strips
from sim.sensors.shading import SUN_NED
from sim.world.world import World, WorldConfig, build_world

SUN = np.array([float(SUN_NED[i]) for i in range(3)])
CONFIG = WorldConfig(
    size_m=128.0, hill_height_m=8.0, hill_wavelength_m=120.0, clearing_radius_m=5.0, clearing_blend_m=60.0,
    tree_height_min_m=8.0, tree_height_max_m=15.0,
)  # fmt: skip


def baked(world, strips=16):
    """Light of all texels, 0..1, rows to the north."""
    ground = make_ground(world.config, 1, "cpu")
    inputs = [wp.array([world.kernel], dtype=World), wp.full(1, value=True, dtype=wp.bool), ground]
    wp.launch(light_corners, dim=(1, ground.side + 1), inputs=inputs)
    wp.launch(light_strips, dim=(1, strips), inputs=[*inputs, strips])
    return ground.light.numpy().reshape(ground.texels, ground.texels) / 255.0


def test_ground_without_trees_is_lit_by_its_slope():
    world = build_world(CONFIG.model_copy(update={"trees_per_ha": 0.0, "octaves": 1}))
    light = baked(world)
    along = np.arange(4, 124) + 0.5
    slope = world.normal_ned(along[:, None] - 64.0, along[None, :] - 64.0) @ SUN
    assert np.abs(light[4:124, 4:124] - slope).mean() < 0.01


def test_a_texel_is_dark_where_a_ray_to_the_sun_meets_a_tree():
    world = build_world(CONFIG)
    light = baked(world)
    clear = baked(build_world(CONFIG.model_copy(update={"trees_per_ha": 0.0})))
    rng = np.random.default_rng(4)
    agree = []
    for i, j in rng.integers(0, 128, (1500, 2)):
        north, east = i - 63.5, j - 63.5
        spot = np.array([north, east, -float(world.height(north, east)) - 0.02])
        is_dark = world.forest.ray_hit(spot, SUN, 60.0) < 60.0
        agree.append(is_dark == (light[i, j] < 0.5 * clear[i, j]))
    assert np.mean(agree) > 0.97
    assert (light < 0.5 * clear).mean() > 0.15


def test_strips_leave_no_seam():
    world = build_world(CONFIG)
    assert (baked(world, 16) == baked(world, 1)).all()


def test_level_ground_is_lit_by_the_height_of_the_sun():
    world = build_world(CONFIG.model_copy(update={"trees_per_ha": 0.0, "hill_height_m": 0.0}))
    assert baked(world) == pytest.approx(-SUN[2], abs=1.0 / 255.0)
