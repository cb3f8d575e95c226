"""Scans as of somewhere else, for the tests of what shows them."""

import numpy as np
import warp as wp

from common.attitude import yaw_of
from common.range_sectors import SCANNER, RangeLayout
from policies.tasks.flight.moved_ranges import move_rows, sectors_struct


def moved(measured_m, was, now, layout: RangeLayout = SCANNER):
    """A scan's ranges with its sectors moved from one pose (north, east, heading) to another."""
    rows = wp.array(np.atleast_2d(measured_m).astype(np.float32), dtype=float)
    out = wp.clone(rows)  # beams stay
    poses = [wp.array([pose], dtype=wp.vec3) for pose in (was, now)]
    wp.launch(move_rows, 1, [rows, *poses, sectors_struct(layout), out])
    return out.numpy()[0]


def pose_of(row):
    """North, east and heading of a row of truth or of an estimate."""
    return float(row["pos_ned"][0]), float(row["pos_ned"][1]), yaw_of(tuple(float(x) for x in row["q_ned_from_frd"]))
