"""What the guard takes for free and for solid, of pictures whose depth is known."""

import numpy as np
import pytest

from common.attitude import Vector
from policies.companion.senses.local_map import CELL_M, CELLS, ROOM_M, Clearance, LocalMap
from policies.companion.senses.poses import Pose
from policies.mono_depth.network import SeenDepth
from policies.tasks.follow_me.observe import DEPTH_HALF_M, IMAGE_SIZE

LEVEL = (0.0, 0.0, 0.0, 1.0)
HERE = (3.0, -2.0, -1.6)
POSE = Pose(0, HERE, LEVEL)
NORTH, SOUTH = (1.0, 0.0), (-1.0, 0.0)


def picture(depth_m: float | None) -> np.ndarray:
    """All at one depth along the optical axis; None: no returns."""
    byte = 255 if depth_m is None else int(255.0 * depth_m / (depth_m + float(DEPTH_HALF_M)))
    return np.full((IMAGE_SIZE, IMAGE_SIZE), byte, np.uint8)


def way_m(seen: LocalMap, pos_ned: Vector, way: tuple[float, float], now_us: int = 0) -> tuple[float, float]:
    """How far it was seen to be free from a place in a direction, and how far nothing solid is nearer than 0.3 m."""
    along_m = np.arange(0.0, 9.5, 0.5 * CELL_M)
    room_m, is_seen = seen.clearance(pos_ned, now_us).at(np.array(pos_ned[:2]) + along_m[:, None] * np.array(way))
    is_clear = room_m > 0.3
    free_m, known_m = (
        float(along_m[max(int(np.argmin([*ok, False])) - 1, 0)]) for ok in (is_seen & is_clear, is_clear)
    )
    return free_m, known_m


def test_before_the_first_picture_nothing_is_free_and_nothing_solid() -> None:
    free_m, known_m = way_m(LocalMap(), HERE, NORTH)
    assert free_m <= 0.0
    assert known_m > 9.0


@pytest.mark.parametrize("wall_m", [2.0, 5.0])
def test_a_wall_ahead_ends_the_way_ahead_and_none_behind_is_known(wall_m: float) -> None:
    seen = LocalMap()
    seen.see(picture(wall_m), POSE, None, 0)
    free_m, known_m = way_m(seen, HERE, NORTH)
    assert free_m == pytest.approx(wall_m, abs=2.5 * CELL_M)
    assert known_m == pytest.approx(wall_m, abs=2.5 * CELL_M)
    free_m, known_m = way_m(seen, HERE, SOUTH)
    assert free_m <= 1.0
    assert known_m > 9.0


def test_the_owner_is_no_wall_and_what_they_hide_is_not_free() -> None:
    seen = LocalMap()
    owner = np.add(HERE, (2.0, 0.0, 0.0)), np.zeros(2)
    seen.see(picture(2.0), POSE, owner, 0)
    free_m, known_m = way_m(seen, HERE, NORTH)
    assert free_m == pytest.approx(2.0, abs=2.5 * CELL_M)
    assert known_m > 6.0


def test_where_the_owner_runs_is_free_but_for_what_was_seen_to_be_solid() -> None:
    seen, runs = LocalMap(), np.array([4.0, 0.0])
    seen.see(picture(2.0), POSE, (np.add(HERE, (2.0, 0.0, 0.0)), runs), 0)
    assert way_m(seen, HERE, NORTH)[0] == pytest.approx(6.0, abs=2.5 * CELL_M)
    seen = LocalMap()
    seen.see(picture(4.0), POSE, None, 0)
    seen.see(picture(2.0), POSE, (np.add(HERE, (2.0, 0.0, 0.0)), runs), 100_000)
    assert way_m(seen, HERE, NORTH)[1] == pytest.approx(4.0, abs=2.5 * CELL_M)


def test_where_the_owner_runs_is_free_as_wide_as_they_keep_off_trees() -> None:
    """To 0.6 m beside their way, half a cell and the grid's own step more, and no farther."""
    seen = LocalMap()
    seen.see(picture(2.0), POSE, (np.add(HERE, (2.0, 0.0, 0.0)), np.array([4.0, 0.0])), 0)
    for aside_m, is_free in ((0.4, True), (-0.4, True), (1.0, False), (-1.0, False)):
        beside = np.add(HERE[:2], (4.0, aside_m))
        assert seen.clearance(HERE, 0).at(beside)[1] == is_free


def test_without_returns_there_is_no_depth_and_only_the_line_to_whom_it_sees_is_free() -> None:
    seen = LocalMap()
    seen.see(picture(None), POSE, None, 0)
    assert not seen.has_depth
    assert way_m(seen, HERE, NORTH)[0] <= 0.0
    seen.sight(POSE, np.add(HERE, (4.0, 0.0, 0.0)), 0)
    assert way_m(seen, HERE, NORTH)[0] == pytest.approx(4.0, abs=2 * CELL_M)
    assert way_m(seen, HERE, SOUTH)[0] <= 1.0


@pytest.mark.parametrize("bearing_deg", [0.0, 10.0, 30.0, 45.0, 120.0])
def test_the_line_to_whom_it_sees_is_wide_enough_for_a_hull_whatever_way_it_leads(bearing_deg: float) -> None:
    seen, way = LocalMap(), np.array([np.cos(np.radians(bearing_deg)), np.sin(np.radians(bearing_deg))])
    seen.sight(POSE, np.add(HERE, (*(4.0 * way), 0.0)), 0)
    along_m = np.arange(0.0, 3.4, 0.05)[:, None]
    here = np.array(HERE[:2])
    assert seen.clearance(HERE, 0).with_room_seen(here).at(here + along_m * way)[1].all()


def test_for_who_is_wider_than_a_cell_only_what_has_seen_cells_all_round_is_seen_but_where_it_is() -> None:
    is_seen = np.zeros((CELLS, CELLS), bool)
    is_seen[40:60, 40:60] = True
    is_seen[45, 45] = False  # a hole
    near_m = np.full((CELLS, CELLS), ROOM_M, np.float32)
    here = np.array([50.5, 59.5]) * CELL_M  # its own cell lies at the edge
    wide = Clearance(near_m, is_seen, (0, 0)).with_room_seen(here)
    assert not wide.is_seen[44:47, 44:47].any()
    assert wide.is_seen[41:44, 41:59].all()
    assert not wide.is_seen[40, 41:52].any()
    assert wide.is_seen[50, 57:60].all()
    assert not (wide.is_seen & ~is_seen).any()
    assert wide.near_m is near_m
    all_seen = Clearance(near_m, np.ones((CELLS, CELLS), bool), (0, 0)).with_room_seen(here)
    assert all_seen.is_seen[1:-1, 1:-1].all()
    assert not all_seen.is_seen[0, :40].any()  # beyond the map nothing is seen


def test_what_was_seen_is_remembered_on_the_way_and_forgotten_in_time() -> None:
    seen = LocalMap()
    seen.see(picture(5.0), POSE, None, 0)
    on_the_way = (HERE[0] + 2.0, *HERE[1:])
    assert way_m(seen, on_the_way, NORTH, 1_000_000)[0] == pytest.approx(3.0, abs=2.5 * CELL_M)
    assert way_m(seen, on_the_way, NORTH, 60_000_000)[0] <= 0.0
    far_away = (HERE[0] + 200.0, *HERE[1:])
    assert way_m(seen, far_away, NORTH, 1_000_000)[0] <= 0.0


def test_a_trunk_beside_the_vehicle_stays_on_the_map() -> None:
    seen = LocalMap()
    seen.see(picture(2.0), POSE, None, 0)
    beside = (HERE[0] + 1.5, *HERE[1:])  # half a metre before it
    seen.see(picture(9.0), Pose(100_000, beside, (0.0, 0.0, 1.0, 0.0)), None, 100_000)  # and looks back
    assert way_m(seen, beside, NORTH, 200_000)[1] <= 1.0


def test_what_is_solid_is_told_by_sectors_from_the_heading() -> None:
    seen = LocalMap()
    assert np.isinf(seen.nearest_m(HERE, 0.0, 0)).all()
    seen.see(picture(5.0), POSE, None, 0)
    near_m = seen.nearest_m(HERE, 0.0, 0)
    assert near_m[0] == pytest.approx(5.0, abs=2 * CELL_M)
    assert np.isinf(near_m[12])
    turned = seen.nearest_m(HERE, np.pi / 2, 0)  # it is to the left now
    assert turned[18] == pytest.approx(5.0, abs=2 * CELL_M)


def test_depth_told_from_colours_leaves_people_out_but_does_not_look_through_them() -> None:
    seen, somebody = LocalMap(), np.zeros((IMAGE_SIZE, IMAGE_SIZE), bool)
    seen.guess(SeenDepth(picture(3.0), somebody), POSE, None, 0)
    assert way_m(seen, HERE, NORTH)[1] == pytest.approx(3.0, abs=2.5 * CELL_M)
    assert not seen.has_depth
    seen = LocalMap()
    seen.guess(SeenDepth(picture(3.0), ~somebody), POSE, None, 0)
    free_m, known_m = way_m(seen, HERE, NORTH)
    assert known_m > 9.0
    assert free_m == pytest.approx(3.0, abs=2.5 * CELL_M)


def test_what_hangs_over_a_place_is_remembered_for_whoever_asks_for_longer() -> None:
    seen = LocalMap()
    seen.see(picture(2.0), POSE, None, 0)
    there = (HERE[0] + 2.0, *HERE[1:])
    assert seen.room_up_m(there, 0) < 2.0
    assert seen.room_up_m(there, 60_000_000) == float("inf")
    assert seen.room_up_m(there, 60_000_000, 600_000_000) < 2.0
    assert seen.room_up_m(HERE, 60_000_000, 600_000_000) == float("inf")


def test_what_was_free_lower_down_is_not_known_to_be_for_who_has_climbed() -> None:
    seen = LocalMap()
    seen.see(picture(5.0), POSE, None, 0)
    ahead = (HERE[0] + 2.0, *HERE[1:])
    for climbed_m, is_free in ((0.3, True), (1.0, False)):
        known = seen.clearance((*HERE[:2], HERE[2] - climbed_m), 0)
        assert bool(known.at(np.array(ahead[:2]))[1]) == is_free


def test_how_near_something_is_changes_by_no_more_than_one_moves() -> None:
    """Not by steps of a cell: a way of half a cell would be as near as it or not at all."""
    seen = LocalMap()
    seen.see(picture(2.0), POSE, None, 0)
    clearance, steps = seen.clearance(HERE, 0), np.arange(0.8, 2.2, 0.01)
    near_m, _ = clearance.at(np.array(HERE[:2]) + steps[:, None] * np.array(NORTH))
    assert near_m.min() < 0.15
    assert near_m.max() > 0.8
    assert np.abs(np.diff(near_m)).max() < 0.02
    alone, is_seen = clearance.at(np.array(HERE[:2]) + steps[70] * np.array(NORTH))
    assert float(alone) == pytest.approx(near_m[70], abs=1e-5)
    assert is_seen.shape == ()


def test_what_is_outside_the_grid_is_not_seen() -> None:
    seen, looks_south = LocalMap(), (0.0, 0.0, 1.0, 0.0)
    for k in range(12):  # backwards to the north: behind it all is seen to be free, to the edge of the grid
        here = (HERE[0] + k, HERE[1], HERE[2])
        seen.see(picture(40.0), Pose(0, here, looks_south), None, 100_000 * k)
    far_m = np.arange(0.0, 40.0, 0.5)
    _, is_seen = seen.clearance(here, 1_100_000).at(np.array(here[:2]) + far_m[:, None] * np.array(SOUTH))
    assert is_seen[far_m < 11.0].all()
    assert not is_seen[far_m > 13.0].any()
