"""A way around what a fence excludes: the shortest path over the corners of its shapes, moved away from the border.

A visibility graph searched with A* (Hart, Nilsson and Raphael, 1968), in the plane. A stretch is open if it keeps its
distance to the border all along; that is found by steps as long as the clearance allows. Bounded in nodes and steps,
so that the largest fence costs a fraction of a second, once per way.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from math import atan2, ceil, cos, inf, pi, sin

import numpy as np
from numpy.typing import NDArray

from autopilot.navigator.fence.fence_region import FloatArray, Point, Region
from common.attitude import wrapped

_NODES_MAX = 160  # corners of a way, those nearest to the direct one first
_STEPS_MAX = 600  # per stretch; a longer one counts as closed
_CORNER_FRACTION = (
    1.5  # corners are passed at this multiple of the margin, so that the stretches between keep the margin
)
_CIRCLE_CORNERS = 12
_TURN_PER_CORNER = 0.5 * pi
_EXIT_COURSES = 48
_EXIT_RINGS = 400


@dataclass(frozen=True, slots=True)
class Bounds:
    """Where a way may lead.

    Args:
        region: the fence's shapes.
        margin_m: distance kept to the border.
        centre: [m] of the circle that may not be left.
        reach_m: its radius; infinite if there is none.
    """

    region: Region
    margin_m: float
    centre: Point = (0.0, 0.0)
    reach_m: float = inf

    def clearances(self, points: FloatArray) -> FloatArray:
        """Distance [m] to the nearest border, negative outside."""
        inside = self.reach_m - np.hypot(points[:, 0] - self.centre[0], points[:, 1] - self.centre[1])
        return np.minimum(self.region.clearances(points), inside) if self.region else inside

    def are_open(self, start: FloatArray, ends: FloatArray) -> NDArray[np.bool_]:
        """Whether the straight stretches from a point to others keep the margin."""
        path = ends - start
        length = np.hypot(path[:, 0], path[:, 1])
        course = path / np.maximum(length, 1e-9)[:, None]
        done = np.zeros(len(ends))
        is_open = np.ones(len(ends), dtype=bool)
        left = np.flatnonzero(length > 0.0)
        step = 0.5 * self.margin_m * (_CORNER_FRACTION - 1.0)
        for _ in range(_STEPS_MAX):
            if not len(left):
                return is_open
            spare = self.clearances(start + course[left] * done[left, None]) - self.margin_m
            is_open[left] = spare >= -1e-6
            done[left] += np.maximum(spare, step)
            left = left[is_open[left] & (done[left] < length[left])]
        is_open[left] = False
        return is_open


def detour(bounds: Bounds, start: Point, goal: Point) -> list[Point] | None:
    """The points [m] of a way to the goal, the goal last; None if there is none.

    A start or goal that is too near to the border, or outside, is left or reached by the shortest stretch.
    """
    left = _nearest_open(bounds, start, goal)
    entered = _nearest_open(bounds, goal, start)
    if left is None or entered is None:
        return None
    path = _shortest(bounds, left, entered)
    if path is None:
        return None
    if left != start:
        path.insert(0, left)
    if entered != goal:
        path.append(goal)
    return path


def _nearest_open(bounds: Bounds, position: Point, other: Point) -> Point | None:
    """The position, or the nearest one that keeps the margin: of several the nearest to `other`."""
    clearance = float(bounds.clearances(np.array([position]))[0])
    if clearance >= bounds.margin_m:
        return position
    courses = np.linspace(0.0, 2.0 * pi, _EXIT_COURSES, endpoint=False)
    ring = np.stack((np.cos(courses), np.sin(courses)), axis=1)
    radius = bounds.margin_m - clearance
    for _ in range(_EXIT_RINGS):
        points = np.array(position) + radius * ring
        is_open = bounds.clearances(points) >= bounds.margin_m
        if is_open.any():
            candidates = points[is_open]
            to_other = np.hypot(candidates[:, 0] - other[0], candidates[:, 1] - other[1])
            north, east = candidates[int(np.argmin(to_other))]
            return float(north), float(east)
        radius += 0.5 * bounds.margin_m
    return None


def _shortest(bounds: Bounds, start: Point, goal: Point) -> list[Point] | None:
    """The shortest way over corners, without its start."""
    if bounds.are_open(np.array(start), np.array([goal]))[0]:
        return [goal]
    nodes = np.array([start, goal, *_corners(bounds, start, goal)])
    to_goal = np.hypot(nodes[:, 0] - goal[0], nodes[:, 1] - goal[1])
    cost = np.full(len(nodes), inf)
    cost[0] = 0.0
    came_from = np.zeros(len(nodes), dtype=np.int64)
    is_done = np.zeros(len(nodes), dtype=bool)
    queue = [(float(to_goal[0]), 0)]
    while queue:
        _, i_node = heappop(queue)
        if is_done[i_node]:
            continue
        is_done[i_node] = True
        if i_node == 1:
            return _traced(nodes, came_from)
        length = np.hypot(nodes[:, 0] - nodes[i_node, 0], nodes[:, 1] - nodes[i_node, 1])
        nearer = np.flatnonzero(~is_done & (cost[i_node] + length < cost))
        nearer = nearer[bounds.are_open(nodes[i_node], nodes[nearer])]
        for i_next in nearer:
            cost[i_next] = cost[i_node] + length[i_next]
            came_from[i_next] = i_node
            heappush(queue, (float(cost[i_next] + to_goal[i_next]), int(i_next)))
    return None


def _traced(nodes: FloatArray, came_from: NDArray[np.int64]) -> list[Point]:
    path: list[Point] = []
    i_node = 1
    while i_node != 0:
        path.append((float(nodes[i_node, 0]), float(nodes[i_node, 1])))
        i_node = int(came_from[i_node])
    return path[::-1]


def _corners(bounds: Bounds, start: Point, goal: Point) -> list[Point]:
    """Points around every corner, those that keep the margin, nearest to the direct way first."""
    distance = _CORNER_FRACTION * bounds.margin_m
    points: list[Point] = []
    for vertices, is_inclusion in bounds.region.polygons:
        points += _around_polygon(vertices, distance, is_inclusion=is_inclusion)
    for centre, radius, is_inclusion in bounds.region.circles:
        if not is_inclusion:
            points += _arc(centre, (radius + distance), 0.0, 2.0 * pi, _CIRCLE_CORNERS)
    if not points:
        return []
    found = np.array(points)
    found = found[bounds.clearances(found) >= bounds.margin_m]
    detour_m = np.hypot(*(found - start).T) + np.hypot(*(found - goal).T)
    return [(float(north), float(east)) for north, east in found[np.argsort(detour_m, kind="stable")[:_NODES_MAX]]]


def _around_polygon(vertices: Sequence[Point], distance: float, *, is_inclusion: bool) -> Iterator[Point]:
    """Points [m] on the allowed side of the corners that stick into it."""
    area = 0.0
    for i, (north, east) in enumerate(vertices):
        next_north, next_east = vertices[(i + 1) % len(vertices)]
        area += north * next_east - next_north * east
    turn_sign = 1.0 if area > 0.0 else -1.0  # the interior is to the right of a clockwise border (north, east)
    side = -turn_sign if is_inclusion else turn_sign
    for i, corner in enumerate(vertices):
        before, after = vertices[i - 1], vertices[(i + 1) % len(vertices)]
        course_in = atan2(corner[1] - before[1], corner[0] - before[0])
        course_out = atan2(after[1] - corner[1], after[0] - corner[0])
        turn = wrapped(course_out - course_in)
        if turn * side > 1e-3:  # the border turns away from the allowed side
            normal = course_in - side * 0.5 * pi
            yield from _arc(corner, distance, normal, turn, max(1, ceil(abs(turn) / _TURN_PER_CORNER)))


def _arc(centre: Point, radius: float, first: float, turn: float, count: int) -> Iterator[Point]:
    """Corners [m] of the open polygon around an arc that touches it in the middles of its edges."""
    part = turn / count
    outer = radius / cos(0.5 * part)
    for i in range(count):
        course = first + (i + 0.5) * part
        yield centre[0] + outer * cos(course), centre[1] + outer * sin(course)
