"""Walls: an optional ring of four solid walls just outside the map's edges, with a level top.

Each wall is a box WALL_THICKNESS_M thick whose inner face is the edge of the map; it has no lower end. Contact and ray
queries are exact for these boxes. Contact is asked at up to 1 kHz per vehicle.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp

from sim.world.terrain import FloatArray

wp.set_module_options({"enable_backward": False})

WALL_COUNT = 4
WALL_THICKNESS_M = wp.constant(0.5)  # a vehicle moves at most centimetres per 1 ms step: it cannot pass through
_FAR = wp.constant(1.0e30)
_PARALLEL = wp.constant(1.0e-9)  # direction component below which a ray never crosses a face


@wp.struct
class Walls:
    """The ring of walls of one world."""

    is_built: int
    half_size_m: float  # inner faces are at ±half_size_m
    top_m: float  # above the home plane


@wp.func
def outward_ned(i_wall: int) -> wp.vec3:
    """Outward unit normal of the north, south, east and west wall."""
    sign = 1.0 - 2.0 * float(i_wall % 2)
    if i_wall < 2:
        return wp.vec3(sign, 0.0, 0.0)
    return wp.vec3(0.0, sign, 0.0)


@wp.func
def along_ned(i_wall: int) -> wp.vec3:
    """Unit vector along a wall."""
    if i_wall < 2:
        return wp.vec3(0.0, 1.0, 0.0)
    return wp.vec3(1.0, 0.0, 0.0)


@wp.func
def walls_contact(walls: Walls, pos_ned: wp.vec3, radius: float) -> wp.vec4:
    """Deepest contact of a sphere with the walls: unit push-out normal (ned), penetration [m]; 0 for none."""
    deepest = wp.vec4(0.0, 0.0, 0.0, 0.0)
    out_most = wp.max(wp.abs(pos_ned[0]), wp.abs(pos_ned[1]))
    if walls.is_built == 0 or out_most + radius < walls.half_size_m:
        return deepest
    for i_wall in range(WALL_COUNT):
        contact = wall_contact(walls, i_wall, pos_ned, radius)
        if contact[3] > deepest[3]:
            deepest = contact
    return deepest


@wp.func
def wall_contact(walls: Walls, i_wall: int, pos_ned: wp.vec3, radius: float) -> wp.vec4:
    """Contact of a sphere with one wall, as `walls_contact`; the penetration is negative when they are apart."""
    outward = outward_ned(i_wall)
    along = along_ned(i_wall)
    inner = walls.half_size_m
    outer = walls.half_size_m + WALL_THICKNESS_M
    out = wp.dot(outward, pos_ned)
    side = wp.dot(along, pos_ned)
    height = -pos_ned[2]
    off_out = out - wp.clamp(out, inner, outer)
    off_side = side - wp.clamp(side, -outer, outer)
    off_up = wp.max(height - walls.top_m, 0.0)
    off = wp.sqrt(off_out * off_out + off_side * off_side + off_up * off_up)
    if off > 0.0:
        normal = (off_out * outward + off_side * along + wp.vec3(0.0, 0.0, -off_up)) / off
        return wp.vec4(normal[0], normal[1], normal[2], radius - off)
    # centre inside the wall: out through the nearest of inner face, outer face, end and top
    across = wp.min(out - inner, outer - out)
    end = outer - wp.abs(side)
    nearest = wp.min(wp.min(across, end), walls.top_m - height)
    normal = wp.vec3(0.0, 0.0, -1.0)
    if nearest == out - inner:
        normal = -outward
    elif nearest == outer - out:
        normal = outward
    elif nearest == end:
        normal = wp.sign(side) * along
    return wp.vec4(normal[0], normal[1], normal[2], radius + nearest)


@wp.func
def walls_ray_hit(walls: Walls, origin_ned: wp.vec3, dir_ned: wp.vec3, max_m: float) -> float:
    """Distance [m] along a ray of unit direction to the first wall, `max_m` if none; 0 from inside one."""
    nearest = float(max_m)
    if walls.is_built == 0:
        return nearest
    reach = wp.max(wp.abs(origin_ned[0] + max_m * dir_ned[0]), wp.abs(origin_ned[1] + max_m * dir_ned[1]))
    out_most = wp.max(wp.abs(origin_ned[0]), wp.abs(origin_ned[1]))
    if wp.max(reach, out_most) < walls.half_size_m:
        return nearest
    outer = walls.half_size_m + WALL_THICKNESS_M
    for i_wall in range(WALL_COUNT):
        outward = outward_ned(i_wall)
        along = along_ned(i_wall)
        # the ray is inside the box where it is inside all three slabs (Kay and Kajiya 1986)
        across = slab(wp.dot(outward, origin_ned), wp.dot(outward, dir_ned), walls.half_size_m, outer)
        lengthwise = slab(wp.dot(along, origin_ned), wp.dot(along, dir_ned), -outer, outer)
        upright = slab(-origin_ned[2], -dir_ned[2], -_FAR, walls.top_m)
        entry = wp.max(0.0, wp.max(across[0], wp.max(lengthwise[0], upright[0])))
        leave = wp.min(across[1], wp.min(lengthwise[1], upright[1]))
        if entry <= leave:
            nearest = wp.min(nearest, entry)
    return nearest


@wp.func
def slab(start: float, rate: float, low: float, high: float) -> wp.vec2:
    """Ray parameters [m] between which a coordinate of the ray is within [low, high]; entry after exit if never."""
    if wp.abs(rate) < _PARALLEL:
        if start >= low and start <= high:
            return wp.vec2(-_FAR, _FAR)
        return wp.vec2(_FAR, -_FAR)
    to_low = (low - start) / rate
    to_high = (high - start) / rate
    return wp.vec2(wp.min(to_low, to_high), wp.max(to_low, to_high))


@dataclass(frozen=True, eq=False, slots=True)
class WallsMap:
    """The walls on the host, queried in float64."""

    is_built: bool
    half_size_m: float
    top_m: float  # above the home plane

    def kernel(self) -> Walls:
        """The walls as kernels read them."""
        walls = Walls()
        walls.is_built = int(self.is_built)
        walls.half_size_m = self.half_size_m
        walls.top_m = self.top_m
        return walls

    def _boxes_ned(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper corners of the walls in (north, east, height), shapes (4, 3)."""
        inner, outer = self.half_size_m, self.half_size_m + float(WALL_THICKNESS_M)
        north = [(inner, -outer), (outer, outer)]
        south = [(-outer, -outer), (-inner, outer)]
        corners = np.array([north, south, [a[::-1] for a in north], [a[::-1] for a in south]])
        low = np.column_stack([corners[:, 0], np.full(WALL_COUNT, -np.inf)])
        high = np.column_stack([corners[:, 1], np.full(WALL_COUNT, self.top_m)])
        return low, high

    def distance(self, pos_ned: FloatArray) -> FloatArray:
        """Distance [m] from each point, shape (points, 3), to the nearest wall; negative inside, inf without walls."""
        if not self.is_built:
            return np.full(len(pos_ned), np.inf)
        low, high = self._boxes_ned()
        position = (pos_ned * np.array([1.0, 1.0, -1.0]))[:, None, :]
        outside = np.maximum(np.maximum(low - position, position - high), 0.0)
        inside = np.maximum(np.minimum(position - low, high - position).min(axis=-1), 0.0)
        off = np.sqrt((outside**2).sum(axis=-1))
        return np.asarray(np.where(off > 0.0, off, -inside).min(axis=1))

    def ray_hit(self, origin_ned: FloatArray, dir_ned: FloatArray, max_m: float) -> float:
        """Distance [m] along a ray of unit direction to the first wall, `max_m` if none; 0 from inside one."""
        if not self.is_built:
            return max_m
        low, high = self._boxes_ned()
        mirror = np.array([1.0, 1.0, -1.0])
        start, rate = origin_ned * mirror, dir_ned * mirror
        is_parallel = np.abs(rate) < _PARALLEL
        safe_rate = np.where(is_parallel, 1.0, rate)
        to_low, to_high = (low - start) / safe_rate, (high - start) / safe_rate
        is_within = (start >= low) & (start <= high)
        first = np.where(is_parallel, np.where(is_within, -np.inf, np.inf), np.minimum(to_low, to_high)).max(axis=1)
        last = np.where(is_parallel, np.where(is_within, np.inf, -np.inf), np.maximum(to_low, to_high)).min(axis=1)
        entry = np.maximum(first, 0.0)
        return float(min(entry[entry <= last].min(initial=max_m), max_m))
