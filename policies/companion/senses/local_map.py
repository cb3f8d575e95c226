"""What stands round the vehicle at its height, from the last pictures or scans: a level grid that moves along.

In: depth pictures or sectors of ranges, with the pose each was taken at. Out: how far the way is free in a direction.
What has not been seen is not free.
"""

from math import hypot

import numpy as np
from numpy.typing import NDArray

from common.attitude import Vector, rotated, yaw_of
from policies.companion.senses.poses import Pose
from policies.tasks.follow_me.observe import HFOV_DEG, IMAGE_SIZE, camera_mount, depth_of
from policies.tasks.follow_me.tracked.vector import SECTORS

CELL_M = 0.25
CELLS = 96  # of a side: 12 m to each
DIRECTIONS = 36
ROOM_M = 1.0  # more room about a place is not told
REACH_M = 10.0  # farther nothing is asked for
_ABOVE_M, _BELOW_M = 0.7, 0.4  # of the slice that the vehicle flies through; guess: its own height twice
_NO_RETURN_M = 4.0  # so far a column without any return is taken to be free, if others have some; guess
_HOLD_US = 6_000_000  # for so long what was seen counts
_OWNER_M = 0.7  # round the owner, who is no part of the map
_ALIVE = 0.05  # fraction of pixels with depth below which there is none
_UNSEEN = -(10**15)
_OWN_M = 0.75  # so near nothing is seen: what is not known to be solid is taken to be free,
_HULL_M = 0.35  # and where the vehicle itself is, nothing else is
_HALF_WIDTH_M = 0.4  # of the vehicle's way
_RAYS = 5  # of a sector of ranges: a cell apart at the edge of what is asked for

Floats = NDArray[np.float64]


class LocalMap:
    """The grid of one vehicle, in ned."""

    def __init__(self) -> None:
        self._free_us = np.full((CELLS, CELLS), _UNSEEN, np.int64)
        self._solid_us = np.full((CELLS, CELLS), _UNSEEN, np.int64)
        self._corner = (0, 0)  # cell indices of the grid's first cell
        self.has_depth = False
        """The last picture had depth, the last scan a return."""
        self._rays_frd = _rays()
        near = np.arange(-_OWN_M, _OWN_M + CELL_M, CELL_M)
        self._own = np.array([(x, y) for x in near for y in near if hypot(x, y) <= _OWN_M])
        self._hull = np.array([(x, y) for x in near for y in near if hypot(x, y) <= _HULL_M])
        along = np.arange(CELL_M, REACH_M, CELL_M)
        aside = np.array([-_HALF_WIDTH_M, 0.0, _HALF_WIDTH_M])
        angles = np.arange(DIRECTIONS) * (2.0 * np.pi / DIRECTIONS)
        self.units = np.stack([np.cos(angles), np.sin(angles)], -1)
        """Directions asked about, north and east."""
        across = np.stack([-self.units[:, 1], self.units[:, 0]], -1)
        self._probes = along[None, :, None, None] * self.units[:, None, None] + aside[:, None] * across[:, None, None]

    def see(self, pixels: NDArray[np.uint8], pose: Pose, owner_ned: Vector | None, now_us: int) -> None:
        """Takes in a picture.

        Args:
            pixels: (height, width, 4), the last channel depth.
            pose: of the vehicle when it was taken.
            owner_ned: [m] who is left out.
            now_us: the vehicle's clock.
        """
        byte = pixels[..., 3].astype(np.float64)
        is_return = byte < 255.0
        self.has_depth = bool(is_return.mean() > _ALIVE)
        self._follow(pose.pos_ned)
        if not self.has_depth:
            return
        depth_m = depth_of(np.minimum(byte, 254.0))
        rotation = np.array([rotated(pose.q_ned_from_frd, axis) for axis in np.eye(3).tolist()]).T
        rays_ned = self._rays_frd @ rotation.T  # of depth 1
        points = rays_ned * depth_m[..., None]
        is_level = (points[..., 2] > -_ABOVE_M) & (points[..., 2] < _BELOW_M)
        is_solid = is_return & is_level
        if owner_ned is not None:
            off = points[..., :2] + np.array(pose.pos_ned[:2]) - np.array(owner_ned[:2])
            is_solid &= np.hypot(off[..., 0], off[..., 1]) > _OWNER_M
        here = np.array(pose.pos_ned[:2])
        level_m = np.hypot(points[..., 0], points[..., 1])
        self._carve(here, rays_ned, np.where(is_solid, level_m, np.inf).min(0), is_return & is_level, now_us)
        rows, columns = self._cells(points[..., :2][is_solid & (level_m < REACH_M)] + here)
        self._solid_us[rows, columns] = now_us

    def _carve(self, here: Floats, rays_ned: Floats, solid_m: Floats, is_seen: NDArray[np.bool_], now_us: int) -> None:
        """Notes as free what lies before the first solid thing of each column."""
        level = rays_ned[IMAGE_SIZE // 2, :, :2]
        units = level / np.hypot(level[:, 0], level[:, 1])[:, None]
        free_m = np.where(np.isfinite(solid_m), solid_m - CELL_M, _NO_RETURN_M)
        far = ~np.isfinite(solid_m) & is_seen.any(0)  # only the owner, or the ground that rises
        self._open(here, units, np.where(far, REACH_M, free_m), now_us)

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
        self._open(here, units, np.where(is_return, far_m - CELL_M, REACH_M), now_us)
        is_near = is_return & (far_m < REACH_M)
        rows, columns = self._cells(here + far_m[is_near, None] * units[is_near])
        self._solid_us[rows, columns] = now_us

    def _open(self, here: Floats, units: Floats, free_m: Floats, now_us: int) -> None:
        """Notes as free what lies within so much in each direction, and where the vehicle itself is."""
        steps = np.arange(0.0, REACH_M, 0.8 * CELL_M)
        points = here + units[:, None] * steps[None, :, None]
        for seen in (points[steps[None] < free_m[:, None]], here + self._hull):
            rows, columns = self._cells(seen)
            self._free_us[rows, columns] = now_us
        rows, columns = self._cells(here + self._own)
        is_solid = self._solid_us[rows, columns] > now_us - _HOLD_US
        self._free_us[rows[~is_solid], columns[~is_solid]] = now_us

    def clear_m(self, pos_ned: Vector, now_us: int) -> tuple[Floats, Floats]:
        """How far the way of the vehicle is free in each of `units`, and how far nothing solid is known in it [m].

        Shapes (DIRECTIONS,) each.
        """
        self._follow(pos_ned)
        points = self._probes + np.array(pos_ned[:2])
        rows, columns = self._cells(points.reshape(-1, 2))
        then = now_us - _HOLD_US
        free, solid = self._free_us[rows, columns], self._solid_us[rows, columns]
        is_solid = (solid > then) & (solid >= free)
        is_free = (free > then) & ~is_solid
        return self._length_m(is_free), self._length_m(~is_solid)

    def room(self, points: Floats, pos_ned: Vector, now_us: int) -> tuple[Floats, NDArray[np.bool_]]:
        """How far the nearest solid cell's middle is from each of some places [m], and where it was seen to be free.

        Farther than ROOM_M is told as that; shapes as of the points, without their last axis.
        """
        self._follow(pos_ned)
        then = now_us - _HOLD_US
        solid = (self._solid_us > then) & (self._solid_us >= self._free_us)
        near = np.full((CELLS, CELLS), ROOM_M)
        reach = int(ROOM_M / CELL_M)
        for i in range(-reach, reach + 1):
            for j in range(-reach, reach + 1):
                if hypot(i, j) * CELL_M < ROOM_M:
                    near = np.minimum(near, np.where(np.roll(solid, (i, j), (0, 1)), hypot(i, j) * CELL_M, ROOM_M))
        rows, columns = self._cells(points.reshape(-1, 2))
        shape = points.shape[:-1]
        is_seen = (self._free_us > then)[rows, columns]
        return near[rows, columns].reshape(shape), is_seen.reshape(shape)

    def nearest_m(self, pos_ned: Vector, yaw_rad: float, now_us: int) -> Floats:
        """How near anything known to be solid is in each of SECTORS sectors from the heading clockwise [m]."""
        self._follow(pos_ned)
        solid = (self._solid_us > now_us - _HOLD_US) & (self._solid_us >= self._free_us)
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

    def _length_m(self, is_open: NDArray[np.bool_]) -> Floats:
        """How far each direction is open at all its probes [m]."""
        whole = np.all(is_open.reshape(self._probes.shape[:-1]), axis=-1)
        first = np.where(np.all(whole, axis=1), whole.shape[1], np.argmin(whole, axis=1))
        return np.asarray(first * CELL_M)

    def _cells(self, points: Floats) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        cells = np.floor(points / CELL_M).astype(np.int64)
        return cells[:, 0] % CELLS, cells[:, 1] % CELLS

    def _follow(self, pos_ned: Vector) -> None:
        """Forgets what has come to lie outside."""
        corner = tuple(int(np.floor(x / CELL_M)) - CELLS // 2 for x in pos_ned[:2])
        for axis in (0, 1):
            moved = corner[axis] - self._corner[axis]
            if not moved:
                continue
            start = self._corner[axis] + (CELLS if moved > 0 else moved)
            lines = np.arange(start, start + abs(moved))[:CELLS] % CELLS
            for grid in (self._free_us, self._solid_us):
                np.moveaxis(grid, axis, 0)[lines] = _UNSEEN
        self._corner = (corner[0], corner[1])


def _rays() -> Floats:
    """Of each pixel, body frame, of depth 1 along the optical axis: (height, width, 3)."""
    half = np.tan(np.radians(0.5 * HFOV_DEG))
    steps = (np.arange(IMAGE_SIZE) + 0.5 - 0.5 * IMAGE_SIZE) * (2.0 * half / IMAGE_SIZE)
    right, down = np.meshgrid(steps, steps)
    rdf = np.stack([right, down, np.ones_like(right)], -1).reshape(-1, 3)
    turned = [rotated(camera_mount(), (float(x), float(y), float(z))) for x, y, z in rdf]
    return np.array(turned).reshape(IMAGE_SIZE, IMAGE_SIZE, 3)
