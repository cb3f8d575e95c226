"""The chase camera: where it is, what it sees, and that the vehicle is in its picture."""

import dataclasses

import numpy as np
import pytest

from common.attitude import rotated
from mission.flight import flight_world
from mission.view.chase import BEHIND_M, HEIGHT, INSET, WIDTH, averaged, camera_path, film, looking
from mission.view.pictures import onboard_eye
from sim.sensors.ray import PERSON
from sim.world.world import WorldConfig, build_world
from tests.unit.mission.view.rows import CONFIG, WORLD, hovering


@pytest.fixture(scope="module")
def world():
    return flight_world(CONFIG)


def test_an_average_keeps_what_is_constant_and_lies_between_neighbours():
    steps = np.repeat([[0.0], [1.0]], 50, axis=0)
    smooth = averaged(steps, 5.0)
    assert averaged(np.ones((30, 2)), 4.0) == pytest.approx(1.0)
    assert (np.diff(smooth[:, 0]) >= 0.0).all()
    assert np.abs(np.diff(smooth[:, 0])).max() < 0.1


def test_a_camera_looks_at_its_target_and_is_level():
    place, target = np.array((1.0, 2.0, -3.0)), np.array((4.0, -2.0, -1.0))
    q = looking(place, target)
    ahead = (target - place) / np.linalg.norm(target - place)
    assert np.allclose(rotated(q, (0.0, 0.0, 1.0)), ahead, atol=1e-6)
    assert rotated(q, (1.0, 0.0, 0.0))[2] == pytest.approx(0.0, abs=1e-6)


def test_the_camera_is_behind_the_vehicle_as_seen_from_its_owner(world):
    place, target = camera_path(hovering(), world)
    assert place[:, 0] == pytest.approx(-BEHIND_M, abs=0.05)
    assert (target[:, 0] > 0.0).all()
    assert (-place[:, 2] > 1.4).all()


def test_the_camera_comes_nearer_where_a_tree_would_stand_before_it():
    """A forest with a tree within reach behind the vehicle."""
    forest = build_world(WorldConfig(size_m=64.0, hill_height_m=0.0, trees_per_ha=300.0, clearing_radius_m=0.0))
    tree = forest.trees[np.argmin(np.hypot(forest.trees["north"], forest.trees["east"]))]
    recording = hovering()
    rows = recording.rows.copy()
    rows["pos_ned"] = (tree["north"] + 2.0, tree["east"], -tree["crown_low"])
    rows["owner"]["stature_m"] = 0.0
    place, _ = camera_path(dataclasses.replace(recording, rows=rows), forest)
    assert (np.abs(place[:, 0] - rows["pos_ned"][:, 0]) < BEHIND_M - 0.5).all()


def test_the_vehicle_and_the_onboard_picture_are_in_the_film(world):
    recording = hovering(0.2)
    with_vehicle = next(film(recording, world))
    rows = recording.rows.copy()
    rows["pos_ned"][0, 2] += 0.5  # the camera hardly moves: it is an average
    lower = next(film(dataclasses.replace(recording, rows=rows), world))
    assert with_vehicle.shape == (HEIGHT, WIDTH, 3)
    middle = np.s_[HEIGHT // 3 : -HEIGHT // 8, WIDTH // 3 : -WIDTH // 3]
    assert (np.abs(with_vehicle[middle].astype(int) - lower[middle]).max(axis=2) > 40).sum() > 100
    inset = with_vehicle[8 : 8 + INSET, -8 - INSET : -8]
    assert np.ptp(inset.reshape(-1, 3), axis=0).max() > 50


def test_the_onboard_camera_sees_the_owner_ahead_and_not_behind(world):
    eye = onboard_eye(world)
    kind = eye.camera.kind.numpy()
    eye.look_from(hovering().rows[0])
    assert (kind == PERSON).any()
    eye.look_from(hovering(distance_m=-2.0).rows[0])
    assert not (kind == PERSON).any()
    assert WORLD.trees_per_ha == 0.0
