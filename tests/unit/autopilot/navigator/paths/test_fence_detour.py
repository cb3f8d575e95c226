"""Ways around fences: open all along, not much longer than they must be, and found whenever there is one."""

import itertools
from math import cos, dist, hypot, inf, pi, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autopilot.navigator.fence.fence_region import Region
from autopilot.navigator.paths.fence_detour import Bounds, detour

MARGIN = 2.0
BLOCK = ((-20.0, 40.0), (20.0, 40.0), (20.0, 60.0), (-20.0, 60.0))
YARD = ((-100.0, -100.0), (-100.0, 200.0), (100.0, 200.0), (100.0, -100.0))
U_SHAPE = ((-50.0, 0.0), (50.0, 0.0), (50.0, 100.0), (30.0, 100.0), (30.0, 20.0), (-30.0, 20.0), (-30.0, 100.0),
           (-50.0, 100.0))  # fmt: skip


def length_of(start, way):
    return sum(dist(a, b) for a, b in itertools.pairwise((start, *way)))


def bounds(polygons=(), circles=(), reach=inf):
    return Bounds(Region(polygons, circles), MARGIN, (0.0, 0.0), reach)


def least_clearance(where, start, way):
    points = np.array([start, *way])
    along = [a + (b - a) * fraction for a, b in itertools.pairwise(points) for fraction in np.linspace(0, 1, 400)]
    return float(where.clearances(np.array(along)).min())


def test_direct_way_is_taken_where_nothing_is_in_it():
    where = bounds([(YARD, True), (BLOCK, False)])
    assert detour(where, (0.0, 0.0), (0.0, 30.0)) == [(0.0, 30.0)]


@pytest.mark.parametrize(
    ("polygons", "circles", "start", "goal", "longest"),
    [
        ([(BLOCK, False)], [], (0.0, 100.0), (0.0, 0.0), 115.0),
        ([(BLOCK[::-1], False)], [], (0.0, 100.0), (0.0, 0.0), 115.0),
        ([(YARD, True), (BLOCK, False)], [], (5.0, 100.0), (0.0, 0.0), 115.0),
        ([], [((0.0, 50.0), 20.0, False)], (0.0, 100.0), (0.0, 0.0), 122.0),
        ([(U_SHAPE, False)], [], (0.0, 60.0), (0.0, -20.0), 260.0),  # out of the U and around it
        ([(U_SHAPE, True)], [], (40.0, 90.0), (-40.0, 90.0), 240.0),  # inside a U-shaped field
        ([(BLOCK, False)], [((0.0, 80.0), 15.0, False)], (0.0, 110.0), (0.0, 0.0), 125.0),
    ],
)
def test_way_around_keeps_the_margin(polygons, circles, start, goal, longest):
    where = bounds(polygons, circles)
    way = detour(where, start, goal)
    assert way[-1] == goal
    assert least_clearance(where, start, way) >= MARGIN - 0.01
    assert hypot(start[0] - goal[0], start[1] - goal[1]) < length_of(start, way) < longest


def test_start_inside_a_zone_is_left_by_the_shortest_stretch():
    where = bounds([(BLOCK, False)])
    way = detour(where, (-15.0, 57.0), (0.0, 0.0))
    assert hypot(way[0][0] + 15.0, way[0][1] - 57.0) < 7.0
    assert least_clearance(where, way[0], way[1:]) >= MARGIN - 0.01


def test_start_outside_the_yard_and_goal_close_to_its_border_are_joined():
    where = bounds([(YARD, True)])
    way = detour(where, (120.0, 0.0), (99.0, 150.0))
    assert way[-1] == (99.0, 150.0)
    assert least_clearance(where, way[0], way[1:-1]) >= MARGIN - 0.01


def test_walled_goal_has_no_way():
    rings = [((cos(a) * 30.0, sin(a) * 30.0), 10.0, False) for a in np.linspace(0, 2 * pi, 20)]
    assert detour(bounds([], rings), (100.0, 0.0), (0.0, 0.0)) is None


def test_way_stays_within_reach_of_home():
    wide = ((-20.0, 40.0), (45.0, 40.0), (45.0, 60.0), (-20.0, 60.0))
    assert min(north for north, _ in detour(bounds([(wide, False)]), (10.0, 75.0), (10.0, 0.0))) < -20.0
    assert detour(bounds([(wide, False)], reach=80.0), (10.0, 75.0), (10.0, 0.0))[-1] == (10.0, 0.0)
    long = ((-70.0, 40.0), (70.0, 40.0), (70.0, 60.0), (-70.0, 60.0))
    assert detour(bounds([(long, False)], reach=80.0), (0.0, 75.0), (0.0, 0.0)) is None


@settings(deadline=None, max_examples=25)
@given(
    st.lists(st.tuples(st.floats(20.0, 180.0), st.floats(-60.0, 60.0), st.floats(3.0, 25.0)), min_size=1, max_size=6)
)
def test_way_between_random_circles_never_enters_one(circles):
    where = bounds([], [((north, east), radius, False) for north, east, radius in circles])
    start, goal = (220.0, 0.0), (-20.0, 0.0)
    way = detour(where, start, goal)
    assert way is not None
    assert least_clearance(where, start, way) >= MARGIN - 0.01
