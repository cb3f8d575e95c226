"""What the guard takes for free and for solid, of pictures whose depth is known."""

import numpy as np
import pytest

from policies.companion.senses.local_map import CELL_M, LocalMap
from policies.companion.senses.poses import Pose
from policies.tasks.follow_me.observe import DEPTH_HALF_M, IMAGE_SIZE

LEVEL = (0.0, 0.0, 0.0, 1.0)
HERE = (3.0, -2.0, -1.6)
POSE = Pose(0, HERE, LEVEL)
NORTH, EAST, SOUTH = 0, 9, 18  # indices of directions


def picture(depth_m: float | None) -> np.ndarray:
    """All at one depth along the optical axis; None: no returns."""
    pixels = np.full((IMAGE_SIZE, IMAGE_SIZE, 4), 255, np.uint8)
    if depth_m is not None:
        pixels[..., 3] = int(255.0 * depth_m / (depth_m + float(DEPTH_HALF_M)))
    return pixels


def test_before_the_first_picture_nothing_is_free_and_nothing_solid() -> None:
    free_m, known_m = LocalMap().clear_m(HERE, 0)
    assert (free_m == 0.0).all()
    assert (known_m > 9.0).all()


@pytest.mark.parametrize("wall_m", [2.0, 5.0])
def test_a_wall_ahead_ends_the_way_ahead_and_none_behind_is_known(wall_m: float) -> None:
    seen = LocalMap()
    seen.see(picture(wall_m), POSE, None, 0)
    free_m, known_m = seen.clear_m(HERE, 0)
    assert free_m[NORTH] == pytest.approx(wall_m, abs=2.5 * CELL_M)
    assert known_m[NORTH] == pytest.approx(wall_m, abs=2.5 * CELL_M)
    assert free_m[SOUTH] <= 1.0
    assert known_m[SOUTH] > 9.0


def test_the_owner_is_no_wall() -> None:
    seen = LocalMap()
    owner_ned = (HERE[0] + 2.0, HERE[1], HERE[2])
    seen.see(picture(2.0), POSE, owner_ned, 0)
    assert seen.clear_m(HERE, 0)[0][NORTH] > 6.0


def test_without_returns_there_is_no_depth() -> None:
    seen = LocalMap()
    seen.see(picture(None), POSE, None, 0)
    assert not seen.has_depth
    assert (seen.clear_m(HERE, 0)[0] == 0.0).all()


def test_what_was_seen_is_remembered_on_the_way_and_forgotten_in_time() -> None:
    seen = LocalMap()
    seen.see(picture(5.0), POSE, None, 0)
    on_the_way = (HERE[0] + 2.0, *HERE[1:])
    assert seen.clear_m(on_the_way, 1_000_000)[0][NORTH] == pytest.approx(3.0, abs=2.5 * CELL_M)
    assert (seen.clear_m(on_the_way, 60_000_000)[0] == 0.0).all()
    far_away = (HERE[0] + 200.0, *HERE[1:])
    assert (seen.clear_m(far_away, 1_000_000)[0] == 0.0).all()


def test_a_trunk_beside_the_vehicle_stays_on_the_map() -> None:
    seen = LocalMap()
    seen.see(picture(2.0), POSE, None, 0)
    beside = (HERE[0] + 1.5, *HERE[1:])  # half a metre before it
    seen.see(picture(9.0), Pose(100_000, beside, (0.0, 0.0, 1.0, 0.0)), None, 100_000)  # and looks back
    assert seen.clear_m(beside, 200_000)[1][NORTH] <= 1.0


def test_what_is_solid_is_told_by_sectors_from_the_heading() -> None:
    seen = LocalMap()
    assert np.isinf(seen.nearest_m(HERE, 0.0, 0)).all()
    seen.see(picture(5.0), POSE, None, 0)
    near_m = seen.nearest_m(HERE, 0.0, 0)
    assert near_m[0] == pytest.approx(5.0, abs=2 * CELL_M)
    assert np.isinf(near_m[12])
    turned = seen.nearest_m(HERE, np.pi / 2, 0)  # it is to the left now
    assert turned[18] == pytest.approx(5.0, abs=2 * CELL_M)
