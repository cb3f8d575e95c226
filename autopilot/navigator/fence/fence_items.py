"""Which fence items are taken: polygons by their vertices, circles, a return point; checked as a whole when loaded.

In: a list as the mission protocol carries it. Out: shapes on the earth, or the reason why the list is refused.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from math import cos, isfinite, radians

import numpy as np
from numpy.typing import NDArray

from autopilot.interface.item_lists import ItemRefusal, MissionItem
from autopilot.navigator.mission.item_commands import Result

MAX_FENCE_ITEMS = 500  # bounds memory, and the time of a check near a border
MIN_VERTICES = 3
_Array = NDArray[np.float64]
_METRES_PER_DEG = 111_320.0  # of latitude; only the shape matters here
_LATLON_FRAMES = frozenset((0, 3, 5, 6, 10, 11))  # MAV_FRAME; the altitude of a fence item means nothing


class FenceCommand(IntEnum):
    """Numbered as MAV_CMD."""

    RETURN_POINT = 5000
    INCLUSION_VERTEX = 5001
    EXCLUSION_VERTEX = 5002
    INCLUSION_CIRCLE = 5003
    EXCLUSION_CIRCLE = 5004


_VERTICES = (FenceCommand.INCLUSION_VERTEX, FenceCommand.EXCLUSION_VERTEX)
_CIRCLES = (FenceCommand.INCLUSION_CIRCLE, FenceCommand.EXCLUSION_CIRCLE)
_INCLUSIONS = (FenceCommand.INCLUSION_VERTEX, FenceCommand.INCLUSION_CIRCLE)


@dataclass(frozen=True, slots=True)
class GeoPolygon:
    """Inside of it the vehicle must stay (inclusion), or may not be (exclusion)."""

    vertices: tuple[tuple[float, float], ...]  # [deg] latitude, longitude
    is_inclusion: bool


@dataclass(frozen=True, slots=True)
class GeoCircle:
    """As a polygon; with the radius 0 it is kept, and never breached."""

    lat_deg: float
    lon_deg: float
    radius_m: float
    is_inclusion: bool


GeoShape = GeoPolygon | GeoCircle


def fence_shapes(items: Sequence[MissionItem]) -> tuple[GeoShape, ...] | ItemRefusal:
    """The shapes of a fence, or the first reason not to take it, naming the item."""
    if len(items) > MAX_FENCE_ITEMS:
        return ItemRefusal(MAX_FENCE_ITEMS, Result.NO_SPACE, f"a fence has at most {MAX_FENCE_ITEMS} items")
    for i_item, item in enumerate(items):
        refusal = _item_refusal(i_item, item)
        if refusal is not None:
            return refusal
    shapes: list[GeoShape] = []
    i_item = 0
    while i_item < len(items):
        item = items[i_item]
        if item.command in _VERTICES:
            count = int(item.params[0])
            refusal = _polygon_refusal(items, i_item, count)
            if refusal is not None:
                return refusal
            vertices = tuple((vertex.x, vertex.y) for vertex in items[i_item : i_item + count])
            shapes.append(GeoPolygon(vertices, item.command in _INCLUSIONS))
            i_item += count
            continue
        if item.command in _CIRCLES:
            shapes.append(GeoCircle(item.x, item.y, item.params[0], item.command in _INCLUSIONS))
        i_item += 1
    return tuple(shapes)


def position_refusal(i_item: int, item: MissionItem) -> ItemRefusal | None:
    """Why a fence item or a rally point is at no position on the earth."""
    if item.seq != i_item:
        return ItemRefusal(i_item, Result.INVALID_SEQUENCE, f"has the number {item.seq}")
    if item.frame not in _LATLON_FRAMES:
        return ItemRefusal(i_item, Result.UNSUPPORTED_FRAME, f"frame {item.frame} is not supported")
    if not (isfinite(item.x) and abs(item.x) <= 90.0):
        return ItemRefusal(i_item, Result.PARAM5_X, f"latitude {item.x} is not on earth")
    if not (isfinite(item.y) and abs(item.y) <= 180.0):
        return ItemRefusal(i_item, Result.PARAM6_Y, f"longitude {item.y} is not on earth")
    return None


def _item_refusal(i_item: int, item: MissionItem) -> ItemRefusal | None:
    first = item.params[0]
    if item.command in _VERTICES:
        if not (isfinite(first) and first == int(first) and first >= MIN_VERTICES):
            return ItemRefusal(i_item, Result.INVALID, f"a polygon of {first:g} vertices is none")
    elif item.command in _CIRCLES:
        if not (isfinite(first) and first >= 0.0):
            return ItemRefusal(i_item, Result.PARAM1, f"radius {first} m is out of range")
    elif item.command != FenceCommand.RETURN_POINT:
        return ItemRefusal(i_item, Result.UNSUPPORTED, f"command {item.command} is no fence item")
    return position_refusal(i_item, item)


def _polygon_refusal(items: Sequence[MissionItem], start: int, count: int) -> ItemRefusal | None:
    vertices = items[start : start + count]
    for i_vertex, vertex in enumerate(vertices):
        if (vertex.command, vertex.params[0]) != (items[start].command, count):
            reason = f"vertex {i_vertex + 1} of {count} does not belong to the same polygon"
            return ItemRefusal(start + i_vertex, Result.INVALID, reason)
    if len(vertices) < count:
        reason = f"the polygon has {len(vertices)} of {count} vertices"
        return ItemRefusal(len(items) - 1, Result.INVALID, reason)
    if _crosses_itself(vertices):
        return ItemRefusal(start, Result.INVALID, "the polygon crosses itself or has no area")
    return None


def _crosses_itself(vertices: Sequence[MissionItem]) -> bool:
    """Whether two edges meet that are not neighbours, or two vertices are one."""
    degrees = np.array([(vertex.x, vertex.y) for vertex in vertices])
    metres = (degrees - degrees[0]) * _METRES_PER_DEG
    metres[:, 1] *= cos(radians(float(degrees[0, 0])))
    ends = np.roll(metres, -1, axis=0)
    if np.any(np.hypot(*(ends - metres).T) < 1e-3):
        return True
    area = 0.5 * abs(float(np.sum(metres[:, 0] * ends[:, 1] - metres[:, 1] * ends[:, 0])))
    if area < 1e-2:
        return True
    count = len(metres)
    for i_edge in range(count - 2):
        # Edges after the next one, without the last if that is a neighbour too.
        others = slice(i_edge + 2, count - 1 if i_edge == 0 else count)
        if np.any(_meet(metres[i_edge], ends[i_edge], metres[others], ends[others])):
            return True
    return False


def _meet(start: _Array, end: _Array, starts: _Array, ends: _Array) -> NDArray[np.bool_]:
    """Whether a segment meets each of the others, by the sides on which their ends lie."""
    one = _side(start, end, starts) * _side(start, end, ends)
    other = _side(starts, ends, start) * _side(starts, ends, end)
    meets: NDArray[np.bool_] = (one <= 0.0) & (other <= 0.0) & ((one != 0.0) | (other != 0.0))
    return meets


def _side(start: _Array, end: _Array, point: _Array) -> _Array:
    edge, to_point = end - start, point - start
    sides: _Array = np.sign(edge[..., 0] * to_point[..., 1] - edge[..., 1] * to_point[..., 0])
    return sides
