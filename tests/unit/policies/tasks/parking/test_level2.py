import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import policies  # noqa: F401  (registers the tasks)
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.episode import Outcome
from policies.tasks.parking.arena import (
    LEVEL2_SPOT,
    LEVEL2_SPOTS_BELOW,
    MOVER_POSITIONS,
    PORTAL_EXITS,
    PORTAL_POSITIONS,
    pose,
)

PRESETS = ("as-documented", "as-coded", "improved")
STAY, GO = (0, 0), (0, 1)
FAR_AWAY = (34.0, 500.0, 0.0, 1.0)  # where a mover is in nobody's way


def built(env_count=1, seed=0, params=None, **settings):
    task = build_task("Parking2", env_count, task_settings("Parking2", settings))
    task.set_params(params or {})
    task.reset(seed)
    return task


def act(task, *actions):
    """Steps with one action, or one per row; returns rewards."""
    task.buffers.branches.numpy()[:] = np.array(actions).reshape(-1, 2)
    task.step()
    return task.buffers.rewards.numpy().copy()


def put(task, row, *, pos=None, yaw_deg=None, vel=None, goal=None):
    """Moves car or goal of one row."""
    world = task.world
    if pos is not None:
        world.pos.numpy()[row] = pos
    if yaw_deg is not None:
        world.yaw.numpy()[row] = np.radians(yaw_deg)
    if vel is not None:
        world.vel.numpy()[row] = vel
    if goal is not None:
        world.goal.numpy()[row] = pose(goal)


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.filterwarnings("ignore:.*A Box observation space m.*infinity.*:UserWarning")
def test_it_is_a_valid_gymnasium_environment(preset):
    check_env(gymnasium.make("honeyguide/Parking2-v0", preset=preset, render_mode="rgb_array").unwrapped)


def test_presets_have_the_documented_sizes_of_observation_and_action():
    layouts = [built(preset=preset).layout for preset in PRESETS]
    assert [layout.observation_size for layout in layouts] == [6 + 29 * 3, 57 * 3, 29]
    assert [layout.branch_sizes for layout in layouts] == [(3, 2), (3, 2), (3, 3)]


def test_other_readings_of_the_ray_sensor_have_their_sizes():
    assert built(preset="as-documented", rays=7, ray_tags="wall+obstacle+goal").layout.frame_size == 6 + 75
    assert built(preset="as-documented", rays=12).layout.frame_size == 6 + 75


def test_portal_1_leads_to_storey_2_and_pays_where_the_goal_is_there():
    task = built()
    put(task, 0, pos=(-10.85, 11.3), yaw_deg=-45.0, vel=(-3.0, 3.0))
    reward = act(task, GO)
    assert task.world.pos.numpy()[0] == pytest.approx(PORTAL_EXITS[0][:2])
    assert np.degrees(task.world.yaw.numpy()[0]) == pytest.approx(45.0)
    assert task.world.vel.numpy()[0] == pytest.approx((-4.414 * 0.84, 4.414 * 0.84), rel=1e-3)
    assert reward[0] == pytest.approx(0.1, abs=0.006)
    assert act(task, STAY)[0] < 0.05


def test_a_portal_away_from_the_goal_costs():
    task = built()
    put(task, 0, pos=(57.2, -11.0), yaw_deg=-135.0, vel=(-3.0, -3.0))
    reward = act(task, GO)
    assert task.world.pos.numpy()[0] == pytest.approx(PORTAL_EXITS[1][:2])
    assert np.degrees(task.world.yaw.numpy()[0]) == pytest.approx(135.0)
    assert reward[0] == pytest.approx(-0.1, abs=0.011)


def test_as_documented_the_right_portal_pays_a_half():
    task = built(preset="as-documented")
    put(task, 0, pos=(-10.85, 11.3), yaw_deg=-45.0, vel=(-3.0, 3.0))
    assert act(task, GO)[0] == pytest.approx(0.5, abs=0.011)


def test_who_comes_out_of_a_portal_at_rest_does_not_fall_back_into_it():
    for x, z, yaw_deg in PORTAL_EXITS:
        task = built()
        put(task, 0, pos=(x, z), yaw_deg=yaw_deg, goal=(14.0, -14.0, 0.0))
        for _ in range(20):
            act(task, GO)
        assert not task.buffers.outcomes.numpy()[0]
        assert np.linalg.norm(task.world.pos.numpy()[0] - (x, z)) > 2.0


def test_movers_run_along_their_lines_at_two_metres_per_second():
    task = built()
    put(task, 0, pos=(-12.0, -12.0))
    for _ in range(25):
        act(task, STAY)
    moved = task.movers.numpy()[0, :, :2] - np.array(MOVER_POSITIONS)
    assert moved == pytest.approx(np.array([[0, 1], [-1, 0], [0, -1], [-1, 0]]), abs=1e-4)


def test_a_mover_turns_back_at_the_wall_and_at_the_other_mover():
    task = built()
    put(task, 0, pos=(-12.0, -12.0))
    task.movers.numpy()[0, :2] = [(-0.51, -6.0, 0.0, 1.0), (4.0, 0.0, -1.0, 0.0)]  # they will meet
    path = []
    for _ in range(1500):
        act(task, STAY)
        path.append(task.movers.numpy()[0].copy())
    path = np.array(path)
    assert path[:, 0, 1].min() == pytest.approx(-14.955 + 1.5, abs=0.05)
    assert path[:, 1, 0].max() == pytest.approx(14.935 - 1.5, abs=0.05)
    assert np.abs(path[:, 2, 1] - 0.03).max() < 13.6
    assert (path[:, 0, 0] == path[0, 0, 0]).all()
    turns = np.flatnonzero(np.diff(path[:, 0, 3]))
    at_wall = np.abs(path[turns, 0, 1]) > 12.0
    assert at_wall.any()
    assert not at_wall.all()  # the other mover crosses its line
    gaps = np.linalg.norm(path[turns[~at_wall], 0, :2] - path[turns[~at_wall], 1, :2], axis=-1)
    assert (gaps <= 3.0).all()


def test_a_car_that_is_run_over_has_hit_an_obstacle():
    task = built()
    put(task, 0, pos=(-0.51, 9.0))
    for _ in range(200):
        act(task, STAY)
        if task.buffers.outcomes.numpy()[0]:
            break
    assert task.buffers.outcomes.numpy()[0] == Outcome.HIT_OBSTACLE


def test_movers_run_on_through_a_crash_as_coded():
    task = built()
    before = task.movers.numpy()[0].copy()
    put(task, 0, pos=(-14.2, 0.0))
    act(task, STAY)
    act(task, STAY)
    assert task.world.pos.numpy()[0] == pytest.approx((-12.70, -10.02))
    assert np.linalg.norm(task.movers.numpy()[0, :, :2] - before[:, :2], axis=1) == pytest.approx(0.08, abs=1e-4)


def test_published_goals_are_where_the_storey_says():
    assert built().world.goal.numpy()[0, :2] == pytest.approx(LEVEL2_SPOT)
    below = built(64, storey="1", resets="clean").world.goal.numpy()[:, :2]
    assert {tuple(np.round(goal, 3)) for goal in below.tolist()} == set(LEVEL2_SPOTS_BELOW)
    both = built(512, storey="both", resets="clean").world.goal.numpy()[:, 0] > 34.0
    assert 0.4 < both.mean() < 0.6


def cells_of(positions):
    """The cells of 1 m of both storeys; places within rounding of an edge are left out."""
    local = positions - (68.86 - 68.0, 0.03) * (positions[:, :1] > 34.0)
    inside = local[(np.abs(local - np.round(local)) > 1e-4).all(axis=1)]
    return {tuple(cell) for cell in np.floor(inside).astype(int).tolist()}


def test_goals_anywhere_lie_clear_of_portals_and_of_the_start_in_disjoint_cells():
    goals = {
        split: built(4096, goals="anywhere", split=split, storey="both").world.goal.numpy()[:, :2]
        for split in ("train", "validation", "test")
    }
    train, validation, test = (cells_of(positions) for positions in goals.values())
    assert not train & test
    assert not train & validation
    assert not validation & test
    for positions in goals.values():
        for x, z, _ in (*PORTAL_POSITIONS, *PORTAL_EXITS):
            assert np.linalg.norm(positions - (x, z), axis=1).min() > 3.4


def test_improved_episodes_begin_clear_of_everything():
    task = built(2048, preset="improved")
    act(task, *[STAY] * 2048)
    assert not task.buffers.outcomes.numpy().any()
    assert (task.movers.numpy()[:, :2, 0] < 15.0).all()
    assert (task.movers.numpy()[:, 2:, 0] > 53.0).all()
    elsewhere = (task.world.pos.numpy()[:, 0] > 34.0) != (task.world.goal.numpy()[:, 0] > 34.0)
    assert 0.45 < elsewhere.mean() < 0.55


def test_progress_through_the_portal_is_the_length_of_the_route():
    task = built(reward="progress", params={"discount": 1.0, "time_reward": 0.0, "progress_per_m": 1.0})
    world = task.world
    nose = np.array([np.sin(world.yaw.numpy()[0]), np.cos(world.yaw.numpy()[0])])
    box = world.pos.numpy()[0] + 0.29 * nose
    route = np.linalg.norm(np.array(PORTAL_POSITIONS[0][:2]) - box)
    route += np.linalg.norm(np.array(LEVEL2_SPOT) - PORTAL_EXITS[0][:2])
    assert world.way_m.numpy()[0] == pytest.approx(route, rel=1e-5)
    task.movers.numpy()[0] = FAR_AWAY
    total = sum(act(task, GO)[0] for _ in range(10))
    assert total == pytest.approx(route - world.way_m.numpy()[0], abs=1e-4)


def test_the_velocity_a_tracking_sensor_would_give_is_that_of_the_movers():
    task = built(observation="ranged", stack=1)
    names = [element.name for element in task.layout.frame]
    yaw = np.radians(56.3)
    seen = task.buffers.observations.numpy()[0]
    first_right = seen[names.index("mover_z_vel_car_right")] * 10.0
    first_forward = seen[names.index("mover_z_vel_car_forward")] * 10.0
    assert (first_right, first_forward) == pytest.approx((-2.0 * np.sin(yaw), 2.0 * np.cos(yaw)), rel=1e-4)


def test_the_picture_shows_both_storeys():
    image = built(preset="as-documented").top_view(0, 240)
    assert image.shape[1] > 1.8 * image.shape[0]
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 6
