"""Shapes: what faces outwards, and that they lie where the world has them."""

import numpy as np
import pytest

from common.airframe import load_airframe
from common.attitude import rotated
from mission.view import shapes
from sim.world.batch import grown_world
from sim.world.driving_worlds import COURSE
from sim.world.world import WorldConfig, build_world

WORLD = build_world(WorldConfig(size_m=200.0, has_walls=True, hill_height_m=8.0))


def volume(mesh):
    """Enclosed by a closed mesh; positive if its faces look outwards."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(float) for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def test_a_box_faces_outwards_and_has_its_size():
    box = shapes.box((3.0, -2.0, 1.0), (1.0, 2.0, 3.0), shapes.FRAME)
    assert volume(box) == pytest.approx(6.0)
    assert np.allclose(np.ptp(box.vertices, axis=0), (1.0, 2.0, 3.0))


def test_a_beam_faces_outwards_and_reaches_its_end():
    end = np.array((1.0, 2.0, -2.0), np.float32)
    beam = shapes.beam((0.0, 0.0, 0.0), end, 0.1, shapes.FRAME)
    assert volume(beam) == pytest.approx(3.0 * 0.01, rel=1e-4)
    assert np.abs(beam.vertices - end).sum(axis=1).min() < 0.2


def test_a_ball_is_nearly_a_ball():
    assert volume(shapes.ball()) == pytest.approx(4.19, rel=0.3)
    assert np.allclose(np.linalg.norm(shapes.ball().vertices, axis=1), 1.0, atol=1e-5)


def test_the_side_of_a_trunk_faces_outwards():
    mesh = shapes.trunk()
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    middle = (a + b + c) / 3.0
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a)[:, :2], middle[:, :2]) > 0.0).all()


def test_the_ground_faces_up_and_is_the_worlds():
    mesh = shapes.ground(WORLD)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] < 0.0).all()  # up is negative in ned
    north, east, down = mesh.vertices.T
    assert np.allclose(-down, WORLD.height(north, east), atol=1e-3)


def test_a_large_ground_is_thinned():
    mesh = shapes.ground(WORLD, cells_most=10)
    assert len(mesh.vertices) == 11 * 11
    assert np.abs(mesh.vertices[:, :2]).max() == pytest.approx(100.0)


def test_every_tree_stands_between_its_root_and_its_top():
    forest, rows = shapes.trees(WORLD), WORLD.trees
    assert len(forest.trunk_ned) == len(rows) > 0
    top = -(forest.crown_ned[:, 2] - forest.crown_size[:, 2])
    assert np.allclose(top, rows["crown_high"] + rows["crown_radius"], atol=1e-3)
    root = -(forest.trunk_ned[:, 2] + forest.trunk_size[:, 2])
    assert np.allclose(root, rows["root_height"], atol=1e-3)


def test_walls_stand_where_the_world_has_them_and_only_there():
    ring = shapes.walls(WORLD)
    assert np.abs(ring.vertices[:, :2]).max() == pytest.approx(100.5)
    assert -ring.vertices[:, 2].min() == pytest.approx(WORLD.walls.top_m)
    assert shapes.walls(build_world(WorldConfig(size_m=100.0))) is None


def test_a_person_is_as_tall_as_asked_and_stands_on_the_feet():
    heights = -shapes.person(1.8).vertices[:, 2]
    assert heights.min() == pytest.approx(0.0, abs=0.01)
    assert heights.max() == pytest.approx(1.8, abs=0.05)


@pytest.mark.parametrize("name", ["x500", "f550"])
def test_a_vehicle_has_an_arm_to_each_rotor(name):
    airframe = load_airframe(name)
    frame = shapes.multirotor(airframe)
    for hub in shapes.hubs_frd(airframe):
        assert np.linalg.norm(frame.vertices - hub, axis=1).min() < 0.1
    radius = shapes.blade_radius_m(airframe)
    assert 0.05 < radius < 0.3


def test_every_box_is_drawn_where_it_stands():
    world = grown_world(COURSE.model_copy(update={"trees_per_ha": 0.0}), 3)
    mesh = shapes.boxes(world, tick=500)
    rows = world.boxes.rows
    corners = mesh.vertices.reshape(len(rows), -1, 3)
    np.testing.assert_allclose(corners.mean(axis=1)[:, :2], world.boxes.middle(500), atol=1e-4)
    np.testing.assert_allclose(-corners[:, :, 2].min(axis=1), rows["high"], atol=1e-4)
    lengths = np.hypot(*(corners[:, :, :2] - world.boxes.middle(500)[:, None]).transpose(2, 0, 1)).max(axis=1)
    np.testing.assert_allclose(lengths, np.hypot(rows["half_length"], rows["half_width"]), atol=1e-4)
    assert shapes.boxes(WORLD) is None


@pytest.mark.parametrize("name", ["rover", "rover-skid"])
def test_a_rover_has_its_wheels_at_their_hubs_inside_its_hull(name):
    airframe = load_airframe(name)
    shape = shapes.vehicle(airframe)
    wheels, hull = airframe.wheels, airframe.hull
    assert shape.wheel_hubs[1] == pytest.approx((wheels.front_x_m, 0.5 * wheels.track_m, wheels.hub_z_m))  # front right
    assert list(shape.is_steered) == [not airframe.is_skid] * 2 + [False] * 2
    for mesh, hub in zip(shape.wheels, shape.wheel_hubs, strict=True):
        assert volume(mesh) > 0.0
        assert np.ptp(mesh.vertices[:, 0]) == pytest.approx(2.0 * wheels.radius_m, rel=0.05)
        assert np.abs(mesh.vertices + hub)[:, 1].max() <= hull.half_width_m + 0.01
    low, high = shape.body.vertices.min(axis=0), shape.body.vertices.max(axis=0)
    assert (low[0], high[0]) == pytest.approx((-hull.rear_m, hull.front_m), abs=0.03)
    assert (low[2], high[2]) == pytest.approx((-hull.top_m, hull.bottom_m), abs=0.03)


def test_a_wheel_that_rolls_forwards_has_its_top_move_ahead_and_points_where_it_is_steered():
    top_frd = np.array((0.0, 0.0, -1.0))
    assert rotated(shapes.wheel_attitude(0.1, 0.0), top_frd)[0] == pytest.approx(np.sin(0.1))
    axle_frd = rotated(shapes.wheel_attitude(2.0, 0.3), (0.0, 1.0, 0.0))
    assert axle_frd == pytest.approx((-np.sin(0.3), np.cos(0.3), 0.0), abs=1e-6)  # to the right: its left end is ahead


@pytest.mark.parametrize("name", ["plane", "easyglider", "c172"])
def test_a_plane_is_closed_and_as_large_as_its_file_says(name):
    airframe = load_airframe(name)
    body = shapes.vehicle(airframe).body
    low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
    assert volume(body) > 0.0
    assert high[1] - low[1] == pytest.approx(airframe.wing.span_m, rel=1e-3)
    assert high[0] == pytest.approx(airframe.hull.nose_x_m, abs=0.05)
    assert -low[0] == pytest.approx(airframe.hull.tail_x_m, rel=0.2)
    assert high[2] == pytest.approx(airframe.standing_height_m, rel=0.15)
    assert low[2] < airframe.hull.tail_z_m  # the fin is up


def test_the_red_wing_tip_is_the_left_one():
    body = shapes.vehicle(load_airframe("easyglider")).body
    is_red = (body.colours[:, 0] > 150) & (body.colours[:, 1] < 100)
    assert (body.vertices[is_red][:, 1] < 0.0).all()
    assert is_red.any()
