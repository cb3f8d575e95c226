"""A pair of hands: holds a parked vehicle in the air and turns it, so that its sensors can be calibrated.

In: the side that shall be down, once per frame. Out: the body's rate, which its gyro feels; it stays in its place.
"""

from collections.abc import Sequence
from math import atan2, cos, hypot, sin
from typing import Any

import numpy as np

from common.attitude import Quat, Vector, inverse, product, quat_of, rotated
from common.kernels import FRAME_US

TURN_RAD_S = 1.5  # as fast as hands turn a vehicle; guess
SPIN_RAD_S = 1.2
_FRAME_S = FRAME_US * 1e-6


class Turntable:
    """Holds one vehicle of a rig.

    Args:
        body: live structured view, shape (1,), of its BodyState row.
    """

    def __init__(self, body: np.ndarray[Any, Any]) -> None:
        self._body = body

    @property
    def is_level(self) -> bool:
        """Whether nothing is left to turn where it is shown level."""
        return hypot(*_body_turn(self._attitude(), _lean(0.0, 0.0))[:2]) < 1e-3

    def show(self, roll_rad: float, pitch_rad: float) -> None:
        """Turns the vehicle towards an attitude; it keeps the heading it has when level."""
        x, y, z = _body_turn(self._attitude(), _lean(roll_rad, pitch_rad))
        angle = hypot(x, y, z)
        rate = 0.0 if angle < 1e-4 else min(TURN_RAD_S, angle / _FRAME_S) / angle
        self._turn((x * rate, y * rate, z * rate))

    def spin(self) -> None:
        """Turns the vehicle about the vertical, whatever side is down."""
        self._turn(rotated(inverse(self._attitude()), (0.0, 0.0, SPIN_RAD_S)))

    def release(self) -> None:
        """Puts the vehicle back on its feet."""
        self._turn((0.0, 0.0, 0.0))
        self._body["is_held"][0] = 0

    def _attitude(self) -> list[float]:
        attitude: list[float] = self._body["q_ned_from_frd"][0].tolist()
        return attitude

    def _turn(self, omega_frd: Vector) -> None:
        self._body["is_held"][0] = 1
        self._body["omega_frd"][0] = omega_frd


def _lean(roll_rad: float, pitch_rad: float) -> Quat:
    """Attitude without a heading: pitch, then roll."""
    return product(quat_of(0.0, pitch_rad), (sin(0.5 * roll_rad), 0.0, 0.0, cos(0.5 * roll_rad)))


def _body_turn(q: Sequence[float], target: Sequence[float]) -> Vector:
    """Rotation vector [rad] in the body from q to target."""
    x, y, z, w = product(inverse(q), target)
    if w < 0.0:
        x, y, z, w = -x, -y, -z, -w
    sine = hypot(x, y, z)
    scale = 2.0 * atan2(sine, w) / sine if sine > 1e-9 else 0.0
    return (x * scale, y * scale, z * scale)
