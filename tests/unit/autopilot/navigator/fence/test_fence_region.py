"""Laws of the fenced area: what is inside, and how far it is to the border."""

from math import cos, hypot, pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from autopilot.navigator.fence.fence_region import Region

SQUARE = ((0.0, 0.0), (0.0, 100.0), (100.0, 100.0), (100.0, 0.0))
HOLE = ((40.0, 40.0), (60.0, 40.0), (60.0, 60.0), (40.0, 60.0))
NOTCHED = ((0.0, 0.0), (0.0, 100.0), (100.0, 100.0), (100.0, 60.0), (30.0, 50.0), (100.0, 40.0), (100.0, 0.0))
REGIONS = {
    "square": Region([(SQUARE, True)], []),
    "notched": Region([(NOTCHED, True)], []),
    "hole": Region([(SQUARE, True), (HOLE, False)], []),
    "two": Region([(SQUARE, True)], [((50.0, 130.0), 50.0, True)]),
    "keep out": Region([(HOLE, False)], [((0.0, 0.0), 10.0, False)]),
}
positions = st.tuples(st.floats(-50.0, 200.0), st.floats(-50.0, 200.0))


@pytest.mark.parametrize(
    ("name", "position", "clearance"),
    [
        ("square", (50.0, 20.0), 20.0),
        ("square", (-10.0, 50.0), -10.0),
        ("square", (-3.0, -4.0), -5.0),
        ("notched", (95.0, 50.0), None),
        ("hole", (50.0, 30.0), 10.0),
        ("hole", (50.0, 45.0), -5.0),
        ("two", (50.0, 170.0), 10.0),
        ("two", (50.0, 90.0), 10.0),  # of the circle; the square gives as much
        ("keep out", (0.0, 30.0), 20.0),
        ("keep out", (5.0, 0.0), -5.0),
    ],
)
def test_clearance_is_the_distance_to_the_border_that_counts(name, position, clearance):
    found = REGIONS[name].clearance(*position)
    assert found < 0.0 if clearance is None else found == pytest.approx(clearance)


def test_region_without_shapes_ends_nowhere():
    assert not Region([], [])
    assert Region([], [((0.0, 0.0), 0.0, True)]).clearance(1e6, 0.0) > 1e9  # a circle without a radius is none


@given(st.sampled_from(sorted(REGIONS)), positions, positions)
def test_clearance_changes_by_at_most_the_way(name, a, b):
    region = REGIONS[name]
    way = hypot(a[0] - b[0], a[1] - b[1])
    assert abs(region.clearance(*a) - region.clearance(*b)) <= way + 1e-6 or (
        region.clearance(*a) * region.clearance(*b) > 0.0  # of the same side: it may only be less than it could
    )


@given(st.sampled_from(sorted(REGIONS)), positions, st.floats(0.0, 2.0 * pi), st.floats(0.0, 0.999))
def test_side_does_not_change_within_the_clearance(name, position, course, fraction):
    region = REGIONS[name]
    clearance = region.clearance(*position)
    way = abs(clearance) * fraction
    moved = region.clearance(position[0] + way * cos(course), position[1] + way * sin(course))
    assert (moved >= 0.0) == (clearance >= 0.0) or abs(moved) < 1e-6 or abs(clearance) < 1e-6


@given(positions)
def test_star_shaped_polygon_has_the_inside_that_its_radius_says(position):
    courses = np.linspace(0.0, 2.0 * pi, 60, endpoint=False)
    radii = 60.0 + 30.0 * np.sin(5.0 * courses)
    star = [(float(r * cos(c)), float(r * sin(c))) for r, c in zip(radii, courses, strict=True)]
    course = np.arctan2(position[1], position[0]) % (2.0 * pi)
    limit = np.interp(course, [*courses, 2.0 * pi], [*radii, radii[0]])
    distance = hypot(*position)
    if abs(distance - limit) > 2.0:  # the border is made of chords
        assert (Region([(star, True)], []).clearance(*position) > 0.0) == (distance < limit)
