"""Drive: ranges that come late, and an attitude that is told with an error."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from common.range_sectors import GROUND_RING
from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.drive.drive import Drive
from policies.tasks.drive.observe import DIRECTIONS, FRAME
from tests.unit.policies.tasks.flight.moving import moved, pose_of

NAMES = [element.name for element in FRAME]
CALM = {"wind_m_s": 0.0, "wind_gust_m_s": 0.0, "hill_height_m": 0.0}
Seen = dict[str, NDArray[Any]]


def _task(params: dict[str, float], preset: str = "park", count: int = 4) -> Drive:
    task = build_task("Drive", count, task_settings("Drive", {"preset": preset, "has_estimator": False}))
    assert isinstance(task, Drive)
    task.set_params(params)
    task.reset(5)
    return task


def _seen(task: Drive) -> Seen:
    return {
        "frame": task.buffers.observations.numpy()[:, -len(FRAME) :].copy(),
        "measured_m": task.driving.scans_m.numpy()[:, 0].copy(),
        "shown_m": task.driving.ranges_m.numpy().copy(),
        "poses": np.array([pose_of(row) for row in task.rig.rows["truth"]]),
    }


def _driven(task: Drive, decisions: int) -> list[Seen]:
    """What is shown and what was measured, at first and after each decision; the same slow drive for all."""
    seen = [_seen(task)]
    for _ in range(decisions):
        task.buffers.continuous.assign(np.tile(np.array([0.3, 0.2], dtype=np.float32), (task.env_count, 1)))
        task.step()
        seen.append(_seen(task))
    return seen


@pytest.mark.parametrize("preset", ["park", "reach"])
@pytest.mark.parametrize(("lag_s", "late"), [(0.0, 0), (0.1, 1), (0.2, 2), (0.3, 3)])
def test_policy_sees_the_scan_of_so_many_decisions_ago_from_where_it_is_and_all_else_of_now(
    preset: str, lag_s: float, late: int
) -> None:
    fresh, lagged = _driven(_task({}, preset), 6), _driven(_task({"scan_lag_s": lag_s}, preset), 6)
    assert not np.array_equal(fresh[0]["measured_m"], fresh[6]["measured_m"])
    for k in range(len(fresh)):
        ago = max(k - late, 0)  # the first scan is shown until another comes
        assert np.array_equal(lagged[k]["measured_m"], fresh[k]["measured_m"])
        for i in range(4):
            was, now = fresh[ago]["poses"][i], fresh[k]["poses"][i]
            expected = moved(fresh[ago]["measured_m"][i], was, now, GROUND_RING)
            np.testing.assert_allclose(lagged[k]["shown_m"][i], expected, atol=1e-3)
        assert np.array_equal(lagged[k]["frame"][:, :-DIRECTIONS], fresh[k]["frame"][:, :-DIRECTIONS])
        near = lagged[k]["shown_m"].reshape(4, DIRECTIONS, 2).min(axis=2)
        nearness = 1.0 - np.sqrt(near / GROUND_RING.range_m)
        np.testing.assert_allclose(lagged[k]["frame"][:, -DIRECTIONS:], nearness, atol=1e-6)


def test_late_scans_of_one_episode_are_not_shown_in_the_next() -> None:
    task = _task({"scan_lag_s": 0.3}, count=2)
    _driven(task, 5)
    task.begin(np.array([True, False]))
    scans_m = task.driving.scans_m.numpy()
    assert (scans_m[0] == scans_m[0, :1]).all()
    assert not (scans_m[1] == scans_m[1, :1]).all()
    np.testing.assert_allclose(task.driving.ranges_m.numpy()[0], scans_m[0, 0], atol=1e-4)


def test_goal_and_tilt_seem_turned_by_the_attitude_that_is_told_wrong_and_ranges_do_not() -> None:
    true, wrong = _seen(_task(CALM, count=8)), _task({"attitude_error_deg": 5.0} | CALM, count=8)
    x, y, z, w = wrong.driving.attitude_errors.numpy().T
    np.testing.assert_allclose(2.0 * np.degrees(np.arccos(w)), 5.0, atol=0.01)
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    told = _seen(wrong)

    def named(seen: Seen, name: str) -> NDArray[Any]:
        column: NDArray[Any] = seen["frame"][:, NAMES.index(name)]
        return column

    def angle(seen: Seen, sine: str, cosine: str) -> NDArray[Any]:
        found: NDArray[Any] = np.arctan2(named(seen, sine), named(seen, cosine))
        return found

    for pair in (("goal_dir_hfrd_y", "goal_dir_hfrd_x"), ("goal_heading_sin", "goal_heading_cos")):
        off = np.angle(np.exp(1j * (angle(told, *pair) - angle(true, *pair))))
        np.testing.assert_allclose(off, -yaw, atol=np.radians(0.2))  # it stands nearly level
    shown, was = (np.hypot(named(seen, "down_frd_x"), named(seen, "down_frd_y")) for seen in (told, true))
    np.testing.assert_allclose(shown, np.hypot(x, y) * 2.0 * w, atol=np.radians(0.7))
    assert (was < np.radians(0.7)).all()
    assert np.array_equal(told["frame"][:, -DIRECTIONS:], true["frame"][:, -DIRECTIONS:])
