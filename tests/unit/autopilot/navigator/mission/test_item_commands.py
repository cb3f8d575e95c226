"""Which mission items are taken, and the reason and number with which the others are refused."""

from dataclasses import replace
from math import inf, nan

import pytest

from autopilot.interface.item_lists import ListKind
from autopilot.navigator.mission import item_checks
from autopilot.navigator.mission.item_checks import SUPPORTED_COMMANDS
from autopilot.navigator.mission.item_commands import MAX_ITEMS
from tests.unit.autopilot.kinematic import Kinematic, do, item

GOOD = item(0, 16, 10.0)


def refuse_items(items, payload=()):
    return item_checks.refuse_items(items, lambda command: command in payload)


def test_every_unsupported_command_is_refused_with_its_number():
    for command in set(range(50_000)) - SUPPORTED_COMMANDS:
        refusal = refuse_items([GOOD, replace(GOOD, seq=1, command=command)])
        assert (refusal.seq, refusal.result) == (1, 3)
        assert f"command {command}" in refusal.reason


@pytest.mark.parametrize("frame", [1, 2, 4, 7, 8, 9, 10, 11, 12, 99])
def test_unsupported_frame_is_refused(frame):
    refusal = refuse_items([item(0, 16, frame=frame)])
    assert (refusal.seq, refusal.result) == (0, 2)


@pytest.mark.parametrize("frame", [0, 3, 5, 6])
def test_global_frames_are_taken(frame):
    assert refuse_items([item(0, 16, frame=frame)]) is None


@pytest.mark.parametrize(
    ("bad", "result"),
    [
        (item(1, 16, params=(-1, 0, 0, nan)), 6),
        (item(1, 16, params=(inf, 0, 0, nan)), 6),
        (item(1, 16, params=(0, -2, 0, nan)), 7),
        (item(1, 16, params=(0, 0, 5000, nan)), 8),
        (item(1, 16, params=(0, 0, 0, 720)), 9),
        (item(1, 16, height=nan), 12),
        (item(1, 22, height=inf), 12),
        (item(1, 21, params=(0, 3, 0, nan)), 7),
        (do(1, 93, -1), 6),
        (do(1, 93, nan), 6),
        (do(1, 177, 9, 1), 6),
        (do(1, 177, 1, 1), 6),
        (do(1, 177, 0.5, 1), 6),
        (do(1, 177, 0, -2), 7),
        (do(1, 178, 7, 5, -1), 6),
        (do(1, 178, 1, 0, -1), 7),
        (do(1, 178, 1, 5, 50), 8),
        (do(1, 178, 1, 5, -1, 1), 9),
        (do(1, 179, 0), 2),
        (do(1, 207, 3), 6),
        (do(1, 207, 1, 16), 7),
        (do(1, 112, -1), 6),
        (do(1, 114, nan), 6),
        (do(1, 115, 400), 6),
        (do(1, 115, 90, -5), 7),
        (do(1, 115, 90, 5, 3), 8),
        (do(1, 115, 90, 5, 1, 2), 9),
        (do(1, 201, 2), 6),
        (do(1, 600, -1), 6),
        (do(1, 601, 4, 1), 6),
        (item(1, 18, params=(-1, 0, 5, nan)), 6),
        (item(1, 18, params=(1, 0, 5000, nan)), 8),
        (item(1, 30, params=(3, 0, 0, 0)), 6),
        (item(1, 4501, params=(1, 0, 0, 0)), 6),
        (item(1, 4501), 3),
        (item(7, 16), 13),
    ],
)
def test_bad_parameter_is_named_by_the_result(bad, result):
    refusal = refuse_items([GOOD, bad])
    assert (refusal.seq, refusal.result) == (1, result)
    assert refusal.reason


@pytest.mark.parametrize(("x", "y", "result"), [(nan, 8.0, 10), (91.0, 8.0, 10), (47.0, nan, 11), (47.0, 181.0, 11)])
def test_place_off_the_earth_is_refused(x, y, result):
    bad = GOOD.__class__(0, 6, 16, (0.0, 0.0, 0.0, nan), x, y, 10.0)
    assert refuse_items([bad]).result == result


def test_jump_must_repeat_something_that_takes_time():
    refusal = refuse_items([do(0, 178, 1, 5, -1), do(1, 177, 0, -1)])
    assert (refusal.seq, refusal.result) == (1, 6)


def test_too_many_items_are_refused():
    assert refuse_items([item(i, 16) for i in range(MAX_ITEMS + 1)]).result == 4


def test_takeoff_and_landing_may_name_no_place():
    nowhere = GOOD.__class__(0, 6, 22, (0.0, 0.0, 0.0, nan), nan, nan, 10.0)
    at_zero = GOOD.__class__(1, 6, 21, (0.0, 0.0, 0.0, nan), 0.0, 0.0, 0.0)
    assert refuse_items([nowhere, at_zero]) is None


def test_refused_mission_leaves_the_old_one():
    rig = Kinematic().ready()
    assert rig.fc.lists.load(ListKind.MISSION, [GOOD]) is None
    assert rig.fc.lists.load(ListKind.MISSION, [item(0, 16), item(1, 211)]).seq == 1
    assert list(rig.fc.navigator.mission.items) == [GOOD]
    assert rig.state.mission_count == 1
