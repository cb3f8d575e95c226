"""Ranges that were measured a while ago, as they would be from where the vehicle is now.

One source for training and for flight. In: the ranges of sectors, where the vehicle was then by its estimate, and where
it is now. Out: the same sectors round where it is, from its nose. Each return is taken for what fills its sector and
stands still; what the scan did not reach is not known, and shown as no return.
"""

import math
from typing import Any

import warp as wp

from common.range_sectors import RangeLayout
from common.rotation import wrap_pi

wp.set_module_options({"enable_backward": False})

_HALF = wp.constant(0.499)  # of a sector: one that is reached to its middle is reached, but for rounding


@wp.struct
class Sectors:
    """Which way the sectors of a scan look."""

    count: int
    width_rad: float
    first_edge_rad: float  # left edge of the first, from the nose, clockwise
    range_m: float  # no return


def sectors_struct(layout: RangeLayout) -> Any:
    """The sectors of a layout, for kernels."""
    sectors = Sectors()
    sectors.count = layout.sectors
    sectors.width_rad = math.radians(layout.sector_deg)
    sectors.first_edge_rad = math.radians(layout.first_edge_deg)
    sectors.range_m = layout.range_m
    return sectors


@wp.func
def seen_from(angle_rad: float, far_m: float, moved_m: wp.vec2) -> wp.vec2:
    """Where a return lies ahead and right of where the vehicle has moved to, by the axes of before [m]."""
    return wp.vec2(far_m * wp.cos(angle_rad), far_m * wp.sin(angle_rad)) - moved_m


@wp.func
def bearing(place: wp.vec2) -> float:
    """Clockwise from the axis ahead [rad]."""
    return wp.atan2(place[1], place[0])


@wp.func
def move_ranges(
    measured_m: wp.array2d(dtype=float),
    i_scan: int,
    was: wp.vec3,
    now: wp.vec3,
    sectors: Sectors,
    out_m: wp.array2d(dtype=float),
    i: int,
) -> None:
    """The sectors of a scan into row i, as of now; each gets the nearest of what lies in it.

    Args:
        measured_m: scans [m], shape (scans, ranges), the sectors first.
        i_scan: which of them.
        was: north, east [m] and heading [rad] when it was measured.
        now: the same of now.
        sectors: which way they look.
        out_m: shape (rows, ranges); what comes after the sectors stays as it is.
        i: the row.
    """
    north = now[0] - was[0]
    east = now[1] - was[1]
    cosine = wp.cos(was[2])
    sine = wp.sin(was[2])
    moved_m = wp.vec2(north * cosine + east * sine, east * cosine - north * sine)
    turn = wrap_pi(now[2] - was[2])
    all_round = int(wp.round(2.0 * wp.pi / sectors.width_rad))
    for k in range(sectors.count):
        out_m[i, k] = sectors.range_m
    for k in range(sectors.count):
        far_m = measured_m[i_scan, k]
        if far_m < sectors.range_m:
            left = sectors.first_edge_rad + float(k) * sectors.width_rad
            middle = seen_from(left + 0.5 * sectors.width_rad, far_m, moved_m)
            ahead = bearing(middle)
            to_left = wp.min(wrap_pi(bearing(seen_from(left, far_m, moved_m)) - ahead), 0.0)
            to_right = wp.max(wrap_pi(bearing(seen_from(left + sectors.width_rad, far_m, moved_m)) - ahead), 0.0)
            column = (ahead - turn - sectors.first_edge_rad) / sectors.width_rad
            here = int(wp.floor(column))
            first = wp.min(int(wp.ceil(column + to_left / sectors.width_rad - _HALF)), here)
            last = wp.max(int(wp.floor(column + to_right / sectors.width_rad - 1.0 + _HALF)), here)
            for at in range(first, wp.min(last, first + all_round - 1) + 1):
                to = (at + 2 * all_round) % all_round
                if to < sectors.count:
                    out_m[i, to] = wp.min(out_m[i, to], wp.length(middle))


@wp.kernel(enable_backward=False)
def move_rows(
    measured_m: wp.array2d(dtype=float),
    was: wp.array(dtype=wp.vec3),
    now: wp.array(dtype=wp.vec3),
    sectors: Sectors,
    out_m: wp.array2d(dtype=float),
) -> None:
    """A scan of every row as of now, shape (rows, ranges)."""
    i = wp.tid()
    move_ranges(measured_m, i, was[i], now[i], sectors, out_m, i)
