"""What Drive shows, asks for, and how its episodes end."""

import numpy as np
import pytest

from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.drive.drive_kernels import MEASURES
from policies.tasks.drive.drive_params import DriveParams
from policies.tasks.drive.observe import FRAME, SPEED_MAX_M_S
from policies.tasks.episode import Outcome
from policies.tasks.flight.flight_params import FlightParams
from sim.world.boxes import BoxesMap

NAMES = [element.name for element in FRAME]
CALM = {"wind_m_s": 0.0, "wind_gust_m_s": 0.0, "hill_height_m": 0.0, "mover_count": 0.0}
OPEN = CALM | {"wall_count": 0.0, "trees_per_ha": 0.0}


def built(preset, env_count=4, seed=0, numbers=None, **settings):
    task = build_task("Drive", env_count, task_settings("Drive", {"preset": preset, "has_estimator": False} | settings))
    task.set_params(numbers or {})
    task.reset(seed)
    return task


def shown(task):
    """The newest frame of each row by the names of its elements."""
    newest = task.buffers.observations.numpy()[:, -len(FRAME) :]
    return dict(zip(NAMES, newest.T, strict=True))


def driven(task, speed, yaw_rate, steps):
    for _ in range(steps):
        task.buffers.continuous.fill_(0.0)
        task.buffers.continuous.numpy()[:] = (speed, yaw_rate)
        task.step()


def poses(task):
    truth = task.rig.rows["truth"]
    x, y, z, w = truth["q_ned_from_frd"].T
    return np.column_stack([truth["pos_ned"][:, :2], np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))])


def test_parameters_are_declared_in_the_order_of_their_structs():
    task = built("park", 1)
    assert task.param_table.names == [*FlightParams.vars, *DriveParams.vars]


@pytest.fixture(scope="module")
def open_ground():
    return built("reach", 8, numbers=OPEN)


def test_an_action_is_a_signed_fraction_of_speed_and_of_yaw_rate(open_ground):
    open_ground.reset(1)
    before = poses(open_ground)
    driven(open_ground, 0.5, 0.2, 20)
    seen = shown(open_ground)
    assert seen["speed"] == pytest.approx(0.5, abs=0.05)
    assert seen["yaw_rate"] == pytest.approx(0.2, abs=0.05)
    assert seen["last_speed_sp"] == pytest.approx(0.5)
    turned = np.angle(np.exp(1j * (poses(open_ground) - before)[:, 2]))
    assert np.all(turned > 0.2)  # to the right
    driven(open_ground, -0.5, 0.0, 30)
    assert shown(open_ground)["speed"] == pytest.approx(-0.5, abs=0.05)
    driven(open_ground, 0.02, 0.0, 30)  # hardly any: it stands
    assert np.abs(shown(open_ground)["speed"] * SPEED_MAX_M_S).max() < 0.02


def test_the_goal_is_shown_ahead_and_to_the_right_of_the_nose(open_ground):
    open_ground.reset(2)
    seen, at, goal = shown(open_ground), poses(open_ground), open_ground.driving.goals.numpy()
    way = goal[:, :2] - at[:, :2]
    distance = np.hypot(*way.T)
    assert np.all((distance > 4.9) & (distance < 31.0))
    bearing = np.arctan2(way[:, 1], way[:, 0]) - at[:, 2]
    assert seen["goal_dir_hfrd_x"] == pytest.approx(np.cos(bearing), abs=1e-3)
    assert seen["goal_dir_hfrd_y"] == pytest.approx(np.sin(bearing), abs=1e-3)
    assert seen["goal_distance"] * 30.0 == pytest.approx(distance, abs=1e-2)
    assert seen["goal_heading_sin"] == pytest.approx(np.sin(goal[:, 2] - at[:, 2]), abs=1e-3)


def test_standing_at_the_goal_with_its_heading_is_success_and_elsewhere_it_is_none(open_ground):
    open_ground.reset(3)
    at = poses(open_ground)
    goals = open_ground.driving.goals.numpy()
    goals[:] = at
    goals[1, 0] += 0.4  # too far
    goals[2, 2] += 0.3  # turned too far
    driven(open_ground, 0.0, 0.0, 1)
    outcomes = open_ground.buffers.outcomes.numpy()
    assert outcomes[1] == outcomes[2] == Outcome.RUNNING
    assert np.all(np.delete(outcomes, [1, 2]) == Outcome.SUCCESS)


def test_passing_the_goal_at_speed_is_not_arriving(open_ground):
    open_ground.reset(4)
    driven(open_ground, 0.5, 0.0, 15)
    open_ground.driving.goals.numpy()[:] = poses(open_ground)
    driven(open_ground, 0.5, 0.0, 1)
    assert np.all(open_ground.buffers.outcomes.numpy() == Outcome.RUNNING)


def test_progress_along_the_way_is_paid(open_ground):
    open_ground.reset(5)
    driven(open_ground, 0.5, 0.0, 10)
    before = open_ground.driving.left_m.numpy().copy()
    driven(open_ground, 0.5, 0.0, 1)
    progress = before - open_ground.driving.left_m.numpy()
    rewards = open_ground.buffers.rewards.numpy()
    assert rewards == pytest.approx(2.0 * progress - 0.03, abs=0.02)
    assert np.all(np.abs(progress) < 0.5)


def test_driving_on_ends_at_a_wall_or_a_car_and_costs():
    task = built("park", 64, numbers=CALM)
    returns = []
    for _ in range(120):
        driven(task, 0.6, 0.0, 1)
        hit = task.buffers.outcomes.numpy() == Outcome.HIT_OBSTACLE
        returns += task.buffers.rewards.numpy()[hit].tolist()
    assert len(returns) > 2
    assert max(returns) < -3.0


@pytest.mark.parametrize("split", ["train", "test"])
def test_every_goal_of_a_car_park_is_a_free_spot_along_which_it_points(split):
    task = built("park", 24, split=split, numbers=CALM)
    goals, outs = task.driving.goals.numpy(), task.driving.outs.numpy()
    assert {-1.0, 1.0} == set(outs.tolist())
    for i in range(24):
        world = task.worlds.map(i)
        standing = BoxesMap(world.boxes.rows[world.boxes.rows["period_ticks"] == 0])

        def room(ahead, i=i, world=world, standing=standing):
            north, east = goals[i, :2] + ahead * np.array([np.cos(goals[i, 2]), np.sin(goals[i, 2])])
            return standing.distance(np.array([[north, east, -world.height(north, east) - 0.1]]))[0]

        assert room(0.0) > 0.4
        assert room(outs[i] * 1.6) > 0.4  # before the spot, in the aisle
        assert room(-outs[i] * 0.75) < 0.1  # the wall behind it


def test_training_validation_and_test_worlds_have_no_seed_in_common():
    for split, divisor, left in (("train", 4, 0), ("validation", 4, 2), ("test", 2, 1)):
        assert np.all(built("park", 24, split=split).world_seeds.numpy() % divisor == left)


def test_a_goal_of_the_course_has_room_on_ground_that_is_not_steep():
    task = built("reach", 24)
    goals = task.driving.goals.numpy()
    for i in range(24):
        world = task.worlds.map(i)
        north, east = goals[i, :2]
        assert -world.normal_ned(north, east)[2] > np.cos(np.radians(10.1))
        standing = BoxesMap(world.boxes.rows[world.boxes.rows["period_ticks"] == 0])
        assert standing.distance(np.array([[north, east, -world.height(north, east) - 0.25]]))[0] > 1.0


def test_measures_are_the_truth():
    task = built("park", 4)
    driven(task, 0.3, 0.0, 5)
    measures = dict(zip(MEASURES, task.measures.numpy().T, strict=True))
    at, goals = poses(task), task.driving.goals.numpy()
    running = task.buffers.outcomes.numpy() == Outcome.RUNNING
    assert measures["distance_m"][running] == pytest.approx(np.hypot(*(goals - at).T[:2])[running], abs=1e-3)
    assert np.all(measures["room_m"] <= 1.0)


def test_with_the_estimator_it_stands_where_it_believes_to_stand():
    task = built("park", 8, has_estimator=True, numbers={"sensor_noise": 1.0})
    driven(task, 0.0, 0.0, 10)
    seen, at, goal = shown(task), poses(task), task.driving.goals.numpy()
    distance = np.hypot(*(goal - at).T[:2])
    assert seen["goal_distance"] * 30.0 == pytest.approx(distance, abs=0.15)
    assert np.abs(seen["speed"]).max() < 0.05
