import numpy as np
import pytest
import warp as wp

from sim.sensors.fast_camera.fast_camera import QuickCamera
from sim.sensors.ray import SKY
from sim.world.batch import WorldBatch
from sim.world.world import WorldConfig

CONFIG = WorldConfig(
    size_m=128.0, hill_height_m=8.0, hill_wavelength_m=60.0, clearing_radius_m=5.0, clearing_blend_m=20.0,
    trees_per_ha=60.0, tree_height_min_m=8.0, tree_height_max_m=15.0, has_walls=True,
)  # fmt: skip


def grown(count):
    batch = WorldBatch(CONFIG, count)
    batch.grow_all(1)
    return batch


def flags(*values):
    return wp.array(values, dtype=wp.bool)


def look_around(camera, seed=2):
    """Places the cameras 3 m above home, each with an attitude of its own."""
    lenses = camera.lenses.numpy()
    q = np.random.default_rng(seed).normal(size=(len(lenses), 4))
    lenses["pos_ned"] = (0.0, 0.0, -3.0)
    lenses["q_ned_from_rdf"] = q / np.linalg.norm(q, axis=1, keepdims=True)


def images(camera):
    return [array.numpy().copy() for array in (camera.rgb, camera.depth_m, camera.kind)]


def same(first, second, i, j):
    return all((a[i] == b[j]).all() for a, b in zip(first, second, strict=True))


def test_each_camera_sees_its_own_world_as_it_would_alone():
    batch = grown(3)
    i_world = [2, 0, 1, 2]
    camera = QuickCamera(batch, 4, i_world=i_world)
    look_around(camera)
    camera.render()
    for i, world in enumerate(i_world):
        alone = QuickCamera(batch.map(world), 1)
        alone.lenses.numpy()[0] = camera.lenses.numpy()[i]
        alone.render()
        assert same(images(camera), images(alone), i, 0)


def test_a_new_world_is_seen_after_refresh_and_the_others_stay():
    batch = grown(2)
    camera = QuickCamera(batch, 2)
    look_around(camera)
    camera.render()
    before = images(camera)
    batch.grow(flags(False, True), wp.array([0, 12], dtype=wp.int32))
    camera.refresh(flags(False, True))
    camera.render()
    fresh = QuickCamera(batch, 2)
    wp.copy(fresh.lenses, camera.lenses)
    fresh.render()
    after = images(camera)
    assert same(after, before, 0, 0)
    assert not same(after, before, 1, 1)
    assert same(after, images(fresh), 1, 1)


def test_refresh_packs_only_chosen_worlds():
    batch = grown(2)
    camera = QuickCamera(batch, 2)
    batch.grow(flags(True, True), wp.array([11, 12], dtype=wp.int32))
    packed = camera._ground.cells.numpy().reshape(2, -1)
    before = packed.copy()
    camera.refresh(flags(False, True))
    assert (packed[0] == before[0]).all()
    assert (packed[1] != before[1]).any()


def test_only_chosen_pictures_are_taken():
    camera = QuickCamera(grown(3), 3)
    look_around(camera)
    camera.render()
    before = images(camera)
    look_around(camera, seed=5)
    camera.render(flags(False, True, False))
    after = images(camera)
    assert same(after, before, 0, 0)
    assert same(after, before, 2, 2)
    assert not same(after, before, 1, 1)
    camera.render()
    assert same(images(camera), after, 1, 1)


def test_pictures_do_not_depend_on_the_number_of_threads():
    batch = grown(3)
    alone, shared = (QuickCamera(batch, 3, has_optics=True, threads=threads) for threads in (1, 2))
    for camera in (alone, shared):
        look_around(camera)
        rows = camera.optics.numpy()
        rows["read_std"], rows["seed"] = 3.0, range(3)
        camera.render(flags(True, False, True))
    assert all((a == b).all() for a, b in zip(images(alone), images(shared), strict=True))
    assert alone.rgb.numpy()[2].any()


def test_a_pose_that_is_not_a_number_shows_the_sky():
    camera = QuickCamera(grown(1), 2)
    look_around(camera)
    lenses = camera.lenses.numpy()
    lenses["pos_ned"][0, 1] = np.nan
    lenses["q_ned_from_rdf"][1, 2] = np.nan
    camera.render()
    assert (camera.kind.numpy() == SKY).all()


def test_cameras_and_worlds_that_do_not_match_are_refused():
    with pytest.raises(ValueError, match="5 cameras and 2 worlds"):
        QuickCamera(grown(2), 5)
