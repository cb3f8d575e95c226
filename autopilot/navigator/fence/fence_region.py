"""The area in which a fence lets the vehicle be, over the ned plane.

Inside at least one inclusion (if there are any) and outside every exclusion, as PX4 has it. Every shape's edges lie in
one array, so that the distance to the nearest border costs the same few microseconds for 4 edges and for 400.
"""

from collections.abc import Sequence
from math import inf

import numpy as np
from numpy.typing import NDArray

from autopilot.navigator.fence.fence_items import GeoPolygon, GeoShape
from common.geodesy import GeoPoint, ned_from_geodetic

Point = tuple[float, float]  # [m] north, east
FloatArray = NDArray[np.float64]


class Region:
    """Fence shapes in the plane.

    Attributes:
        polygons: their vertices [m] and whether they are inclusions.
        circles: centre [m], radius [m] and whether they are inclusions; none has the radius 0.
    """

    __slots__ = (
        "_can_include", "_east", "_end_north", "_inverse_length_sq", "_is_inclusion", "_north", "_slope", "_starts",
        "_to_east", "_to_north", "circles", "polygons",
    )  # fmt: skip

    def __init__(
        self, polygons: Sequence[tuple[Sequence[Point], bool]], circles: Sequence[tuple[Point, float, bool]]
    ) -> None:
        self.polygons = tuple((tuple(vertices), is_inclusion) for vertices, is_inclusion in polygons)
        self.circles = tuple(circle for circle in circles if circle[1] > 0.0)
        corners = [np.array(vertices, dtype=np.float64) for vertices, _ in self.polygons]
        starts = np.concatenate(corners) if corners else np.zeros((0, 2))
        ends = np.concatenate([np.roll(vertices, -1, axis=0) for vertices in corners]) if corners else starts
        edge = ends - starts
        self._north, self._east = starts.T
        self._end_north = ends[:, 0].copy()
        self._to_north, self._to_east = edge.T
        self._inverse_length_sq = 1.0 / np.maximum(np.sum(edge * edge, axis=1), 1e-9)
        self._slope = edge[:, 1] / np.where(edge[:, 0] == 0.0, inf, edge[:, 0])  # east per north; 0 along a parallel
        counts = [len(vertices) for vertices in corners]
        self._starts = np.cumsum([0, *counts[:-1]]) if counts else np.zeros(0, dtype=np.int64)
        self._is_inclusion = np.array([is_inclusion for _, is_inclusion in self.polygons], dtype=bool)
        inclusions = [is_inclusion for *_, is_inclusion in (*self.polygons, *self.circles)]
        self._can_include = any(inclusions)

    def __bool__(self) -> bool:
        return bool(self.polygons or self.circles)

    def clearance(self, north: float, east: float) -> float:
        """Distance [m] to where this changes: positive inside the area, negative outside; never too far.

        Within that distance the vehicle stays on the same side, so that it need not ask again until it has moved that
        far.
        """
        return float(self.clearances(np.array([[north, east]]))[0])

    def clearances(self, points: FloatArray) -> FloatArray:
        """The clearance [m] of many points, shape (points, 2)."""
        included = np.full(len(points), -inf)
        excluded = np.full(len(points), inf)
        if len(self._starts):
            signed = self._signed_distances(points)
            if self._is_inclusion.any():
                included = signed[:, self._is_inclusion].max(axis=1)
            if not self._is_inclusion.all():
                excluded = -signed[:, ~self._is_inclusion].max(axis=1)
        for (centre_north, centre_east), radius, is_inclusion in self.circles:
            inside = radius - np.hypot(points[:, 0] - centre_north, points[:, 1] - centre_east)
            if is_inclusion:
                included = np.maximum(included, inside)
            else:
                excluded = np.minimum(excluded, -inside)
        return np.minimum(included, excluded) if self._can_include else excluded

    def _signed_distances(self, points: FloatArray) -> FloatArray:
        """Distance [m] from each point to the border of each polygon, positive inside."""
        north, east = points[:, :1], points[:, 1:]
        to_north, to_east = north - self._north, east - self._east
        fraction = (to_north * self._to_north + to_east * self._to_east) * self._inverse_length_sq
        fraction = np.minimum(np.maximum(fraction, 0.0), 1.0)
        off_north = to_north - fraction * self._to_north
        off_east = to_east - fraction * self._to_east
        off_sq = off_north * off_north + off_east * off_east
        nearest = np.sqrt(np.minimum.reduceat(off_sq, self._starts, axis=1))
        # An eastward ray crosses the border an odd number of times from inside.
        # Compared as they are: differences could round to a crossing of one edge at a corner and of none at the next.
        spans = (north >= self._north) != (north >= self._end_north)
        crosses = spans & (to_east < to_north * self._slope)
        is_inside = np.add.reduceat(crosses.astype(np.int64), self._starts, axis=1) & 1
        signed: FloatArray = np.where(is_inside, nearest, -nearest)
        return signed


def region_of(shapes: Sequence[GeoShape], origin: GeoPoint) -> Region:
    """The area of a fence around an origin."""
    polygons: list[tuple[list[Point], bool]] = []
    circles: list[tuple[Point, float, bool]] = []
    for shape in shapes:
        if isinstance(shape, GeoPolygon):
            vertices = [ned_from_geodetic(lat, lon, origin.alt_m, origin)[:2] for lat, lon in shape.vertices]
            polygons.append((vertices, shape.is_inclusion))
        else:
            centre = ned_from_geodetic(shape.lat_deg, shape.lon_deg, origin.alt_m, origin)[:2]
            circles.append((centre, shape.radius_m, shape.is_inclusion))
    return Region(polygons, circles)
