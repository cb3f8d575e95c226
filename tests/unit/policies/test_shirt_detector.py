"""The owner found in an image."""

from math import atan2, degrees, dist, hypot, sin

import numpy as np
import pytest
import warp as wp

from common.attitude import product, quat_of, rotated
from policies.shirt_detector import SHIRT_OVER_CHEST_M, find_owner
from policies.tasks.follow_me.observe import DEPTH_HALF_M, HFOV_DEG, camera_mount, pack_images
from sim.sensors.fast_camera.fast_camera import QuickCamera
from sim.walking_owner import Owner
from sim.world.people import CHEST_M
from sim.world.world import WorldConfig, build_world

DISTANCES_M = (1.0, 2.0, 3.0, 4.0, 5.0)  # beyond 6 m a shirt is two pixels
SIDES_M = (-0.3, 0.0, 0.4)


def packed(camera):
    images = wp.zeros((*camera.rgb.shape[:3], 4), dtype=wp.uint8)
    everyone = wp.full(len(images), value=True, dtype=wp.bool)
    wp.launch(pack_images, images.shape[:2], [camera.rgb, camera.depth_m, everyone, images])
    return images.numpy()


@pytest.fixture(scope="module")
def views():
    """Owners at several places before a camera 1.6 m above the ground: the images, and where the shirts are."""
    world = build_world(WorldConfig(seed=2, trees_per_ha=0.0, hill_height_m=0.0))
    positions = [(ahead, side * ahead, 0.5) for ahead in DISTANCES_M for side in SIDES_M]
    owner = Owner(world, positions, 5)
    camera = QuickCamera(world, len(positions), people=owner.people)
    lenses = camera.lenses.numpy()
    eye = np.array([0.0, 0.0, -world.terrain.height(0.0, 0.0) - 1.6])
    q_ned_from_rdf = product(quat_of(0.0, 0.05), camera_mount())
    lenses["pos_ned"], lenses["q_ned_from_rdf"] = eye, q_ned_from_rdf
    camera.lenses.assign(lenses)
    camera.render()
    images = packed(camera)
    shirts = owner.people.numpy()["pos_ned"] - np.array([0.0, 0.0, float(CHEST_M) + SHIRT_OVER_CHEST_M])
    return images, shirts, eye, q_ned_from_rdf


def test_direction_and_range_are_those_of_the_shirt(views):
    images, shirts, eye, q_ned_from_rdf = views
    for image, shirt in zip(images, shirts, strict=True):
        sight = find_owner(image, HFOV_DEG, float(DEPTH_HALF_M))
        to_shirt = shirt - eye
        place = np.array(rotated(q_ned_from_rdf, sight.position_rdf))
        far = float(np.linalg.norm(to_shirt))
        assert sight.range_m == pytest.approx(dist(shirt, eye), abs=0.15 + 0.04 * far)
        azimuth_error = atan2(place[1], place[0]) - atan2(to_shirt[1], to_shirt[0])
        up_error = atan2(-place[2], hypot(*place[:2])) - atan2(-to_shirt[2], hypot(*to_shirt[:2]))
        assert abs(degrees(azimuth_error)) < 3.0
        assert far * abs(sin(up_error)) < 0.25  # people are of different height


def test_a_world_without_people_shows_nobody():
    world = build_world(WorldConfig(seed=2, trees_per_ha=200.0))
    camera = QuickCamera(world, 36)
    lenses = camera.lenses.numpy()
    for i in range(36):
        lenses["pos_ned"][i] = (0.0, 0.0, -world.terrain.height(0.0, 0.0) - 2.0)
        lenses["q_ned_from_rdf"][i] = product(quat_of(i * np.pi / 18.0, -0.2 + 0.02 * i), camera_mount())
    camera.lenses.assign(lenses)
    camera.render()
    images = packed(camera)
    assert [find_owner(image, HFOV_DEG, float(DEPTH_HALF_M)) for image in images] == [None] * 36
