"""What a rover's hull does at walls, trunks, kerbs and things as thin as the end of a wall."""

import numpy as np
import pytest

from common.airframe import load_airframe
from sim.bodies.rover_model import rover_model
from sim.world.boxes import BoxesMap, box_type
from sim.world.world import WorldConfig, WorldMap, build_world
from tests.unit.sim.rover_fleet import FLAT, RoverFleet, nose_ned

STAND = (0.0, 0.0, 1.0)
ROVER = load_airframe("rover")
SIDE_M, NOSE_M = ROVER.hull.half_width_m, ROVER.hull.front_m
AHEAD_M = 2.0  # from the bumper to the obstacle at first


def with_boxes(*boxes):
    """A plain with boxes of (north, east, half length, half width, height)."""
    rows = [(north, east, 1.0, 0.0, long, wide, -1.0, high, 0.0, 0, 0) for north, east, long, wide, high in boxes]
    bare = build_world(FLAT)
    placed = BoxesMap(np.array(rows, dtype=box_type()))
    kernel = bare.kernel
    kernel.boxes = placed.kernel("cpu")
    return WorldMap(FLAT, bare.terrain, bare.forest, bare.walls, kernel, placed)


def thin_at(east):
    """A pole of 6 cm ahead."""
    return with_boxes((NOSE_M + AHEAD_M + 0.03, east, 0.03, 0.03, 1.0))


def run_into(world, speed, yaw=0.0, start=(0.0, 0.0), seconds=2.5, turned=0.0, model=None):
    """The fleet after a rover ran freely into something at a speed, and the deepest that its box got into it [m].

    Args:
        turned: how far its nose is off its way [rad].
    """
    model = model or rover_model(ROVER, 0.0)
    model.motor_n_s_m = 0.0
    fleet = RoverFleet([start], model, world=world, yaws=yaw + turned)
    fleet.drive(0.5, STAND)
    row = fleet.state[0]
    row["vel_ned"] = speed * np.array([np.cos(yaw), np.sin(yaw), 0.0])
    row["wheel_speed"] = speed / ROVER.wheels.radius_m * np.cos(turned)
    deepest = 0.0
    for _ in range(round(seconds * 50)):
        fleet.drive(0.02, (0.0, 0.0, 0.0))
        if row["impact_speed"] > 0.0:
            deepest = max(deepest, depth_of(world, row))
    return fleet, deepest


def depth_of(world, row):
    """How deep an obstacle is inside the vehicle's box, seen from above at the height of its hubs [m]."""
    ahead = np.linspace(-ROVER.hull.rear_m, ROVER.hull.front_m, 75)
    right = np.linspace(-SIDE_M, SIDE_M, 45)
    x, y = (grid.ravel() for grid in np.meshgrid(ahead, right))
    inset = np.minimum.reduce([ROVER.hull.front_m - x, x + ROVER.hull.rear_m, SIDE_M - np.abs(y)])
    nose = nose_ned(row["q_ned_from_frd"])[:2]
    nose = nose / np.linalg.norm(nose)
    north = row["pos_ned"][0] + nose[0] * x - nose[1] * y
    east = row["pos_ned"][1] + nose[1] * x + nose[0] * y
    down = np.full_like(north, row["pos_ned"][2] + ROVER.wheels.hub_z_m)
    gap = world.obstacle_distance(np.column_stack([north, east, down]))
    return float(inset[gap <= 0.0].max(initial=0.0))


@pytest.mark.parametrize("east", [0.0, 0.04, 0.08, 0.12, 0.165, 0.2])
@pytest.mark.parametrize("speed", [1.5, 3.0, 6.0])
def test_a_pole_stops_it_wherever_it_hits_the_bumper(east, speed):
    fleet, deepest = run_into(thin_at(east), speed)
    assert fleet.state["impact_speed"][0] > 0.2 * speed
    assert deepest < 0.03 + 0.012 * speed


@pytest.mark.parametrize("ahead", [-0.25, -0.1, 0.0, 0.05, 0.2, 0.3])
def test_a_pole_stops_it_wherever_it_hits_its_side(ahead):
    """It slides sideways into it."""
    pole = with_boxes((ahead, SIDE_M + 0.5, 0.03, 0.03, 1.0))
    fleet, deepest = run_into(pole, 4.0, yaw=0.5 * np.pi, turned=-0.5 * np.pi)
    assert fleet.state["impact_speed"][0] > 0.5
    assert deepest < 0.08


@pytest.mark.parametrize("east", [-0.15, -0.08, 0.0, 0.1])
def test_the_end_of_a_wall_stops_it(east):
    """As between the spots of a car park: 6 cm thick."""
    long = 0.55
    fleet, deepest = run_into(with_boxes((NOSE_M + AHEAD_M + long, east, long, 0.03, 0.5)), 2.0)
    assert deepest < 0.05
    assert fleet.state["pos_ned"][0, 0] < AHEAD_M + 0.06


@pytest.mark.parametrize("high", [0.12, 0.5])
def test_a_kerb_stops_it(high):
    fleet, deepest = run_into(with_boxes((NOSE_M + AHEAD_M + 0.5, 0.0, 0.5, 3.0, high)), 2.0)
    assert fleet.state["pos_ned"][0, 0] < AHEAD_M + 0.03
    assert deepest < 0.05
    assert fleet.state["is_crashed"][0] == 0


FOREST = WorldConfig(size_m=100.0, hill_height_m=0.0, trees_per_ha=40.0, clearing_radius_m=5.0)


@pytest.fixture(scope="module")
def forest():
    return build_world(FOREST)


@pytest.mark.parametrize("off", [0.0, 0.1, 0.2, -0.15])
@pytest.mark.parametrize("speed", [2.0, 6.0])
def test_a_trunk_stops_it_and_breaks_it_if_it_is_fast(forest, off, speed):
    tree = forest.forest.trees[np.argmin(forest.forest.trees["trunk_radius"])]
    start = (tree["north"] - 2.0, tree["east"] + off)
    fleet, deepest = run_into(forest, speed, start=start)
    assert fleet.state["impact_speed"][0] > 0.4 * speed
    assert deepest < 0.03 + 0.012 * speed
    if off == 0.0:
        assert fleet.state["is_crashed"][0] == (speed > ROVER.hull.crash_speed_m_s)
        assert fleet.state["pos_ned"][0, 0] < tree["north"] - NOSE_M


def test_a_glancing_blow_turns_it_off():
    """A pole that the right corner of the bumper brushes turns the nose to the right."""
    right, _ = run_into(thin_at(0.21), 2.0, seconds=1.3)
    left, _ = run_into(thin_at(-0.21), 2.0, seconds=1.3)
    turn = [nose_ned(fleet.state[0]["q_ned_from_frd"])[1] for fleet in (right, left)]
    assert turn[0] > 0.05
    assert turn[1] == pytest.approx(-turn[0], abs=0.02)


def test_a_wall_is_no_softer_where_points_of_the_hull_lie_side_by_side():
    wall = with_boxes((NOSE_M + AHEAD_M + 0.5, 0.0, 0.5, 3.0, 1.0))
    for turned in (0.0, 0.2, 0.8, 1.5):
        _, deepest = run_into(wall, 4.0, turned=turned)
        assert deepest < 0.08, turned


def test_no_blow_adds_energy():
    for turned in (0.0, 0.3, 1.0):
        fleet, _ = run_into(thin_at(0.1), 3.0, turned=turned, seconds=1.5)
        row = fleet.state[0]
        spin = 0.5 * ROVER.body.inertia_zz_kg_m2 * float(row["omega_frd"][2]) ** 2
        assert 0.5 * ROVER.body.mass_kg * float(np.dot(row["vel_ned"], row["vel_ned"])) + spin < 0.5 * 10.0 * 9.2
