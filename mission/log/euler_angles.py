"""Attitudes of many rows at the border to logs, plots and reports, where Euler angles are allowed."""

from typing import Any

import numpy as np
import numpy.typing as npt

Rows = npt.NDArray[Any]


def wxyz(quaternions: Rows) -> Rows:
    """Warp's (x, y, z, w) as ULog's (w, x, y, z); shape (rows, 4)."""
    reordered: Rows = quaternions[:, [3, 0, 1, 2]]
    return reordered


def euler_rad(quaternions: Rows) -> Rows:
    """Roll, pitch, yaw [rad], ZYX, of (x, y, z, w) rows; shape (rows, 3)."""
    x, y, z, w = quaternions.astype(float).T
    return np.stack(
        [
            np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
            np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0)),
            yaw_rad(quaternions.astype(float)),
        ],
        axis=1,
    )


def tilt_deg(quaternions: Rows) -> Rows:
    """Angle between body down and down, of (x, y, z, w) rows; shape (rows,)."""
    x, y = quaternions[:, :2].astype(float).T
    angles: Rows = np.degrees(np.arccos(np.clip(1.0 - 2.0 * (x * x + y * y), -1.0, 1.0)))
    return angles


def yaw_rad(quaternions: Rows) -> Rows:
    """Heading [rad] of (x, y, z, w) rows; shape (rows,)."""
    x, y, z, w = quaternions.T
    yaw: Rows = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return yaw
