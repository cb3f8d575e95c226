"""Which fence and rally lists are taken, and what is said about the others."""

from math import cos, radians, sin

import pytest

from autopilot.interface.item_lists import ItemRefusal, MissionItem
from autopilot.navigator.fence.fence_items import MAX_FENCE_ITEMS, FenceCommand, GeoCircle, GeoPolygon, fence_shapes
from autopilot.navigator.fence.rally_points import MAX_RALLY_POINTS, RALLY_POINT, RallyPoints
from autopilot.navigator.mission.item_commands import Result
from tests.unit.autopilot.kinematic import item

INCLUSION, EXCLUSION = FenceCommand.INCLUSION_VERTEX, FenceCommand.EXCLUSION_VERTEX
SQUARE = ((0.0, 0.0), (0.0, 50.0), (50.0, 50.0), (50.0, 0.0))
BOW_TIE = ((0.0, 0.0), (50.0, 50.0), (50.0, 0.0), (0.0, 50.0))


def polygon(points, command=INCLUSION, first_seq=0, count=None):
    params = (len(points) if count is None else count, 0.0, 0.0, 0.0)
    return [item(first_seq + i, command, north, east, 0.0, params, 5) for i, (north, east) in enumerate(points)]


def circle(seq, radius, command=FenceCommand.INCLUSION_CIRCLE, north=0.0, east=0.0):
    return item(seq, command, north, east, 0.0, (radius, 0.0, 0.0, 0.0), 5)


def refused(items):
    refusal = fence_shapes(items)
    assert isinstance(refusal, ItemRefusal)
    assert refusal.reason
    return refusal.seq, refusal.result


def test_shapes_are_read_in_order():
    items = [*polygon(SQUARE), circle(4, 10.0), *polygon(SQUARE[:3], EXCLUSION, 5)]
    square, round_one, triangle = fence_shapes(items)
    assert isinstance(square, GeoPolygon)
    assert square.is_inclusion
    assert len(square.vertices) == 4
    assert isinstance(round_one, GeoCircle)
    assert round_one.is_inclusion
    assert round_one.radius_m == 10.0
    assert isinstance(triangle, GeoPolygon)
    assert not triangle.is_inclusion
    assert len(triangle.vertices) == 3


def test_two_polygons_of_the_same_kind_in_a_row_are_told_apart_by_their_counts():
    items = [*polygon(SQUARE), *polygon(SQUARE, first_seq=4)]
    assert [len(shape.vertices) for shape in fence_shapes(items)] == [4, 4]


def test_circle_without_a_radius_and_a_return_point_are_taken():
    point = item(1, FenceCommand.RETURN_POINT, 0.0, 0.0, 0.0, (0.0,) * 4, 5)
    assert len(fence_shapes([circle(0, 0.0), point])) == 1


@pytest.mark.parametrize(
    ("items", "seq", "result"),
    [
        (polygon(SQUARE[:2]), 0, Result.INVALID),
        (polygon(SQUARE, count=5), 3, Result.INVALID),
        (polygon(SQUARE, count=3), 3, Result.INVALID),
        ([*polygon(SQUARE, count=5), circle(4, 10.0)], 4, Result.INVALID),
        (polygon(SQUARE, count=3.5), 0, Result.INVALID),
        (polygon(BOW_TIE), 0, Result.INVALID),
        (polygon((SQUARE[0], SQUARE[1], SQUARE[0])), 0, Result.INVALID),
        (polygon((SQUARE[0], SQUARE[0], SQUARE[1], SQUARE[2])), 0, Result.INVALID),
        ([circle(0, -1.0)], 0, Result.PARAM1),
        ([circle(0, float("nan"))], 0, Result.PARAM1),
        ([item(0, 16)], 0, Result.UNSUPPORTED),
        ([circle(1, 5.0)], 0, Result.INVALID_SEQUENCE),
        ([MissionItem(0, 5, 5003, (5.0, 0.0, 0.0, 0.0), 91.0, 8.0, 0.0)], 0, Result.PARAM5_X),
        ([MissionItem(0, 5, 5003, (5.0, 0.0, 0.0, 0.0), 47.0, float("nan"), 0.0)], 0, Result.PARAM6_Y),
        ([MissionItem(0, 1, 5003, (5.0, 0.0, 0.0, 0.0), 47.0, 8.0, 0.0)], 0, Result.UNSUPPORTED_FRAME),
        ([circle(i, 5.0) for i in range(MAX_FENCE_ITEMS + 1)], MAX_FENCE_ITEMS, Result.NO_SPACE),
    ],
)
def test_bad_fence_is_refused_with_its_item(items, seq, result):
    assert refused(items) == (seq, result)


def test_largest_polygon_is_checked_for_crossings():
    round_one = [(100.0 * cos(radians(a * 0.72)), 100.0 * sin(radians(a * 0.72))) for a in range(MAX_FENCE_ITEMS)]
    assert len(fence_shapes(polygon(round_one))) == 1
    round_one[10], round_one[250] = round_one[250], round_one[10]
    assert refused(polygon(round_one)) == (0, Result.INVALID)


def test_rally_points_are_replaced_as_a_whole_or_kept():
    rally = RallyPoints()
    good = [item(0, RALLY_POINT, 10.0, 20.0, 15.0, frame=3)]
    assert rally.load(good) is None
    for bad, seq, result in (
        ([*good, item(1, 16)], 1, Result.UNSUPPORTED),
        ([item(0, RALLY_POINT, 10.0, 20.0, float("nan"), frame=3)], 0, Result.PARAM7),
        ([item(i, RALLY_POINT) for i in range(MAX_RALLY_POINTS + 1)], MAX_RALLY_POINTS, Result.NO_SPACE),
    ):
        refusal = rally.load(bad)
        assert (refusal.seq, refusal.result) == (seq, result)
        assert list(rally.items) == good
    assert rally.load([]) is None
    assert rally.items == ()
