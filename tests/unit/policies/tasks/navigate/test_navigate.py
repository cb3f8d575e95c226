"""Navigate: laws of its episodes, what its rangefinder tells, what it pays and how it ends."""

import math
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from numpy.typing import NDArray

from common.range_sectors import RANGE_M, SECTORS
from policies.tasks.catalogue import UnknownTask, build_task, task_settings
from policies.tasks.episode import Outcome
from policies.tasks.navigate.navigate import Navigate
from policies.tasks.navigate.navigate_kernels import MEASURES
from sim.sensors.scanner import BAND_M

QUICK = {"has_estimator": "false"}
DEPTH = {"observation": "depth", "image_size": "8"}


def _task(count: int, seed: int = 5, params: dict[str, float] | None = None, **settings: Any) -> Navigate:
    task = build_task("Navigate", count, task_settings("Navigate", settings))
    assert isinstance(task, Navigate)
    task.set_params(params or {})
    task.reset(seed)
    return task


def _fly(task: Navigate, decisions: int, seed: int = 0) -> None:
    """The same gentle actions for a row, whatever the batch."""
    actions = np.random.default_rng(seed).uniform(-0.3, 0.3, (decisions, 4)).astype(np.float32)
    for action in actions:
        task.buffers.continuous.assign(np.tile(action, (task.env_count, 1)))
        task.step()


def _bytes(rows: NDArray[Any]) -> bytes:
    """Without the padding of structs, which NumPy does not copy."""
    if rows.dtype.names is None:
        return rows.tobytes()
    return b"".join(_bytes(rows[name]) for name in rows.dtype.names)


@pytest.mark.parametrize("settings", [{}, DEPTH])
def test_single_environment_is_the_first_row_of_a_batch(settings: dict[str, str]) -> None:
    one, many = _task(1, **settings), _task(3, **settings)
    _fly(one, 4)
    _fly(many, 4)
    for name in ("observations", "images", "rewards"):
        assert getattr(one.buffers, name).numpy()[0].tobytes() == getattr(many.buffers, name).numpy()[0].tobytes(), name


def test_same_seed_gives_the_same_bytes_and_another_seed_others() -> None:
    first, second = _task(2), _task(2)
    second.reset(6)
    other = second.buffers.observations.numpy().copy()
    second.reset(5)
    _fly(first, 3)
    _fly(second, 3)
    assert first.buffers.observations.numpy().tobytes() == second.buffers.observations.numpy().tobytes()
    assert not np.array_equal(other, first.buffers.observations.numpy())


def test_beginning_one_row_touches_only_that_row() -> None:
    task = _task(3)
    _fly(task, 2)
    before = task.state()
    task.begin(np.array([False, True, False]))
    after = task.state()
    masks = {"is_starting", "is_growing"}
    per_row = [name for name, rows in before.items() if rows.shape[:1] == (3,) and name not in masks]
    assert {"observations", "goals_ned", "ranges_m", "rig2", "world_seeds"} <= set(per_row)
    for name in per_row:
        for row in (0, 2):
            assert _bytes(before[name][row]) == _bytes(after[name][row]), name
    for name in ("observations", "goals_ned", "world_seeds"):
        assert _bytes(before[name][1]) != _bytes(after[name][1]), name


def test_restored_state_continues_bit_for_bit() -> None:
    params = {"slowest_m_s": 20.0, "goal_min_m": 10.0, "goal_max_m": 10.0}  # so that episodes begin in between
    task = _task(2, params=params)
    _fly(task, 4)
    kept = task.state()
    _fly(task, 4, seed=1)
    other = _task(2, seed=9, params=params)
    other.load_state(kept)
    _fly(other, 4, seed=1)
    restored = other.state()
    assert task.buffers.episodes.numpy().min() > 1
    for name, rows in task.state().items():
        assert _bytes(rows) == _bytes(restored[name]), name


def test_observation_does_not_change_when_the_truth_does() -> None:
    task = _task(2)
    _fly(task, 8)
    task.is_starting.fill_(value=True)

    def shown() -> bytes:
        task._show.launch()  # writes the vector anew
        return bytes(task.buffers.observations.numpy().tobytes())

    shown()  # fills both frames of the stack
    before = shown()
    task.rig.truth.zero_()
    assert shown() == before


def test_sectors_tell_the_nearest_that_a_fan_of_fine_rays_meets() -> None:
    task = _task(4, params={"range_noise": 0.0, "hill_height_m": 0.0}, **QUICK)  # levelled by the truth
    ranges_m = task.navigation.ranges_m.numpy()
    bodies = task.rig.rows["truth"]
    for row, body in enumerate(bodies):
        x, y, z, w = (float(value) for value in body["q_ned_from_frd"])
        heading = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        world = task.worlds.map(row)
        for k in range(SECTORS):
            reported = float(ranges_m[row, k])
            fan = np.radians(np.linspace(5 * k - 119.99, 5 * k - 115.01, 40)) + heading
            north, east = np.cos(fan), np.sin(fan)
            met = [
                world.ray_hit(body["pos_ned"] + np.array([0.0, 0.0, up]), np.array([n, e, 0.0]), RANGE_M)
                for n, e in zip(north, east, strict=True)
                for up in (-BAND_M, BAND_M)
            ]
            assert reported <= min(met) + 1e-3
            assert reported > min(met) - 0.25 or min(met) == RANGE_M  # a crown's edge between the rays


def test_goal_is_told_by_estimate_in_the_heading_frame() -> None:
    task = _task(3, **QUICK)
    names = [element.name for element in task.layout.frame]
    frame = task.buffers.observations.numpy()[:, task.layout.frame_size :]
    seen = {name: frame[:, k] for k, name in enumerate(names)}
    bodies = task.rig.rows["truth"]
    way = task.navigation.goals_ned.numpy() - bodies["pos_ned"]
    x, y, z, w = bodies["q_ned_from_frd"].T
    heading = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    bearing = np.arctan2(way[:, 1], way[:, 0]) - heading
    np.testing.assert_allclose(seen["goal_dir_hfrd_x"], np.cos(bearing), atol=1e-4)
    np.testing.assert_allclose(seen["goal_dir_hfrd_y"], np.sin(bearing), atol=1e-4)
    np.testing.assert_allclose(100.0 * seen["goal_distance"], np.hypot(way[:, 0], way[:, 1]), rtol=1e-4)


def test_progress_is_paid_up_to_the_wanted_speed_only() -> None:
    costs = ("time_cost", "clearance_cost", "height_cost", "heading_cost", "jerk_cost", "turn_cost")
    free = dict.fromkeys(costs, 0.0) | {"trees_per_ha": 0.0, "wind_m_s": 0.0, "speed_m_s": 2.0}
    task = _task(1, params=free | {"progress_reward": 0.1}, **QUICK)
    frame = task.buffers.observations.numpy()[0, task.layout.frame_size :]
    seen = dict(zip((element.name for element in task.layout.frame), frame, strict=True))
    ahead = 0.9 * np.array([seen["goal_dir_hfrd_x"], seen["goal_dir_hfrd_y"], 0.0, 0.0])
    for _ in range(25):
        before = float(task.measures.numpy()[0, 0])
        task.buffers.continuous.assign(ahead[None].astype(np.float32))
        task.step()
        progress = before - float(task.measures.numpy()[0, 0])
    assert progress > 0.3
    assert float(task.buffers.rewards.numpy()[0]) == pytest.approx(0.1 * 2.0 * 0.1, rel=1e-3)


def _end(params: dict[str, float], action: tuple[float, ...], decisions: int = 60) -> Outcome:
    task = _task(1, params=params | {"wind_m_s": 0.0, "wind_gust_m_s": 0.0}, **QUICK)
    for _ in range(decisions):
        task.buffers.continuous.assign(np.array([action], dtype=np.float32))
        task.step()
        if task.buffers.outcomes.numpy()[0]:
            return Outcome(int(task.buffers.outcomes.numpy()[0]))
    return Outcome.RUNNING


def test_episodes_end_at_the_goal_at_a_tree_over_the_forest_and_in_time() -> None:
    near = {"goal_min_m": 10.0, "goal_max_m": 10.0}
    assert _end(near | {"goal_radius_m": 20.0}, (0.0, 0.0, 0.0, 0.0)) is Outcome.SUCCESS
    assert _end({}, (0.0, 0.0, 0.5, 0.0)) is Outcome.HIT_OBSTACLE
    assert _end({"trees_per_ha": 0.0}, (0.0, 0.0, -1.0, 0.0)) is Outcome.LOST
    assert _end(near | {"slowest_m_s": 5.0}, (0.0, 0.0, 0.0, 0.0)) is Outcome.TIMEOUT


def test_only_running_out_of_time_is_a_truncation() -> None:
    task = _task(1, params={"goal_min_m": 10.0, "goal_max_m": 10.0, "goal_radius_m": 20.0}, **QUICK)
    task.step()
    buffers = task.buffers
    assert (bool(buffers.is_truncated.numpy()[0]), bool(buffers.is_terminated.numpy()[0])) == (False, True)
    assert task.take_scores().count(Outcome.SUCCESS) == 1


def test_measures_are_the_truth_about_the_way() -> None:
    task = _task(2, **QUICK)
    _fly(task, 5)
    measures = dict(zip(MEASURES, task.measures.numpy().T, strict=True))
    pos_ned = task.rig.rows["truth"]["pos_ned"]
    goals_ned = task.navigation.goals_ned.numpy()
    np.testing.assert_allclose(measures["distance_m"], np.linalg.norm(goals_ned - pos_ned, axis=1), rtol=1e-5)
    np.testing.assert_allclose(measures["time_s"], 0.5, rtol=1e-5)
    assert (measures["start_distance_m"] > 55.0).all()


def test_training_validation_and_test_episodes_draw_from_disjoint_worlds() -> None:
    for split, divisor, left in (("train", 4, 0), ("validation", 4, 2), ("test", 2, 1)):
        task = _task(6, split=split, **QUICK)
        for seeds in (task.world_seeds, task.noise_seeds):
            assert (seeds.numpy() % divisor == left).all()
            assert len(set(seeds.numpy().tolist())) == 6


def test_forests_last_as_many_episodes_as_asked_for_each_with_a_goal_of_its_own() -> None:
    everyone = np.ones(2, dtype=np.bool_)
    task = _task(2, params={"episodes_per_world": 2.0}, **QUICK)
    seeds, goals = [], []
    for _ in range(3):
        seeds.append(task.world_seeds.numpy().copy())
        goals.append(task.navigation.goals_ned.numpy().copy())
        task.begin(everyone)
    assert (seeds[0] == seeds[1]).all()
    assert (seeds[1] != seeds[2]).all()
    assert not np.array_equal(goals[0], goals[1])


@pytest.mark.filterwarnings("ignore:.*Box observation space m:UserWarning")  # bounds of floats are infinite here
@pytest.mark.parametrize("settings", [{}, {"observation": "depth", "image_size": 8}])
def test_gymnasium_accepts_the_environment(settings: dict[str, Any]) -> None:
    check_env(gymnasium.make("policies:honeyguide/Navigate-v0", render_mode="rgb_array", **settings).unwrapped)


def test_unknown_preset_is_refused_in_one_sentence() -> None:
    with pytest.raises(UnknownTask, match="Navigate: preset: must be"):
        task_settings("Navigate", {"preset": "as-documented"})
