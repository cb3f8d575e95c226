"""What a policy that looks at no image sees and says."""

import numpy as np
import pytest
import warp as wp

from policies.tasks.catalogue import build_task
from policies.tasks.flight.own_state import ACTIONS, SPEED_MAX_M_S, YAW_RATE_MAX_RAD_S, Command, OwnState
from policies.tasks.flight.ranges import SECTORS as TRUE_SECTORS
from policies.tasks.follow_me.follow_me import FollowMe
from policies.tasks.follow_me.settings import FollowSettings
from policies.tasks.follow_me.tracked.vector import (
    ACCEL_MAX_M_S2,
    SECTORS,
    TRACKED_ELEMENTS,
    next_command_rows,
)


def tracked_task(count: int = 16, **numbers: float) -> FollowMe:
    task = build_task("FollowMe", count, FollowSettings(observation="tracked", has_estimator=False))
    assert isinstance(task, FollowMe)
    task.set_params(numbers)
    task.reset(1)
    return task


def test_the_layout_has_no_image_and_its_sectors_are_those_of_the_truth() -> None:
    layout = tracked_task(2).layout
    assert layout.image is None
    assert layout.frame == TRACKED_ELEMENTS
    assert layout.continuous == ACTIONS
    assert SECTORS == TRUE_SECTORS
    assert len({element.name for element in layout.frame}) == len(layout.frame)


def test_what_is_asked_for_goes_to_what_is_said_no_faster_than_a_vehicle_can() -> None:
    own, action = wp.zeros(1, dtype=OwnState), wp.array([wp.vec4(1.0, 0.0, 0.0, 1.0)], dtype=wp.vec4)
    own.numpy()["q_ned_from_frd"] = (0.0, 0.0, 0.0, 1.0)
    commands = wp.zeros(1, dtype=Command)
    north = []
    for _ in range(40):
        wp.launch(next_command_rows, 1, [action, own, commands])
        north.append(float(commands.numpy()[0]["vel_ned"][0]))
    assert north[0] == pytest.approx(0.1 * float(ACCEL_MAX_M_S2))
    assert np.diff(north).max() <= 0.1 * float(ACCEL_MAX_M_S2) + 1e-6
    assert north[-1] == pytest.approx(float(SPEED_MAX_M_S), rel=0.01)
    assert commands.numpy()[0]["yaw_rate"] == pytest.approx(float(YAW_RATE_MAX_RAD_S), rel=0.01)


def test_who_is_seen_is_where_they_truly_are_but_for_what_was_measured() -> None:
    task = tracked_task(64, image_lag_s=0.0, image_jitter_s=0.0, image_loss=0.0, depth_max_m=1000.0, bystanders=0.0)
    for _ in range(10):
        task.step()
    frame = task.buffers.observations.numpy()
    names = [element.name for element in task.layout.frame]
    at = [names.index(f"seen_owner_pos_hfrd_{axis}") for axis in "xy"]
    shown = frame[:, at] * [task.layout.frame[k].scale for k in at]
    sights = task.follow.sights.numpy()
    is_near = (sights["distance_m"] < 5.0) & (frame[:, names.index("seen_age")] < 0.15)
    off = np.hypot(*(shown - sights["position_hfrd"][:, :2])[is_near].T)
    assert is_near.sum() > 16
    assert np.median(off) < 0.2


def test_late_images_make_old_sights_and_without_depth_a_map_is_made_by_colours() -> None:
    late = {"image_lag_s": 0.3, "image_jitter_s": 0.0, "image_loss": 0.0}
    calm = {"bystanders": 0.0, "guard": 0.0, "lost_m": 1e3, "unseen_limit_s": 1e3, "trees_per_ha": 200.0}
    task = tracked_task(32, depth_max_m=0.0, **calm, **late)
    task.buffers.continuous.assign(np.tile(np.array([0.3, 0.0, 0.0, 0.0], np.float32), (32, 1)))
    for _ in range(30):  # out of the clearing where it starts
        task.step()
    frame = task.buffers.observations.numpy()
    names = [element.name for element in task.layout.frame]
    is_known = frame[:, names.index("is_owner_seen")] > 0.5
    assert frame[is_known, names.index("seen_age")].min() > 0.25
    assert (frame[:, names.index("has_depth")] == 0.0).all()
    shown, true = frame[:, -SECTORS:], task.follow.nearness.numpy()[:, :SECTORS]
    is_shown = (shown > 0.0) & (true > 0.0) & (shown < 1.0)
    assert is_shown.sum() > 8
    off = (1.0 - shown[is_shown]) / (1.0 - true[is_shown]) - 1.0
    assert 0.04 < np.std(off) < 0.12  # of the range: as the network that tells depth from colours is judged


def test_the_same_seed_gives_the_same_sights() -> None:
    runs = []
    for _ in range(2):
        task = tracked_task(4)
        for _ in range(5):
            task.step()
        runs.append(task.buffers.observations.numpy().copy())
    assert np.array_equal(*runs)
