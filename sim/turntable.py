"""A pair of hands: holds a parked vehicle in the air and turns it, so that its sensors can be calibrated.

In: the side that shall be down, once per frame. Out: the body's rate, which its gyro feels; it stays in its place.
"""

from typing import Any

import numpy as np

from common.kernels import FRAME_US

TURN_RAD_S = 1.5  # as fast as hands turn a vehicle; guess
SPIN_RAD_S = 1.2
_ARRIVED_RAD = 0.02
_FRAME_S = FRAME_US * 1e-6


class Turntable:
    """Holds one vehicle of a rig.

    Args:
        body: live structured view, shape (1,), of its BodyState row.
    """

    def __init__(self, body: np.ndarray[Any, Any]) -> None:
        self._body = body

    def show(self, roll_rad: float, pitch_rad: float) -> None:
        """Turns the vehicle towards an attitude; it keeps the heading it has when level."""
        to_go = _body_turn(self._attitude(), _attitude(roll_rad, pitch_rad, 0.0))
        angle = float(np.linalg.norm(to_go))
        rate = 0.0 if angle < 1e-4 else min(TURN_RAD_S, angle / _FRAME_S) / angle
        self._turn(to_go * rate)

    def spin(self) -> None:
        """Turns the vehicle about the vertical, whatever side is down."""
        self._turn(_rotated_inverse(self._attitude(), np.array([0.0, 0.0, SPIN_RAD_S])))

    def release(self) -> None:
        """Puts the vehicle back on its feet."""
        self._turn(np.zeros(3))
        self._body["is_held"][0] = 0

    def _attitude(self) -> np.ndarray[Any, Any]:
        attitude: np.ndarray[Any, Any] = self._body["q_ned_from_frd"][0].astype(float)
        return attitude

    def _turn(self, omega_frd: np.ndarray[Any, Any]) -> None:
        self._body["is_held"][0] = 1
        self._body["omega_frd"][0] = omega_frd


def _attitude(roll_rad: float, pitch_rad: float, yaw_rad: float) -> np.ndarray[Any, Any]:
    """Quaternion (x, y, z, w) of ZYX angles."""
    cr, cp, cy = np.cos(0.5 * roll_rad), np.cos(0.5 * pitch_rad), np.cos(0.5 * yaw_rad)
    sr, sp, sy = np.sin(0.5 * roll_rad), np.sin(0.5 * pitch_rad), np.sin(0.5 * yaw_rad)
    return np.array(
        [
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ]
    )


def _body_turn(q: np.ndarray[Any, Any], target: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Rotation vector [rad] in the body from q to target."""
    x, y, z, w = _product(np.array([-q[0], -q[1], -q[2], q[3]]), target)
    sign = -1.0 if w < 0.0 else 1.0
    axis = sign * np.array([x, y, z])
    sine = float(np.linalg.norm(axis))
    if sine < 1e-9:
        return np.zeros(3)
    turn: np.ndarray[Any, Any] = axis * (2.0 * np.arctan2(sine, sign * w) / sine)
    return turn


def _product(a: np.ndarray[Any, Any], b: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return np.array(
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ]
    )


def _rotated_inverse(q: np.ndarray[Any, Any], vector: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """A vector of ned in the body."""
    conjugate = np.array([-q[0], -q[1], -q[2], q[3]])
    turned = _product(_product(conjugate, np.array([*vector, 0.0])), q)
    return turned[:3]
