"""What training has of flight: old images slow, owners found again late, maps of what was seen, late setpoints."""

from typing import Any

import numpy as np
import pytest
import warp as wp

from policies.companion.guard.settings import GuardSettings
from policies.tasks.catalogue import build_task
from policies.tasks.flight.own_state import Command, OwnState
from policies.tasks.follow_me.follow_me import FollowMe
from policies.tasks.follow_me.settings import FollowSettings
from policies.tasks.follow_me.tracked.guarding import guarded
from policies.tasks.follow_me.tracked.keep_off import KeepOff, keep_off
from policies.tasks.follow_me.tracked.owner_filter import OwnerFilter
from policies.tasks.follow_me.tracked.sight_model import Tracked, is_believed, make_tracked, was_passed


@wp.kernel
def guarded_rows(
    own: wp.array(dtype=OwnState),
    owners: wp.array(dtype=OwnerFilter),
    ages_s: wp.array(dtype=float),
    k: KeepOff,
    commands: wp.array(dtype=Command),
) -> None:
    i = wp.tid()
    commands[i] = guarded(commands[i], own[i], owners[i], ages_s[i], 1, k)


@wp.kernel
def passed_rows(off: wp.array(dtype=wp.vec2), trails: wp.array(dtype=wp.vec2), out: wp.array(dtype=int)) -> None:
    i = wp.tid()
    out[i] = int(was_passed(off[i], trails[i]))


@wp.kernel
def believed_rows(tracked: Tracked, is_there: int, out: wp.array(dtype=int)) -> None:
    i = wp.tid()
    out[i] = int(is_believed(tracked, i, is_there == 1))


def test_old_images_make_it_slower_as_the_guard_of_a_flight_does() -> None:
    ages_s = np.array([0.1, 0.5, 0.7, 0.9], np.float32)
    n = len(ages_s)
    own, owners, commands = wp.zeros(n, dtype=OwnState), wp.zeros(n, dtype=OwnerFilter), wp.zeros(n, dtype=Command)
    commands.numpy()["vel_ned"][:] = (3.0, -1.0, 0.5)
    wp.launch(guarded_rows, n, [own, owners, wp.array(ages_s), keep_off(), commands])
    s = GuardSettings()
    expected = np.clip((s.image_stop_s - ages_s) / (s.image_stop_s - s.image_slow_s), 0.0, 1.0)
    flown = commands.numpy()["vel_ned"]
    assert flown == pytest.approx(expected[:, None] * np.array([3.0, -1.0, 0.5]), abs=1e-5)
    assert flown[0, 0] == pytest.approx(3.0)
    assert flown[-1, 0] == 0.0


@pytest.mark.parametrize(
    ("off", "trail", "is_known"),
    [
        ((2.0, 0.5), (3.0, 0.0), True),  # ahead
        ((0.0, 3.0), (4.0, 0.0), True),  # beside, and was ahead
        ((0.0, 3.0), (2.0, 0.0), False),  # beside, and was beside the image all the way
        ((-3.0, 0.5), (5.0, 0.0), True),  # behind, flown past
        ((-6.0, 0.5), (5.0, 0.0), False),  # behind where it began
        ((1.0, 0.0), (0.0, 0.0), False),  # it has not moved, or not the way that it looks
    ],
)
def test_a_map_knows_what_was_ahead_on_the_way_to_here(
    off: tuple[float, float], trail: tuple[float, float], is_known: bool
) -> None:
    out = wp.zeros(1, dtype=int)
    wp.launch(passed_rows, 1, [wp.array([off], dtype=wp.vec2), wp.array([trail], dtype=wp.vec2), out])
    assert bool(out.numpy()[0]) is is_known


def _believed(tracked: Any, images: str) -> str:
    """Of images in a row, 1 with the owner and 0 without: which are taken in."""
    out, words = wp.zeros(1, dtype=int), ""
    for image in images:
        wp.launch(believed_rows, 1, [tracked, int(image), out])
        words += str(out.numpy()[0])
    return words


def test_after_a_second_without_them_four_images_in_a_row_must_show_the_owner() -> None:
    tracked = make_tracked(lambda _, shape, dtype: wp.zeros(shape, dtype=dtype), 1)
    assert _believed(tracked, "1") == "1"  # the first of all
    filters = tracked.filters.numpy()
    filters["is_known"], filters["age_s"] = 1, 0.5
    assert _believed(tracked, "00001") == "00001"
    filters["age_s"] = 1.5
    assert _believed(tracked, "0000" + "1111") == "0000" + "0001"
    assert _believed(tracked, "0000" + "1011011") == "0000" + "0000011"  # one that misses them is no end of a row
    assert _believed(tracked, "0000" + "11" + "0000" + "111") == "0000" + "00" + "0000" + "000"


def _task(**numbers: float) -> FollowMe:
    task = build_task("FollowMe", 16, FollowSettings(observation="tracked", has_estimator=False))
    assert isinstance(task, FollowMe)
    task.set_params(numbers)
    task.reset(1)
    return task


def test_a_late_setpoint_is_what_was_asked_for_at_the_decision() -> None:
    asked = []
    for lag_s in (0.0, 0.06):
        task = _task(setpoint_lag_s=lag_s, wind_m_s=0.0)
        task.buffers.continuous.assign(np.tile(np.array([0.5, 0.2, 0.0, 0.8], np.float32), (16, 1)))
        task.step()
        asked.append(task.follow.asked.numpy()["vel_ned"].copy())
        assert task.rig.arrays.autopilot.setpoint.numpy()["vel_ned"] == pytest.approx(asked[-1])
    assert asked[0] == pytest.approx(asked[1])
    assert np.abs(asked[0]).max() > 0.1


def test_who_flies_backwards_learns_nothing_of_what_is_behind() -> None:
    task = _task(guard=0.0, lost_m=1e3, unseen_limit_s=1e3)
    for ahead, is_trail in ((-0.4, False), (0.4, True)):
        task.reset(1)
        task.buffers.continuous.assign(np.tile(np.array([ahead, 0.0, 0.0, 0.0], np.float32), (16, 1)))
        for _ in range(20):
            task.step()
        trails_m = np.linalg.norm(task.follow.tracked.trails_ned.numpy(), axis=1)
        assert (
            trails_m[np.linalg.norm(task.rig.arrays.truth.numpy()["vel_ned"], axis=1) > 1.0] > 0.5
        ).all() == is_trail


def test_how_late_a_report_came_is_told_to_nobody() -> None:
    ages_s = []
    for lag_s in (0.2, 0.9):
        task = build_task("FollowMe", 16, FollowSettings(has_estimator=False, image_size=8))
        assert isinstance(task, FollowMe)
        task.set_params({"phone_lag_s": lag_s, "phone_dropouts_per_min": 0.0})
        task.reset(1)
        at = [element.name for element in task.layout.frame].index("owner_age")
        seen = []
        for _ in range(12):
            task.step()
            seen.append(task.buffers.observations.numpy()[:, at].copy())
        ages_s.append(np.array(seen))
    assert 0.28 < ages_s[0].min() < 0.45
    assert 0.28 < ages_s[1].min() < 0.45
