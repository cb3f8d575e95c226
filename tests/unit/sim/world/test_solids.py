"""Laws of solids: what a ray meets, a camera sees and a vehicle touches is one surface."""

from itertools import pairwise

import numpy as np
import pytest

from common.airframe import load_airframe
from common.kernels import TICK_S
from sim.bodies.contact import resting_height_m
from sim.sensors.camera import CameraPose, Renderer
from sim.sensors.fast_camera.fast_camera import QuickCamera
from sim.sensors.ray import SOLID
from sim.world.batch import WorldBatch
from sim.world.custom.solid_parts import sides_of
from sim.world.custom.world_file import BoxSolid, CylinderSolid, MeshSolid, PadSolid, WallSolid, WorldFile
from sim.world.world import WorldConfig, build_world
from tests.unit.sim.fleet import Fleet
from tests.unit.sim.rover_fleet import RoverFleet, up_ned
from tests.unit.sim.world.meshes import lump, lump_world, ray_oracle, rays_at, world_of
from tests.unit.sim.world.queries import query_points, query_rays

MIDDLE = (12.0, 7.0, -5.0)
SECOND = round(1.0 / TICK_S)
X500 = load_airframe("x500")
TABLE = BoxSolid(position_ned_m=(0.0, 0.0), size_m=(4.0, 4.0, 2.0), heading_deg=30.0)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_ray_meets_a_mesh_where_arithmetic_in_float64_says(tmp_path, seed):
    world = lump_world(tmp_path, seed)
    origins, dirs = rays_at(MIDDLE, 400, seed)
    truth = ray_oracle(world, origins, dirs)
    meets = np.isfinite(truth)
    assert 0.5 < meets.mean() < 1.0
    found = query_rays(world, origins, dirs, 60.0)
    np.testing.assert_allclose(found[meets], truth[meets], atol=1e-4)
    by_host = [world.ray_hit(origin, direction, 60.0) for origin, direction in zip(origins, dirs, strict=True)]
    np.testing.assert_allclose(by_host, found, atol=1e-3)  # the ground beside the mesh too


def test_contact_ray_and_both_cameras_agree_within_a_millimetre(tmp_path):
    world = lump_world(tmp_path)
    q = (0.5, 0.5, 0.5, 0.5)  # looks north
    place = (2.0, 7.0, -5.0)
    images = Renderer(world).images([CameraPose(place, q, 60.0)], 64, 48)
    quick = QuickCamera(world, 1, width=64, height=48, hfov_deg=60.0)
    quick.lenses.numpy()[0]["pos_ned"] = place
    quick.render()
    seen = images.kind[0] == SOLID
    assert seen.sum() > 500
    np.testing.assert_array_equal(quick.kind.numpy()[0] == SOLID, seen)
    np.testing.assert_allclose(quick.depth_m.numpy()[0][seen], images.depth_m[0][seen], atol=1e-3)
    rows, columns = np.nonzero(seen)
    per_pixel = 2.0 * np.tan(np.radians(30.0)) / 64
    rays = np.stack([np.ones(len(rows)), (columns + 0.5 - 32) * per_pixel, (rows + 0.5 - 24) * per_pixel], axis=1)
    lengths = np.linalg.norm(rays, axis=1)
    depth = images.depth_m[0][seen]
    ray = query_rays(world, np.tile(place, (len(rays), 1)), rays / lengths[:, None], 60.0)
    np.testing.assert_allclose(ray, depth * lengths, atol=1e-3)
    # a sphere 5 cm before the place seen is pushed off a place on the surface that is as near, floors left out
    _, normals = world.solids.rays(np.tile(place, (len(rays), 1)), rays / lengths[:, None], 60.0)
    steep = -normals[:, 2] < 0.49
    assert steep.mean() > 0.6
    before = (np.array(place) + depth[:, None] * rays + 0.05 * normals)[steep]
    _, _, contact = query_points(world, before, radius=0.3)
    gap = 0.3 - contact[:, 3]
    assert gap.max() < 0.0501
    nearest = world.solids.distance(before)
    assert (gap > nearest - 1e-5).all()
    assert world.solids.distance(before - gap[:, None] * contact[:, :3]).max() < 1e-3
    flat = np.abs(gap - 0.05) < 1e-5  # where no edge is nearer
    assert flat.mean() > 0.5
    np.testing.assert_allclose(contact[flat, :3], normals[steep][flat], atol=0.02)


def test_boxes_walls_and_cylinders_are_where_they_are_said_to_be():
    world = world_of(
        boxes=[BoxSolid(position_ned_m=(10.0, 0.0), size_m=(2.0, 6.0, 3.0), heading_deg=90.0)],
        walls=[WallSolid(points_ne_m=((-10.0, -5.0), (-10.0, 5.0)), height_m=2.0, thickness_m=0.4)],
        cylinders=[CylinderSolid(position_ned_m=(0.0, 10.0, -1.0), radius_m=2.0, height_m=4.0)],
        pads=[PadSolid(position_ned_m=(0.0, -10.0), height_m=0.1)],
    )
    assert world.ray_hit([0.0, 0.0, -1.0], [1.0, 0.0, 0.0], 50.0) == pytest.approx(7.0, abs=1e-4)
    assert world.ray_hit([0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], 50.0) == pytest.approx(9.8, abs=1e-4)
    assert world.ray_hit([0.0, 0.0, -3.0], [0.0, 1.0, 0.0], 50.0) == pytest.approx(8.0, abs=6e-4)
    np.testing.assert_allclose(
        world.surface([10.0, -10.0, 0.0, 0.0, 30.0], [0.0, 0.0, 10.0, -10.0, 0.0]), [3.0, 2.0, 5.0, 0.1, 0.0], atol=1e-3
    )
    assert world.obstacle_distance([0.0, 5.0, -3.0]) == pytest.approx(3.0, abs=6e-4)


@pytest.mark.parametrize("radius_m", [0.05, 1.0, 30.0])
def test_a_cylinder_is_round_to_half_a_millimetre(radius_m):
    world = world_of(cylinders=[CylinderSolid(position_ned_m=(0.0, 0.0), radius_m=radius_m, height_m=2.0)])
    angle = np.random.default_rng(0).uniform(0.0, 2.0 * np.pi, 500)
    inward = -np.stack([np.cos(angle), np.sin(angle), np.zeros(500)], axis=1)
    start = -2.0 * radius_m * inward + np.array([0.0, 0.0, -1.0])
    t, _ = world.solids.rays(start, inward, 100.0)
    assert np.abs(t - radius_m).max() < 6e-4
    assert sides_of(radius_m) <= 720


def test_a_wall_follows_its_corners_and_stands_on_hills():
    hills = {"hill_height_m": 8.0, "hill_wavelength_m": 60.0, "clearing_radius_m": 1.0, "clearing_blend_m": 10.0}
    line = ((40.0, -20.0), (40.0, 20.0), (70.0, 20.0))
    world = world_of(walls=[WallSolid(points_ne_m=line, height_m=1.0)], **hills)
    along = np.linspace(0.0, 1.0, 60)[:, None]
    points = np.concatenate([np.add(a, along * np.subtract(b, a)) for a, b in pairwise(line)])
    tops = world.solids.height(points[:, 0], points[:, 1])
    assert (tops - world.height(points[:, 0], points[:, 1])).min() > 0.99


def test_a_vehicle_rests_on_a_roof_as_on_the_ground(tmp_path):
    """Dropped from 30 cm with some speed on a box, and put down on a mesh with a slope of 10 degrees."""
    import trimesh

    slope = trimesh.creation.box((8.0, 8.0, 1.0))
    slope.apply_transform(trimesh.transformations.rotation_matrix(np.radians(10.0), (0.0, 1.0, 0.0)))
    slope.export(tmp_path / "slope.stl")
    height = resting_height_m(X500)
    world = world_of(boxes=[TABLE], meshes=[MeshSolid(file=tmp_path / "slope.stl", position_ned_m=(20.0, 0.0, -3.0))])
    roof = world.surface(20.0, 0.0)
    up = np.sign(world.surface(21.0, 0.0) - roof)
    fleet = Fleet([(0.0, 0.0, -2.0 - height - 0.3), (20.0, 0.0, -roof - height - 0.05)], world=world)
    fleet.state["vel_ned"][0] = (0.2, -0.1, 0.3)
    fleet.state["q_ned_from_frd"][1] = (0.0, np.sin(np.radians(up * 5.0)), 0.0, np.cos(np.radians(5.0)))
    fleet.fly(3 * SECOND)
    start = fleet.state["pos_ned"].copy()
    fleet.fly(10 * SECOND)
    assert fleet.state["is_on_ground"].tolist() == [1, 1]
    assert not fleet.state["is_crashed"].any()
    assert -fleet.state["pos_ned"][0, 2] == pytest.approx(2.0 + height, abs=1e-3)
    assert np.abs(fleet.state["pos_ned"] - start).max() < 1e-3
    assert np.abs(fleet.state["vel_ned"]).max() < 1e-3
    assert fleet.state["height_agl_m"][0] == pytest.approx(height, abs=1e-3)
    tilt = np.degrees(np.arccos(up_ned(fleet.state["q_ned_from_frd"][1]) @ (0.0, 0.0, -1.0)))
    assert tilt == pytest.approx(10.0, abs=0.3)


def test_a_vehicle_over_a_roof_s_edge_falls_off():
    """The edge is between its feet and its middle is over the void: half a vehicle does not stand in the air."""
    world = world_of(boxes=[BoxSolid(position_ned_m=(0.0, 0.0), size_m=(4.0, 4.0, 2.0))])
    fleet = Fleet([(2.06, 0.0, -2.0 - resting_height_m(X500) - 0.01)], world=world)
    fleet.fly(3 * SECOND)
    assert -fleet.state["pos_ned"][0, 2] < 1.0


def test_a_hull_is_stopped_by_sides_and_a_rotor_struck_from_below_breaks():
    world = world_of(boxes=[TABLE], cylinders=[CylinderSolid(position_ned_m=(0.0, 20.0), radius_m=1.0, height_m=6.0)])
    fleet = Fleet([(0.0, 18.0, -5.0), (0.0, 0.0, -2.4)], world=world)
    fleet.state["vel_ned"][0] = (0.0, 1.5, 0.0)
    fleet.state["q_ned_from_frd"][1] = (1.0, 0.0, 0.0, 0.0)  # upside down, over the table
    east = [fleet.fly(5)["pos_ned"][0, 1].copy() for _ in range(40)]
    hull_m = X500.contact.hull_radius_m
    assert max(east) == pytest.approx(19.0 - hull_m, abs=0.05)
    assert fleet.state["is_crashed"].tolist() == [0, 1]


def test_a_rover_drives_up_a_ramp_and_is_stopped_by_a_box(tmp_path):
    import trimesh

    corners = np.array([(0, -2, 0), (0, 2, 0), (6, -2, 1), (6, 2, 1), (12, -2, 1), (12, 2, 1), (12, -2, 0), (12, 2, 0)])
    trimesh.convex.convex_hull(corners.astype(float)).export(tmp_path / "ramp.stl")
    world = world_of(
        meshes=[MeshSolid(file=tmp_path / "ramp.stl", position_ned_m=(3.0, 0.0, 0.0))],
        boxes=[BoxSolid(position_ned_m=(13.0, 0.0, -1.0), size_m=(0.5, 4.0, 1.0))],
    )
    fleet = RoverFleet([(0.0, 0.0)], world=world)
    heights = []
    for _ in range(40):
        state = fleet.drive(0.5, (0.0, 0.3, 0.0))
        heights.append(float(-state["pos_ned"][0, 2]))
    standing = float(-RoverFleet([(0.0, 0.0)]).state["pos_ned"][0, 2])
    assert heights[-1] == pytest.approx(1.0 + standing, abs=0.03)
    assert state["is_crashed"][0] == 0
    assert 12.0 < state["pos_ned"][0, 0] < 12.75
    climbing = [h for h in heights if 0.2 < h - standing < 0.9]
    assert len(climbing) >= 2


def test_a_world_without_solids_has_none_and_pays_one_comparison():
    world = build_world(WorldConfig(size_m=100.0))
    assert (world.kernel.solids.count, world.kernel.solids.mesh) == (0, 0)
    assert world.solids.ray_hit(np.zeros(3), np.array([1.0, 0.0, 0.0]), 9.0) == 9.0


def test_all_worlds_of_a_batch_share_the_solids(tmp_path):
    config = WorldFile(size_m=80.0, trees_per_ha=50.0, meshes=[MeshSolid(file=lump(tmp_path), position_ned_m=MIDDLE)])
    batch = WorldBatch(config, 3)
    batch.grow_all(5)
    origins, dirs = rays_at(MIDDLE, 100)
    alone = build_world(config.model_copy(update={"trees_per_ha": 0.0}))
    expected = query_rays(alone, origins, dirs, 60.0)
    for k in range(3):
        shared = query_rays((batch, k), origins, dirs, 60.0)
        copied = query_rays(batch.map(k), origins, dirs, 60.0)
        np.testing.assert_array_equal(shared, copied)
        assert (shared <= expected + 1e-5).all()
        assert (shared == expected).mean() > 0.5


def test_one_vehicle_is_the_row_of_many_over_a_mesh(tmp_path):
    world = lump_world(tmp_path)
    starts = np.array([(12.0 + 0.1 * k, 7.0, -9.0) for k in range(64)])
    many = Fleet(starts, world=world)
    one = Fleet(starts[10:11], world=world)
    many.fly(2 * SECOND)
    one.fly(2 * SECOND)
    assert many.state[10].tobytes() == one.state[0].tobytes()
    assert many.state["is_on_ground"].any() or many.state["is_crashed"].any()


def test_solids_hide_what_is_behind_them_and_shade_the_ground():
    box = BoxSolid(position_ned_m=(10.0, 0.0), size_m=(4.0, 4.0, 3.0), colour="#ff0000")
    bare, seen = [
        Renderer(world_of(boxes=boxes)).images([CameraPose((0.0, 0.0, -2.0), (0.5, 0.5, 0.5, 0.5), 90.0)], 32, 32)
        for boxes in ((), (box,))
    ]
    is_box = seen.kind[0] == SOLID
    red = seen.rgb[0][is_box].astype(int)
    assert is_box[16, 16]
    assert (red[:, 0] > 2 * red[:, 1]).all()
    changed = (bare.rgb[0] != seen.rgb[0]).any(axis=-1)
    assert (changed & ~is_box).sum() > 0  # its shadow
