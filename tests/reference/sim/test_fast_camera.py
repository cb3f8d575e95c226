"""The fast camera against the exact ray caster, from random poses."""

import numpy as np
import pytest
import warp as wp

from sim.sensors.camera import Lens, pixel_ray
from sim.sensors.fast_camera.fast_camera import RANGE_M, QuickCamera
from sim.sensors.ray import CROWN, PERSON, RAY_MAX_M, SKY, TRUNK, first_hit, is_trunk
from sim.sensors.skyline import Skyline, make_skyline
from sim.world.people import Person
from sim.world.world import World, WorldConfig, build_world

FOLLOW_WORLD = WorldConfig(
    size_m=256.0,
    cell_m=4.0,
    hill_height_m=8.0,
    hill_wavelength_m=120.0,
    clearing_radius_m=5.0,
    clearing_blend_m=60.0,
    tree_height_min_m=8.0,
    tree_height_max_m=15.0,
    trees_per_ha=100.0,
    has_walls=True,
)
STEEP_WORLD = WorldConfig(seed=4, size_m=512.0, hill_height_m=40.0, hill_wavelength_m=150.0, clearing_blend_m=60.0)


@wp.kernel
def cast_rays(
    w: World, skyline: Skyline, lenses: wp.array[Lens], depth_m: wp.array3d[float], kind: wp.array3d[wp.uint8]
) -> None:
    i, row, column = wp.tid()
    ray = pixel_ray(lenses[i], float(column) + 0.5, float(row) + 0.5, depth_m.shape[2], depth_m.shape[1])
    length = wp.length(ray)
    hit = first_hit(w, skyline, lenses[i].pos_ned, ray / length, RANGE_M)
    depth_m[i, row, column] = wp.where(hit.kind == SKY, RAY_MAX_M, hit.t / length)
    if hit.kind == CROWN:
        if is_trunk(w.forest.trees[hit.i_tree], lenses[i].pos_ned + hit.t / length * ray):
            hit.kind = TRUNK
    kind[i, row, column] = wp.uint8(hit.kind)


def exact(world, camera):
    depth_m, kind = wp.zeros_like(camera.depth_m), wp.zeros_like(camera.kind)
    skyline = make_skyline(world).kernel("cpu")
    wp.launch(cast_rays, dim=camera.kind.shape, inputs=[world.kernel, skyline, camera.lenses, depth_m, kind])
    return depth_m.numpy(), kind.numpy()


def random_places(world, count, rng, low_m=0.3, high_m=10.0):
    """In the open, so many metres above the ground."""
    positions = []
    while len(positions) < count:
        north, east = rng.uniform(-0.48, 0.48, 2) * world.config.size_m
        position = np.array([north, east, -float(world.height(north, east)) - rng.uniform(low_m, high_m)])
        if world.obstacle_distance(position) > 0.1:
            positions.append(position)
    return np.array(positions)


def pointed(camera, positions, rng):
    """Gives the cameras their places, and any attitude."""
    lenses = camera.lenses.numpy()
    q = rng.normal(size=(len(positions), 4))
    lenses["pos_ned"] = positions
    lenses["q_ned_from_rdf"] = q / np.linalg.norm(q, axis=1, keepdims=True)


@pytest.mark.parametrize(
    ("config", "low_m", "high_m"),
    [(FOLLOW_WORLD, 0.3, 10.0), (FOLLOW_WORLD, 10.0, 40.0), (STEEP_WORLD, 0.3, 10.0)],
    ids=["follow", "high", "steep"],
)
def test_classes_and_depth_are_those_of_the_exact_ray_cast(config, low_m, high_m):
    rng = np.random.default_rng(8)
    world = build_world(config)
    camera = QuickCamera(world, 60)
    pointed(camera, random_places(world, 60, rng, low_m, high_m), rng)
    camera.render()
    depth_m, kind = exact(world, camera)
    assert (camera.kind.numpy() != kind).mean() < 0.003
    is_near = (kind != SKY) & (camera.kind.numpy() != SKY)
    assert np.percentile(np.abs(camera.depth_m.numpy() - depth_m)[is_near], 99) < 0.06


def test_a_picture_is_the_same_alone_and_among_others():
    rng = np.random.default_rng(9)
    world = build_world(FOLLOW_WORLD)
    many, alone = QuickCamera(world, 5), QuickCamera(world, 1)
    pointed(many, random_places(world, 5, rng), rng)
    many.render()
    alone.lenses.numpy()[:] = many.lenses.numpy()[3]
    alone.render()
    assert (alone.rgb.numpy()[0] == many.rgb.numpy()[3]).all()
    assert (alone.depth_m.numpy()[0] == many.depth_m.numpy()[3]).all()


def test_from_inside_a_crown_all_is_crown_at_no_distance():
    world = build_world(FOLLOW_WORLD)
    tree = world.trees[0]
    camera = QuickCamera(world, 1)
    camera.lenses.numpy()["pos_ned"] = (tree["north"], tree["east"], -tree["crown_high"])
    camera.render()
    assert (camera.kind.numpy() == CROWN).all()
    assert (camera.depth_m.numpy() == 0.0).all()


def test_person_stands_in_the_picture_with_a_blue_shirt():
    world = build_world(FOLLOW_WORLD)
    people = wp.zeros(1, dtype=Person)
    ground = float(world.height(3.0, 0.0))
    people.numpy()["pos_ned"] = (3.0, 0.0, -ground)
    people.numpy()["stature_m"] = 1.75
    camera = QuickCamera(world, 1, people=people)
    camera.lenses.numpy()["pos_ned"] = (0.0, 0.0, -ground - 1.2)
    camera.render()
    is_person = camera.kind.numpy()[0] == PERSON
    rows, columns = np.nonzero(is_person)
    assert rows.max() - rows.min() == pytest.approx(1.75 / 3.0 * 32.0, abs=2.5)
    assert abs(columns.mean() - 31.5) < 1.0
    chest = camera.rgb.numpy()[0, 32, 31].astype(int)
    assert chest[2] > chest[0] + 40
    assert chest[2] > chest[1] + 40
    assert camera.depth_m.numpy()[0, 32, 31] == pytest.approx(2.87, abs=0.08)
