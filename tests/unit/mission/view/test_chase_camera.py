"""The chase camera: where it is, and that it sees both the vehicle and whom it follows."""

import dataclasses

import numpy as np
import pytest

from common.airframe import load_airframe
from common.attitude import rotated
from mission.simulator.flight_rig import flight_world
from mission.view.chase_camera import BEHIND_M, BESIDE_RAD, averaged, camera_path, looking
from mission.view.film_images import HEIGHT, HFOV_DEG, WIDTH
from mission.view.snapshot_images import Eye, onboard_eye
from mission.view.vehicle_model import VehicleModel
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


def test_the_camera_is_behind_and_beside_the_vehicle_as_seen_from_its_owner(world):
    place, target = camera_path(hovering(), world)
    assert place[:, 0] == pytest.approx(-BEHIND_M * np.cos(BESIDE_RAD), abs=0.05)
    assert place[:, 1] == pytest.approx(BEHIND_M * np.sin(BESIDE_RAD), abs=0.05)
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


@pytest.mark.parametrize("distance_m", [1.0, 1.5, 2.0, 3.0])
@pytest.mark.parametrize("height_m", [1.0, 1.4, 2.0])
def test_the_vehicle_does_not_hide_the_owners_legs_and_both_are_in_the_picture(world, distance_m, height_m):
    recording = hovering(0.2, distance_m=distance_m)
    recording.rows["pos_ned"][:, 2] = -height_m
    places, targets = camera_path(recording, world)
    row, place, q = recording.rows[0], places[0], looking(places[0], targets[0])
    eye = Eye(world, WIDTH, HEIGHT, HFOV_DEG)
    eye.look(place, q, row["owner"])
    drawn = eye.rgb.copy()
    VehicleModel(load_airframe(CONFIG.airframe)).draw(drawn, eye, row, place, q)
    is_vehicle = (drawn != eye.rgb).any(axis=2)
    is_person = eye.camera.kind.numpy()[0] == PERSON
    rows = np.flatnonzero(is_person.any(axis=1))
    is_leg = is_person & (np.arange(HEIGHT) >= (rows[0] + rows[-1]) // 2)[:, None]
    assert is_leg.sum() > 300
    assert is_vehicle.sum() > 300
    assert (is_leg & is_vehicle).sum() < 0.05 * is_leg.sum()
    for seen in (is_person, is_vehicle):  # whole: nothing of them at the edges
        assert not np.concatenate([seen[0], seen[-1], seen[:, 0], seen[:, -1]]).any()


def test_without_an_owner_the_camera_is_straight_behind(world):
    recording = hovering()
    recording.rows["owner"]["stature_m"] = 0.0
    place, target = camera_path(recording, world)
    assert place[:, 0] == pytest.approx(-BEHIND_M, abs=0.05)
    assert place[:, 1] == pytest.approx(0.0, abs=0.05)
    assert (target[:, 0] > 0.0).all()


def test_the_onboard_camera_sees_the_owner_ahead_and_not_behind(world):
    eye = onboard_eye(world)
    kind = eye.camera.kind.numpy()
    eye.look_from(hovering().rows[0])
    assert (kind == PERSON).any()
    eye.look_from(hovering(distance_m=-2.0).rows[0])
    assert not (kind == PERSON).any()
    assert WORLD.trees_per_ha == 0.0
