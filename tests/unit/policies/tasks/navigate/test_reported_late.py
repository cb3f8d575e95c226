"""Navigate: ranges that come late, and an attitude that is told with an error."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from common.range_sectors import RANGE_M, RANGES
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.navigate.navigate import Navigate
from tests.unit.policies.tasks.flight.moving import moved, pose_of

CALM = {"wind_m_s": 0.0, "wind_gust_m_s": 0.0}


def _task(params: dict[str, float], name: str = "Navigate", count: int = 2) -> Navigate:
    task = build_task(name, count, task_settings(name, {"has_estimator": "false"}))
    assert isinstance(task, Navigate)
    task.set_params(params)
    task.reset(5)
    return task


def _flown(task: Navigate, decisions: int) -> list[dict[str, NDArray[Any]]]:
    """What is shown and what was measured, at first and after each decision; the same gentle actions for all."""
    seen = []
    for action in (None, *np.random.default_rng(1).uniform(-0.3, 0.3, (decisions, 4)).astype(np.float32)):
        if action is not None:
            task.buffers.continuous.assign(np.tile(action, (task.env_count, 1)))
            task.step()
        state = task.navigation
        seen.append(
            {
                "observation": task.buffers.observations.numpy().copy(),
                "measured_m": state.scans_m.numpy()[:, 0].copy(),
                "shown_m": state.ranges_m.numpy().copy(),
                "poses": np.array([pose_of(row) for row in task.rig.rows["truth"]]),
            }
        )
    return seen


@pytest.mark.parametrize("name", ["Navigate", "NavigateRover"])
@pytest.mark.parametrize(("lag_s", "late"), [(0.0, 0), (0.1, 1), (0.2, 2), (0.3, 3)])
def test_policy_sees_the_scan_of_so_many_decisions_ago_from_where_it_is_and_all_else_of_now(
    name: str, lag_s: float, late: int
) -> None:
    fresh, lagged = _flown(_task({}, name), 6), _flown(_task({"scan_lag_s": lag_s}, name), 6)
    for k in range(len(fresh)):
        ago = max(k - late, 0)  # the first scan is shown until another comes
        assert np.array_equal(lagged[k]["measured_m"], fresh[k]["measured_m"])
        for i in range(2):
            was, now = fresh[ago]["poses"][i], fresh[k]["poses"][i]
            expected = moved(fresh[ago]["measured_m"][i], was, now)
            np.testing.assert_allclose(lagged[k]["shown_m"][i], expected, atol=1e-3)
        own_now, own_lagged = (seen[k]["observation"][:, -RANGES - 17 : -RANGES] for seen in (fresh, lagged))
        assert np.array_equal(own_now, own_lagged)
        nearness = 1.0 - lagged[k]["shown_m"] / RANGE_M
        np.testing.assert_allclose(lagged[k]["observation"][:, -RANGES:], nearness, atol=1e-6)
    assert np.abs(np.diff([seen["poses"] for seen in fresh], axis=0)).max() > 0.05  # else nothing was to be moved


def test_late_scans_of_one_episode_are_not_shown_in_the_next() -> None:
    task = _task({"scan_lag_s": 0.3})
    _flown(task, 5)
    task.begin(np.array([True, False]))
    state = task.navigation
    scans_m = state.scans_m.numpy()
    assert (scans_m[0] == scans_m[0, :1]).all()
    assert not (scans_m[1] == scans_m[1, :1]).all()
    np.testing.assert_allclose(state.ranges_m.numpy()[0], scans_m[0, 0], atol=1e-4)


def test_attitude_that_is_told_is_off_by_the_error_about_another_axis_in_each_episode() -> None:
    task = _task({"attitude_error_deg": 2.0} | CALM, count=16)
    errors = task.navigation.attitude_errors.numpy()
    np.testing.assert_allclose(2.0 * np.degrees(np.arccos(errors[:, 3])), 2.0, atol=0.01)
    axes = errors[:, :3] / np.linalg.norm(errors[:, :3], axis=1)[:, None]
    assert len(np.unique(axes.round(3), axis=0)) == 16
    assert (np.abs(axes.mean(axis=0)) < 0.5).all()  # 3.5 sigma of a mean of 16 from a sphere


def test_goal_seems_turned_by_the_heading_that_is_told_wrong_and_what_is_flown_is_turned_back() -> None:
    true, wrong = _task(CALM, count=8), _task({"attitude_error_deg": 5.0} | CALM, count=8)
    at = [element.name for element in true.layout.frame].index("goal_dir_hfrd_x") - true.layout.frame_size

    def bearings(task: Navigate) -> NDArray[Any]:
        frame = task.buffers.observations.numpy()
        found: NDArray[Any] = np.arctan2(frame[:, at + 1], frame[:, at])
        return found

    x, y, z, w = wrong.navigation.attitude_errors.numpy().T
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    assert np.ptp(yaw) > math.radians(4.0)
    off = np.angle(np.exp(1j * (bearings(wrong) - bearings(true))))
    np.testing.assert_allclose(off, -yaw, atol=math.radians(0.5))  # hovers lean a little
    ahead = np.tile(np.array([0.4, 0.0, 0.0, 0.0], dtype=np.float32), (8, 1))
    for task in (true, wrong):
        for _ in range(12):
            task.buffers.continuous.assign(ahead)
            task.step()
    courses = [np.arctan2(*task.rig.rows["truth"]["vel_ned"][:, 1::-1].T) for task in (true, wrong)]
    np.testing.assert_allclose(
        np.angle(np.exp(1j * (courses[1] - courses[0]))), yaw, atol=math.radians(2.0)
    )  # in flight it leans more
