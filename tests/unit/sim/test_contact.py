"""Landing, resting, tipping over and crashing."""

import numpy as np
import pytest

from common.airframe import load_airframe
from common.geodesy import GRAVITY_M_S2
from common.kernels import TICK_S
from sim.bodies.contact import resting_height_m
from sim.bodies.multirotor_model import multirotor_model
from sim.world.world import WorldConfig, build_world
from tests.unit.sim.fleet import Fleet, rotated

AIRFRAMES = ["x500", "f450"]
SECOND = round(1.0 / TICK_S)


def fleet_of(name, pos_ned, **more):
    return Fleet(pos_ned, models=multirotor_model(load_airframe(name)), **more)


def align_with(q_ned_from_frd, normal_ned):
    """Least turn that stands the vehicle on a slope."""
    up = np.array([0.0, 0.0, -1.0])
    q = np.append(np.cross(up, normal_ned), 1.0 + up @ normal_ned)
    q_ned_from_frd[:] = q / np.linalg.norm(q)


@pytest.mark.parametrize("name", AIRFRAMES)
def test_a_landing_ends_at_rest_on_the_feet(name):
    height = resting_height_m(load_airframe(name))
    fleet = fleet_of(name, [0.0, 0.0, -height - 0.3])
    fleet.state["vel_ned"] = [0.5, -0.3, 0.5]
    fleet.fly(2 * SECOND)
    start = fleet.state["pos_ned"].copy()
    rest = fleet.history(4 * SECOND)
    assert fleet.state["is_on_ground"][0] == 1
    assert fleet.state["is_crashed"][0] == 0
    assert fleet.state["pos_ned"][0, 2] == pytest.approx(-height, abs=1e-4)
    assert np.abs(rest["pos_ned"] - start).max() < 1e-4
    assert np.abs(rest["vel_ned"]).max() < 1e-4
    np.testing.assert_allclose(rest["accel_frd"][:, 0, 2], -GRAVITY_M_S2, atol=2e-3)
    assert np.abs(rest["accel_frd"][:, 0, :2]).max() < 5e-3  # level to within the tilt left by the slide
    assert np.abs(rest["gyro_frd"]).max() < 1e-4


@pytest.mark.parametrize("name", AIRFRAMES)
def test_a_vehicle_does_not_creep_down_a_slope_far_from_home(name):
    world = build_world(WorldConfig(hill_height_m=60.0, trees_per_ha=0.0))
    points = np.random.default_rng(0).uniform(-400.0, 400.0, (4000, 2))
    tilt = np.degrees(np.arccos(-world.normal_ned(points[:, 0], points[:, 1])[:, 2]))
    points = points[(tilt > 10.0) & (tilt < 15.0)][:16]
    assert len(points) == 16
    normal = world.normal_ned(points[:, 0], points[:, 1])
    ground = np.column_stack([points, -world.height(points[:, 0], points[:, 1])])
    fleet = fleet_of(name, ground + normal * resting_height_m(load_airframe(name)), world=world)
    for row, up in zip(fleet.state, normal, strict=True):
        align_with(row["q_ned_from_frd"], up)
    fleet.fly(2 * SECOND)
    start = fleet.state["pos_ned"].copy()
    fleet.fly(20 * SECOND)
    assert not fleet.state["is_crashed"].any()
    assert np.abs(fleet.state["pos_ned"] - start).max() < 2e-3
    assert np.abs(fleet.state["vel_ned"]).max() < 2e-3
    np.testing.assert_allclose(np.linalg.norm(fleet.state["accel_frd"], axis=1), GRAVITY_M_S2, rtol=5e-3)


@pytest.mark.parametrize("name", AIRFRAMES)
def test_landing_sideways_too_fast_tips_over(name):
    height = resting_height_m(load_airframe(name))
    speeds = np.array([[0.0, 0.3, 0.5], [0.0, 6.0, 0.5]])
    fleet = fleet_of(name, np.tile([0.0, 0.0, -height - 0.05], (2, 1)))
    fleet.state["vel_ned"] = speeds
    fleet.fly(5 * SECOND)
    upright = rotated(fleet.state["q_ned_from_frd"], [0.0, 0.0, 1.0])[:, 2]
    assert upright[0] > 0.999
    assert upright[1] < 0.8
    assert list(fleet.state["is_crashed"]) == [0, 1]


@pytest.mark.parametrize("name", AIRFRAMES)
def test_a_vehicle_on_its_back_rests_on_its_rotors(name):
    fleet = fleet_of(name, [0.0, 0.0, -0.3])
    fleet.state["q_ned_from_frd"] = [1.0, 0.0, 0.0, 0.0]
    fleet.fly(5 * SECOND)
    assert -fleet.state["pos_ned"][0, 2] == pytest.approx(fleet.model.rotor_height_m, abs=0.005)
    assert np.abs(fleet.state["vel_ned"]).max() < 1e-3
    np.testing.assert_allclose(fleet.state["accel_frd"][0], [0.0, 0.0, GRAVITY_M_S2], atol=0.02)


def test_an_impact_above_the_crash_speed_stops_the_motors_for_good():
    fleet = fleet_of("x500", [[0.0, 0.0, -3.0], [0.0, 0.0, -0.6]])
    fleet.fly(2 * SECOND)
    assert list(fleet.state["is_crashed"]) == [1, 0]
    assert fleet.state["impact_speed"][0] > fleet.model.contact.crash_speed_m_s
    fleet.fly(SECOND // 2, command=1.0)
    assert fleet.state["rotor_speed"][0].max() < 1.0
    assert -fleet.state["pos_ned"][0, 2] < 0.3
    assert -fleet.state["pos_ned"][1, 2] > 1.0


def test_impact_speed_is_that_of_the_fall():
    height = resting_height_m(load_airframe("x500"))
    fleet = fleet_of("x500", [0.0, 0.0, -height - 0.2])
    fleet.fly(SECOND)
    assert fleet.state["impact_speed"][0] == pytest.approx(np.sqrt(2 * GRAVITY_M_S2 * 0.2), rel=0.02)


def test_a_wall_stops_a_vehicle_and_a_slow_touch_does_not_crash_it():
    world = build_world(WorldConfig(size_m=100.0, hill_height_m=0.0, trees_per_ha=0.0, has_walls=True))
    fleet = fleet_of("x500", np.tile([49.0, 0.0, -4.0], (2, 1)), world=world)
    fleet.state["vel_ned"] = [[1.0, 0.0, -4.0], [6.0, 0.0, -4.0]]
    path = fleet.history(round(0.9 * SECOND))
    gap = world.obstacle_distance(path["pos_ned"].astype(float))
    assert gap[-1].min() > fleet.model.contact.hull_radius_m - 0.01
    assert gap.min() > 0.25  # the sphere yields 2 % of a second's way
    assert path["vel_ned"][-1, :, 0].max() < 0.05
    assert list(path["is_crashed"][-1]) == [0, 1]


def test_a_trunk_stops_a_vehicle_and_a_slow_touch_does_not_crash_it():
    world = build_world(WorldConfig(size_m=200.0, hill_height_m=0.0, clearing_radius_m=0.0))
    tree = world.trees[np.argmin(np.hypot(world.trees["north"], world.trees["east"]))]
    start = np.array([tree["north"] - tree["trunk_radius"] - 0.6, tree["east"], -0.5 * (tree["crown_low"] + 1.0)])
    fleet = fleet_of("x500", np.tile(start, (2, 1)), world=world)
    fleet.state["vel_ned"] = [[1.0, 0.0, -1.0], [7.0, 0.0, -1.0]]
    path = fleet.history(SECOND // 2)
    assert path["pos_ned"][:, :, 0].max() < tree["north"] - tree["trunk_radius"]
    assert list(path["is_crashed"][-1]) == [0, 1]
    assert path["vel_ned"][-1, :, 0].max() < 0.05


def test_a_turning_rotor_that_strikes_the_ground_breaks():
    fleet = fleet_of("x500", [0.0, 0.0, -0.35])
    fleet.state["q_ned_from_frd"] = [np.sin(0.5), 0.0, 0.0, np.cos(0.5)]
    fleet.state["rotor_speed"][:, :4] = 600.0
    fleet.fly(SECOND // 4, command=0.6)
    assert fleet.state["is_crashed"][0] == 1
