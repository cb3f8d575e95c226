"""What stands round the vehicle at its height, from the last pictures or scans: a level grid that moves along.

In: depth pictures or sectors of ranges, with the pose each was taken at. Out: how far the way is free in a direction.
What has not been seen is not free.
"""

from dataclasses import dataclass, replace
from math import hypot, inf

import cv2
import numpy as np
from numpy.typing import NDArray

from common.attitude import Vector, rotated, yaw_of
from policies.companion.senses.poses import Pose, matrix_of
from policies.mono_depth.network import SeenDepth
from policies.tasks.follow_me.observe import HFOV_DEG, IMAGE_SIZE, camera_mount, depth_of
from policies.tasks.follow_me.tracked.vector import SECTORS

CELL_M = 0.25
CELLS = 96  # of a side: 12 m to each
ROOM_M = 1.0  # more room about a place is not told
REACH_M = 10.0  # farther nothing is asked for
_ABOVE_M, _BELOW_M = 0.7, 0.4  # of the slice that the vehicle flies through; guess: its own height twice
_LEVEL_M = 0.5  # from higher or lower than this another slice was seen: who climbs has yet to look for crowns
_NO_RETURN_M = 4.0  # so far a column without any return is taken to be free, if others have some; guess
_HOLD_US = 6_000_000  # for so long what was seen to be free counts, and what was overhead,
_SOLID_US = 15_000_000  # and so long what was solid: trees stay, while who drifts towards one does not look there
_OWNER_M = 0.6  # round the owner, who is no part of the map; they pass trees at 0.6 m from their middle
_LEAD_S = 1.0  # nobody runs into what they reach in so long; guess
_TOP_M = 0.3  # what is farther up than this is over the vehicle
_NONE = 255  # of the depth channel: no return
_DEPTH_M = depth_of(np.minimum(np.arange(_NONE + 1.0), _NONE - 1.0))  # of each level of it
_ALIVE = 0.05  # fraction of pixels with depth below which there is none
_UNSEEN = -(10**15)
_OWN_M = 0.75  # so near nothing is seen: what is not known to be solid is taken to be free,
_THICK_M = 0.25  # what is seen from one side is at least so thick: trunks are
_HULL_M = 0.35  # and where the vehicle itself is, nothing else is
_FAN = 240  # directions all round in which a picture shows what is free: about a column each
_FAN_RAD = 2.0 * np.pi / _FAN
_FAN_UNITS = np.stack([np.cos((np.arange(_FAN) + 0.5) * _FAN_RAD), np.sin((np.arange(_FAN) + 0.5) * _FAN_RAD)], -1)
_BESIDE = np.ones((3, 3), np.uint8)  # a cell and those next to it
_RAYS = 5  # of a sector of ranges: a cell apart at the edge of what is asked for

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Clearance:
    """What was known at a time, over the cells of the grid, the southernmost and westernmost first."""

    near_m: NDArray[np.float32]
    """From each cell's middle to that of the nearest solid one; farther than ROOM_M is told as that."""
    is_seen: NDArray[np.bool_]
    """Was seen to be free not long ago."""
    corner: tuple[int, int]
    """Of the first cell, in cells from the origin."""

    def with_room_seen(self, here: Floats) -> "Clearance":
        """The same for who is wider than a cell: seen is what is so with the cells next to it, or near where it is.

        Args:
            here: where it is [m], north and east; where it is already, nothing is to be asked.
        """
        is_wide = cv2.erode(self.is_seen.astype(np.uint8), _BESIDE, borderValue=0) > 0
        north, east = (np.arange(CELLS) + 0.5 - line for line in here / CELL_M - self.corner)
        is_near = np.hypot(north[:, None], east) * CELL_M <= _OWN_M
        return replace(self, is_seen=self.is_seen & (is_wide | is_near))

    def at(self, points: Floats) -> tuple[Floats, NDArray[np.bool_]]:
        """How near the nearest solid cell is [m], between cells too, and whether the cell of a place is seen.

        Args:
            points: [m] (..., 2), north and east; outside nothing is seen, and how near is the nearest cell's.

        Returns:
            Both, shapes as of the points, without their last axis.
        """
        shape = points.shape[:-1]
        lines = points.reshape(*((1, 1, *shape)[-2:]), 2)  # OpenCV takes no longer line than 32,767
        at = lines / CELL_M - self.corner
        is_inside = ((at >= 0.0) & (at < CELLS)).all(-1)
        at = np.clip(at, 0.0, CELLS - 1)
        rows, columns = np.moveaxis(at.astype(np.int64), -1, 0)
        north, east = np.ascontiguousarray(np.moveaxis(at - 0.5, -1, 0), np.float32)
        near_m = cv2.remap(self.near_m, east, north, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return near_m.astype(np.float64).reshape(shape), (is_inside & self.is_seen[rows, columns]).reshape(shape)


class LocalMap:
    """The grid of one vehicle, in ned."""

    def __init__(self) -> None:
        self._free_us = np.full((CELLS, CELLS), _UNSEEN, np.int64)
        self._free_down = np.zeros((CELLS, CELLS))  # [m] of the vehicle that saw so
        self._down = 0.0  # [m] of the vehicle by what it was told last
        self._solid_us = np.full((CELLS, CELLS), _UNSEEN, np.int64)
        self._over = np.full((CELLS, CELLS), -np.inf)  # [m] down, of the lowest that was seen over it
        self._over_us = np.full((CELLS, CELLS), _UNSEEN, np.int64)
        self._corner = (0, 0)  # cell indices of the grid's first cell
        self.has_depth = False
        """The last picture had depth, the last scan a return."""
        self._rays_frd = _rays()
        near = np.arange(-_OWN_M, _OWN_M + CELL_M, CELL_M)
        self._own = np.array([(x, y) for x in near for y in near if hypot(x, y) <= _OWN_M])
        self._hull = np.array([(x, y) for x in near for y in near if hypot(x, y) <= _HULL_M])
        self._person = np.array([(x, y) for x in near for y in near if hypot(x, y) <= _OWNER_M])

    def see(self, depth: NDArray[np.uint8], pose: Pose, owner: tuple[Floats, Floats] | None, now_us: int) -> None:
        """Takes in what a depth camera saw.

        Args:
            depth: (height, width), the depth channel of a picture; 255: no return.
            pose: of the vehicle when it was taken.
            owner: place [m] and level velocity [m/s] then of who is left out, ned.
            now_us: the vehicle's clock.
        """
        self._follow(pose.pos_ned)
        self.has_depth = has_depth(depth)
        if self.has_depth:
            self._take(depth, np.zeros(depth.shape, bool), pose, owner, now_us)

    def guess(self, seen: SeenDepth, pose: Pose, owner: tuple[Floats, Floats] | None, now_us: int) -> None:
        """Takes in what a picture's colours say, where there is no depth; people are no part of the map."""
        self._follow(pose.pos_ned)
        self.has_depth = False
        self._take(seen.depth, seen.is_person, pose, owner, now_us)

    def _take(
        self,
        depth: NDArray[np.uint8],
        is_person: NDArray[np.bool_],
        pose: Pose,
        owner: tuple[Floats, Floats] | None,
        now_us: int,
    ) -> None:
        is_return = depth < _NONE
        depth_m = _DEPTH_M[depth]
        rotation = matrix_of(pose.q_ned_from_frd)
        rays_ned = self._rays_frd @ rotation.T  # of depth 1
        points = rays_ned * depth_m[..., None]
        here = np.array(pose.pos_ned[:2])
        level_m = np.hypot(points[..., 0], points[..., 1])
        is_there = is_return & (points[..., 2] > -_ABOVE_M) & (points[..., 2] < _BELOW_M)
        self._carve(here, rays_ned, np.where(is_there, level_m, np.inf), now_us)
        is_over = is_return & ~is_person & (points[..., 2] < -_TOP_M) & (level_m < REACH_M)
        self._look_up(points[is_over] + pose.pos_ned, now_us)
        is_solid = is_there & ~is_person & (level_m < REACH_M)
        if owner is not None:
            off = points[..., :2] + here - owner[0][:2]
            is_solid &= np.hypot(off[..., 0], off[..., 1]) > _OWNER_M
            self._open_ahead(*owner, now_us)
        level, far_m = points[..., :2][is_solid], level_m[is_solid][:, None]
        behind = level * (1.0 + _THICK_M / np.maximum(far_m, _THICK_M))
        rows, columns = cells_of(np.concatenate([level, behind]) + here)
        self._solid_us[rows, columns] = now_us

    def _look_up(self, points: Floats, now_us: int) -> None:
        """Notes what lies overhead, ned."""
        rows, columns = cells_of(points[:, :2])
        old = self._over_us[rows, columns] <= now_us - _HOLD_US
        self._over[rows[old], columns[old]] = -np.inf
        np.maximum.at(self._over, (rows, columns), points[:, 2])
        self._over_us[rows, columns] = now_us

    def room_up_m(self, pos_ned: Vector, now_us: int, hold_us: int = _HOLD_US) -> float:
        """How far up it is [m] to the lowest of what was seen over where the vehicle is; inf: to nothing.

        Args:
            pos_ned: where it is.
            now_us: the vehicle's clock.
            hold_us: so long ago what was seen counts.
        """
        rows, columns = cells_of(np.array(pos_ned[:2]) + self._own)
        over = np.where(self._over_us[rows, columns] > now_us - hold_us, self._over[rows, columns], -np.inf)
        over = over[over < pos_ned[2]]
        return pos_ned[2] - float(over.max()) if len(over) else inf

    def _carve(self, here: Floats, rays_ned: Floats, first_m: Floats, now_us: int) -> None:
        """Notes as free what lies before the first thing in each direction, a body too: what it hides is unknown.

        However the vehicle leans, a direction counts if some ray of it stays in the slice for as far as that.
        """
        rays = rays_ned.reshape(-1, 3)
        slope = rays[:, 2] / np.maximum(np.hypot(rays[:, 0], rays[:, 1]), 1e-6)
        sectors = np.floor(np.arctan2(rays[:, 1], rays[:, 0]) / _FAN_RAD).astype(np.int64) % _FAN
        nearest_m = np.full(_FAN, np.inf)
        np.minimum.at(nearest_m, sectors, first_m.reshape(-1))
        is_level = (slope > -_ABOVE_M / _NO_RETURN_M) & (slope < _BELOW_M / _NO_RETURN_M)
        is_seen = np.bincount(sectors[is_level], minlength=_FAN) > 0
        units = _FAN_UNITS[is_seen]
        free_m = np.where(np.isfinite(nearest_m), nearest_m - CELL_M, _NO_RETURN_M)[is_seen]
        self._open(here[None], units, free_m, now_us)

    def _open_ahead(self, place: Floats, velocity: Floats, now_us: int) -> None:
        """Notes as free, but for what is known to be solid, where somebody walks: they look where they go.

        As wide as they keep off trees: from the vehicle they hide more than themselves.
        """
        along = np.arange(0.0, _LEAD_S + 0.04, 0.04)[:, None, None] * velocity[:2]
        rows, columns = cells_of((place[:2] + along + self._person).reshape(-1, 2))
        is_open = self._solid_us[rows, columns] <= now_us - _SOLID_US
        self._note_free(rows[is_open], columns[is_open], now_us)

    def sweep(
        self, bearings_rad: Floats, width_rad: float, ranges_m: Floats, limit_m: float, pose: Pose, now_us: int
    ) -> None:
        """Takes in a scan of sectors, each the nearest return in it.

        Args:
            bearings_rad: of the sectors' middles, from the nose, clockwise; those that told nothing are left out.
            width_rad: of a sector.
            ranges_m: of the same sectors.
            limit_m: from here on there was no return.
            pose: of the vehicle then.
            now_us: the vehicle's clock.
        """
        self._follow(pose.pos_ned)
        here = np.array(pose.pos_ned[:2])
        fan = ((np.arange(_RAYS) + 0.5) / _RAYS - 0.5) * width_rad
        angles = (yaw_of(pose.q_ned_from_frd) + bearings_rad[:, None] + fan).ravel()
        units = np.stack([np.cos(angles), np.sin(angles)], -1)
        far_m = np.repeat(ranges_m.astype(np.float64), _RAYS)
        is_return = far_m < limit_m
        self.has_depth = bool(is_return.any())
        self._open(here[None], units, np.where(is_return, far_m - CELL_M, REACH_M), now_us)
        is_near = is_return & (far_m < REACH_M)
        rows, columns = cells_of(here + far_m[is_near, None] * units[is_near])
        self._solid_us[rows, columns] = now_us

    def _open(self, heres: Floats, units: Floats, free_m: Floats, now_us: int) -> None:
        """Notes as free what lies within so much in each direction, from some places, and these themselves."""
        steps = np.arange(0.0, REACH_M, 0.8 * CELL_M)
        ways = (units[:, None] * steps[None, :, None])[steps[None] < free_m[:, None]]
        for seen in (ways, self._hull):
            rows, columns = cells_of((heres[:, None] + seen).reshape(-1, 2))
            self._note_free(rows, columns, now_us)
        rows, columns = cells_of((heres[:, None] + self._own).reshape(-1, 2))
        is_solid = self._solid_us[rows, columns] > now_us - _SOLID_US
        self._note_free(rows[~is_solid], columns[~is_solid], now_us)

    def _note_free(self, rows: NDArray[np.int64], columns: NDArray[np.int64], now_us: int) -> None:
        self._free_us[rows, columns] = now_us
        self._free_down[rows, columns] = self._down

    def sight(self, pose: Pose, there_ned: Floats, now_us: int) -> None:
        """Notes as free what lies between the vehicle at a pose and what it saw at a place, wide enough for a hull."""
        self._follow(pose.pos_ned)
        here = np.array(pose.pos_ned[:2])
        way = np.array(there_ned[:2]) - here
        far_m = float(np.hypot(*way))
        unit = way / max(far_m, 1e-3)
        aside = np.array([-unit[1], unit[0]]) * CELL_M
        beside = np.arange(-2.0, 2.5, 0.5)  # so fine that none is passed over, whatever way it leads
        self._open(here + beside[:, None] * aside, unit[None], np.array([far_m]), now_us)

    def clearance(self, pos_ned: Vector, now_us: int) -> Clearance:
        """What is known of places round a vehicle by now."""
        self._follow(pos_ned)
        then = now_us - _HOLD_US
        is_open = (self._solid_us <= now_us - _SOLID_US) | (self._solid_us < self._free_us)
        first = [-(line % CELLS) for line in self._corner]  # to where its sides do not meet
        unrolled = np.roll(is_open, first, (0, 1)).astype(np.uint8)
        near_m = CELL_M * cv2.distanceTransform(unrolled, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        is_level = np.abs(self._free_down - self._down) < _LEVEL_M
        is_seen = np.roll((self._free_us > then) & is_level, first, (0, 1))
        return Clearance(np.minimum(near_m, ROOM_M), is_seen, self._corner)

    def nearest_m(self, pos_ned: Vector, yaw_rad: float, now_us: int) -> Floats:
        """How near anything known to be solid is in each of SECTORS sectors from the heading clockwise [m]."""
        self._follow(pos_ned)
        solid = (self._solid_us > now_us - _SOLID_US) & (self._solid_us >= self._free_us)
        rows, columns = np.nonzero(solid)
        out = np.full(SECTORS, np.inf)
        if not len(rows):
            return out
        at = np.stack([rows, columns], -1)
        corner = np.array(self._corner)
        at = corner + (at - corner) % CELLS  # whole cells, of the world
        off = (at + 0.5) * CELL_M - np.array(pos_ned[:2])
        far_m = np.hypot(off[:, 0], off[:, 1])
        sector_rad = 2.0 * np.pi / SECTORS
        sectors = np.round((np.arctan2(off[:, 1], off[:, 0]) - yaw_rad) / sector_rad).astype(np.int64) % SECTORS
        np.minimum.at(out, sectors, np.maximum(far_m - 0.5 * CELL_M, 0.0))
        return out

    def _follow(self, pos_ned: Vector) -> None:
        """Forgets what has come to lie outside, of who is there."""
        self._down = float(pos_ned[2])
        corner = tuple(int(np.floor(x / CELL_M)) - CELLS // 2 for x in pos_ned[:2])
        for axis in (0, 1):
            moved = corner[axis] - self._corner[axis]
            if not moved:
                continue
            start = self._corner[axis] + (CELLS if moved > 0 else moved)
            lines = np.arange(start, start + abs(moved))[:CELLS] % CELLS
            for grid in (self._free_us, self._solid_us, self._over_us):
                np.moveaxis(grid, axis, 0)[lines] = _UNSEEN
        self._corner = (corner[0], corner[1])


def cells_of(points: Floats) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows and columns of places, (n, 2), in a grid that moves along."""
    cells = np.floor(points / CELL_M).astype(np.int64)
    return cells[:, 0] % CELLS, cells[:, 1] % CELLS


def has_depth(depth: NDArray[np.uint8]) -> bool:
    """Whether a depth channel has returns enough: the camera works."""
    return bool((depth < _NONE).mean() > _ALIVE)


def _rays() -> Floats:
    """Of each pixel, body frame, of depth 1 along the optical axis: (height, width, 3)."""
    half = np.tan(np.radians(0.5 * HFOV_DEG))
    steps = (np.arange(IMAGE_SIZE) + 0.5 - 0.5 * IMAGE_SIZE) * (2.0 * half / IMAGE_SIZE)
    right, down = np.meshgrid(steps, steps)
    rdf = np.stack([right, down, np.ones_like(right)], -1).reshape(-1, 3)
    turned = [rotated(camera_mount(), (float(x), float(y), float(z))) for x, y, z in rdf]
    return np.array(turned).reshape(IMAGE_SIZE, IMAGE_SIZE, 3)
