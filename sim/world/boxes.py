"""Boxes: free-standing upright boxes on the ground, some of which run to and fro: walls, kerbs, parked cars, carts.

A box that moves runs along its own heading between the two ends of its way, at a constant speed, turning at once. Where
it is is a function of the tick alone: the same for every vehicle of a world, and exact however long a run is. Queries
are exact; each asks every box, so a world has some tens. A world without any costs one comparison.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from sim.world.terrain import FloatArray
from sim.world.trees import NO_OBSTACLE_M
from sim.world.walls import slab

wp.set_module_options({"enable_backward": False})


@wp.struct
class Box:
    """One box; heights are above the home plane."""

    north: float  # [m] middle of its ground plan; of one that moves: of its way
    east: float
    cos_yaw: float  # of its heading
    sin_yaw: float
    half_length: float  # [m] along its heading
    half_width: float
    low: float  # [m] under ground
    high: float
    half_way: float  # [m] it runs this far ahead of the middle and back to this far behind it
    period_ticks: int  # of one run to and fro, 0: it stands
    start_ticks: int  # how far into a run it is at tick 0, below the period


@wp.struct
class Boxes:
    """All boxes of one world, and what time it is there."""

    boxes: wp.array[Box]  # the first box_count; there may be room for more
    box_count: int
    tick: int  # as `common.rng.draw_tick` counts
    top_m: float  # height of the highest box above the home plane


@wp.func
def box_middle(box: Box, tick: int) -> wp.vec2:
    """Where the middle of a box is at a tick: north, east [m]."""
    ahead = float(0.0)
    if box.period_ticks > 0:
        phase = float((tick % box.period_ticks + box.start_ticks) % box.period_ticks) / float(box.period_ticks)
        ahead = box.half_way * (4.0 * wp.abs(phase - 0.5) - 1.0)
    return wp.vec2(box.north + ahead * box.cos_yaw, box.east + ahead * box.sin_yaw)


@wp.func
def in_box_axes(box: Box, north: float, east: float) -> wp.vec2:
    """A level vector along the heading of a box and to its right."""
    return wp.vec2(box.cos_yaw * north + box.sin_yaw * east, box.cos_yaw * east - box.sin_yaw * north)


@wp.func
def boxes_contact(boxes: Boxes, pos_ned: wp.vec3, radius: float) -> wp.vec4:
    """Deepest contact of a sphere with the boxes: unit push-out normal (ned), penetration [m]; 0 for none."""
    deepest = wp.vec4(0.0, 0.0, 0.0, 0.0)
    if -pos_ned[2] - radius > boxes.top_m:
        return deepest
    for i_box in range(boxes.box_count):
        contact = box_contact(boxes.boxes[i_box], boxes.tick, pos_ned, radius)
        if contact[3] > deepest[3]:
            deepest = contact
    return deepest


@wp.func
def box_contact(box: Box, tick: int, pos_ned: wp.vec3, radius: float) -> wp.vec4:
    """Contact of a sphere with one box, as `boxes_contact`; the penetration is negative when they are apart."""
    middle = box_middle(box, tick)
    at = in_box_axes(box, pos_ned[0] - middle[0], pos_ned[1] - middle[1])
    height = -pos_ned[2]
    off_ahead = at[0] - wp.clamp(at[0], -box.half_length, box.half_length)
    off_right = at[1] - wp.clamp(at[1], -box.half_width, box.half_width)
    off_up = height - wp.clamp(height, box.low, box.high)
    off = wp.sqrt(off_ahead * off_ahead + off_right * off_right + off_up * off_up)
    depth = radius - off
    if off <= 0.0:  # centre inside the box: out through the nearest of its sides and its top
        to_side = wp.min(box.half_length - wp.abs(at[0]), box.half_width - wp.abs(at[1]))
        nearest = wp.min(to_side, box.high - height)
        depth = radius + nearest
        off = 1.0
        if nearest < to_side:
            off_up = 1.0
        elif box.half_length - wp.abs(at[0]) <= box.half_width - wp.abs(at[1]):
            off_ahead = wp.where(at[0] < 0.0, -1.0, 1.0)
        else:
            off_right = wp.where(at[1] < 0.0, -1.0, 1.0)
    north = (box.cos_yaw * off_ahead - box.sin_yaw * off_right) / off
    east = (box.sin_yaw * off_ahead + box.cos_yaw * off_right) / off
    return wp.vec4(north, east, -off_up / off, depth)


@wp.func
def boxes_ray_hit(boxes: Boxes, origin_ned: wp.vec3, dir_ned: wp.vec3, max_m: float) -> float:
    """Distance [m] along a ray of unit direction to the first box, `max_m` if none; 0 from inside one."""
    nearest = float(max_m)
    if -wp.max(origin_ned[2], origin_ned[2] + max_m * dir_ned[2]) > boxes.top_m:
        return nearest
    for i_box in range(boxes.box_count):
        nearest = wp.min(nearest, box_ray_hit(boxes.boxes[i_box], boxes.tick, origin_ned, dir_ned, nearest))
    return nearest


@wp.func
def box_ray_hit(box: Box, tick: int, origin_ned: wp.vec3, dir_ned: wp.vec3, max_m: float) -> float:
    """Distance [m] along a ray to one box, `max_m` if it is not nearer; 0 from inside it."""
    middle = box_middle(box, tick)
    start = in_box_axes(box, origin_ned[0] - middle[0], origin_ned[1] - middle[1])
    rate = in_box_axes(box, dir_ned[0], dir_ned[1])
    # the ray is inside the box where it is inside all three slabs (Kay and Kajiya 1986)
    lengthwise = slab(start[0], rate[0], -box.half_length, box.half_length)
    across = slab(start[1], rate[1], -box.half_width, box.half_width)
    upright = slab(-origin_ned[2], -dir_ned[2], box.low, box.high)
    entry = wp.max(0.0, wp.max(lengthwise[0], wp.max(across[0], upright[0])))
    leave = wp.min(lengthwise[1], wp.min(across[1], upright[1]))
    if entry <= leave:
        return wp.min(entry, max_m)
    return max_m


def box_type() -> np.dtype[np.void]:
    """The NumPy type of one `Box`."""
    kernel_type: Any = Box
    return np.dtype(kernel_type.numpy_dtype())


def no_boxes() -> NDArray[np.void]:
    """The boxes of a world that has none."""
    return np.zeros(0, dtype=box_type())


@dataclass(frozen=True, eq=False, slots=True)
class BoxesMap:
    """The boxes on the host, queried in float64 as they stand at a tick."""

    rows: NDArray[np.void]  # fields of `Box`, (boxes,)

    @property
    def top_m(self) -> float:
        """Height of the highest box above the home plane [m]; far below ground without any."""
        return float(self.rows["high"].max(initial=NO_OBSTACLE_M))

    def kernel(self, device: str) -> Boxes:
        """The boxes as kernels read them."""
        boxes = Boxes()
        boxes.boxes = wp.array(self.rows, dtype=Box, device=device)
        boxes.box_count = len(self.rows)
        boxes.top_m = self.top_m
        return boxes

    def middle(self, tick: int = 0) -> FloatArray:
        """North and east of the boxes' middles at a tick [m], shape (boxes, 2)."""
        rows = self.rows
        period = np.maximum(rows["period_ticks"], 1)
        phase = (tick + rows["start_ticks"].astype(np.int64)) % period / period
        ahead = np.where(rows["period_ticks"] > 0, rows["half_way"] * (4.0 * np.abs(phase - 0.5) - 1.0), 0.0)
        return np.stack([rows["north"] + ahead * rows["cos_yaw"], rows["east"] + ahead * rows["sin_yaw"]], axis=-1)

    def distance(self, pos_ned: FloatArray, tick: int = 0) -> FloatArray:
        """Distance [m] from each point, shape (points, 3), to the nearest box; negative inside, inf without any."""
        rows = self.rows
        off = pos_ned[:, None, :2] - self.middle(tick)
        ahead = np.abs(off[..., 0] * rows["cos_yaw"] + off[..., 1] * rows["sin_yaw"]) - rows["half_length"]
        right = np.abs(off[..., 1] * rows["cos_yaw"] - off[..., 0] * rows["sin_yaw"]) - rows["half_width"]
        above = -pos_ned[:, [2]] - rows["high"]
        below = rows["low"] + pos_ned[:, [2]]
        beyond = np.stack([ahead, right, above, below], axis=-1)
        outside = np.sqrt((np.maximum(beyond, 0.0) ** 2).sum(axis=-1))
        inside = beyond[..., :3].max(axis=-1)  # nothing is pushed out downwards
        return np.asarray(np.where(outside > 0.0, outside, inside).min(axis=1, initial=np.inf))

    def ray_hit(self, origin_ned: FloatArray, dir_ned: FloatArray, max_m: float, tick: int = 0) -> float:
        """Distance [m] along a ray of unit direction to the first box, `max_m` if none; 0 from inside one."""
        rows = self.rows
        if rows.size == 0:
            return max_m
        cos, sin = rows["cos_yaw"].astype(np.float64), rows["sin_yaw"].astype(np.float64)
        off = origin_ned[:2] - self.middle(tick)
        start = np.stack([off[:, 0] * cos + off[:, 1] * sin, off[:, 1] * cos - off[:, 0] * sin], axis=-1)
        rate = np.stack([dir_ned[0] * cos + dir_ned[1] * sin, dir_ned[1] * cos - dir_ned[0] * sin], axis=-1)
        start = np.column_stack([start, np.full(len(rows), -origin_ned[2])])
        rate = np.column_stack([rate, np.full(len(rows), -dir_ned[2])])
        low = np.column_stack([-rows["half_length"], -rows["half_width"], rows["low"]])
        high = np.column_stack([rows["half_length"], rows["half_width"], rows["high"]])
        is_parallel = np.abs(rate) < 1.0e-9
        safe = np.where(is_parallel, 1.0, rate)
        to_low, to_high = (low - start) / safe, (high - start) / safe
        is_within = (start >= low) & (start <= high)
        first = np.where(is_parallel, np.where(is_within, -np.inf, np.inf), np.minimum(to_low, to_high)).max(axis=1)
        last = np.where(is_parallel, np.where(is_within, np.inf, -np.inf), np.maximum(to_low, to_high)).min(axis=1)
        entry = np.maximum(first, 0.0)
        return float(min(entry[entry <= last].min(initial=max_m), max_m))
