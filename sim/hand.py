"""Somebody who holds a plane level over their head, throws it, and picks it up where it has landed.

In: whether the flight controller waits for the throw, once per frame. Out: the motion of the body while it is held,
which its accelerometer feels. A catapult is the same with more force.
"""

from enum import IntEnum
from math import cos, sin
from typing import Any

import numpy as np

from common.airframes.plane import Throw
from common.attitude import Vector, rotated
from common.kernels import FRAME_US
from sim.turntable import Turntable

_FRAME_S = FRAME_US * 1e-6
_WAITS_FRAMES = round(1.0 / _FRAME_S)  # from when it is ready to be thrown
_LIES_FRAMES = round(5.0 / _FRAME_S)  # before it is picked up; guess: to walk there takes longer
_LIFT_FRAMES = round(2.0 / _FRAME_S)
_STILL_M_S = 0.1


class _Phase(IntEnum):
    HOLDS = 0
    THROWS = 1
    FREE = 2
    LIFTS = 3


class Hand:
    """The hand of one plane.

    Args:
        body: live structured view, shape (1,), of its PlaneState row.
        throw: how it is thrown.
    """

    def __init__(self, body: np.ndarray[Any, Any], throw: Throw) -> None:
        self._body = body
        self._throw = throw
        self._table = Turntable(body)
        self._phase = _Phase.FREE
        self._frames = 0  # in the phase, or that what ends it lasts

    @property
    def is_holding(self) -> bool:
        return self._phase is not _Phase.FREE

    @property
    def is_ready(self) -> bool:
        """Whether it is held still, to be thrown."""
        return self._phase is _Phase.HOLDS

    def take(self) -> None:
        """Takes the plane from the ground to where it is thrown from, at once: before the flight."""
        self._body["pos_ned"][0, 2] -= self._throw.height_m
        self._hold()

    def throw(self) -> bool:
        """Throws the plane, if it is held; whether it is."""
        if self._phase is not _Phase.HOLDS:
            return False
        self._phase, self._frames = _Phase.THROWS, 0
        return True

    def frame(self, *, is_awaited: bool, is_armed: bool) -> None:
        """What is done before the ticks of a frame.

        Args:
            is_awaited: the plane is to be thrown.
            is_armed: its motor may start: nobody reaches for it.
        """
        self._frames += 1
        if self._phase is _Phase.HOLDS:
            self._body["is_held"][0] = 1  # whoever else has turned it gives it back
            if not is_awaited:
                self._frames = 0
            elif self._frames > _WAITS_FRAMES:
                self.throw()
        if self._phase is _Phase.THROWS:
            self._swing()
        elif self._phase is _Phase.FREE:
            if is_armed or not self._lies():
                self._frames = 0
            elif self._frames > _LIES_FRAMES:
                self._phase, self._frames = _Phase.LIFTS, 0
        elif self._phase is _Phase.LIFTS:
            self._lift()

    def _hold(self) -> None:
        self._phase, self._frames = _Phase.HOLDS, 0
        self._move((0.0, 0.0, 0.0))
        self._body["omega_frd"][0] = 0.0

    def _move(self, accel_ned: Vector) -> None:
        self._body["is_held"][0] = 1
        self._body["hand_accel_ned"][0] = accel_ned

    def _swing(self) -> None:
        """Accelerates it along its nose and upwards, and lets go."""
        throw = self._throw
        if self._frames < throw.stroke_s / _FRAME_S:
            north, east, _ = rotated(self._body["q_ned_from_frd"][0].tolist(), (1.0, 0.0, 0.0))
            ahead, up = throw.acceleration_m_s2 * cos(throw.elevation_rad), sin(throw.elevation_rad)
            self._move((ahead * north, ahead * east, -throw.acceleration_m_s2 * up))
        else:
            self._phase, self._frames = _Phase.FREE, 0
            self._body["hand_accel_ned"][0] = 0.0
            self._body["is_held"][0] = 0

    def _lies(self) -> bool:
        body = self._body[0]
        is_still = float(np.linalg.norm(body["vel_ned"])) < _STILL_M_S
        return bool(is_still and body["is_on_ground"] and not body["is_crashed"])

    def _lift(self) -> None:
        """Up to the height of the throw, and level."""
        if self._frames <= _LIFT_FRAMES:
            rate = 4.0 * self._throw.height_m / (_LIFT_FRAMES * _FRAME_S) ** 2
            self._move((0.0, 0.0, -rate if self._frames <= _LIFT_FRAMES // 2 else rate))
        else:
            self._move((0.0, 0.0, 0.0))
        self._table.show(0.0, 0.0)
        if self._frames > _LIFT_FRAMES and self._table.is_level:
            self._hold()
