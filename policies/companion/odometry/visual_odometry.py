"""How fast the vehicle goes by its pictures: the way of the lens between each and the next, over the time between.

In: pictures with the attitude that the vehicle told of their moment, where people are, and how fast the vehicle takes
itself to be. Out: a velocity in ned with its covariance, as of the middle between two pictures. The turn is the
vehicle's own (gyros know a tenth of a second better than 64 pixels do), the way is the pictures' alone: where the
search for it begins is no measurement. Without depth there is none.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from common.attitude import Vector, rotated
from policies.companion.odometry.alignment import align
from policies.companion.odometry.view import View, view_of
from policies.companion.senses.poses import Pose, matrix_of
from policies.tasks.follow_me.observe import LENS_FRD, camera_mount

Floats = NDArray[np.float64]
NEXT_S = (0.03, 0.35)  # from one picture to the next; farther apart they show too little of the same
_LEAST_FITTING = 0.4  # of the points; guess: fewer fit where the way is wrong
_PERSON_M = 0.7  # round the middle of somebody nothing is taken for the ground
_NEIGHBOURS = 1.5  # errors are so many times those of independent points: measured, 1 m/s to 5 m/s in woods
_STD_M_S = 0.05  # and no less than this,
_STD_FRACTION = 0.03  # and than this of the speed: rounded depth, a lens a degree off


@dataclass(frozen=True, eq=False)
class Motion:
    """One measurement."""

    time_us: int
    """The middle between the two pictures, on the vehicle's clock."""
    vel_ned: Floats
    """[m/s] (3,) of the vehicle's middle."""
    cov: Floats
    """[m²/s²] (3, 3)"""
    fitting: float
    """Fraction of the points that fit."""

    @property
    def std(self) -> float:
        """[m/s] of the worst axis."""
        return float(np.sqrt(np.diag(self.cov).max()))


@dataclass(frozen=True, eq=False)
class _Taken:
    """A picture with its moment."""

    time_us: int
    pixels: NDArray[np.uint8]
    view: View
    q_ned_from_rdf: Floats  # (3, 3)
    lens_ned: Floats  # [m] of the lens from the vehicle's middle
    counts: NDArray[np.bool_]  # (height, width) nobody is there


class VisualOdometry:
    """Of one vehicle's camera."""

    def __init__(self) -> None:
        self._last: _Taken | None = None

    def forget(self) -> None:
        """What comes next is no successor of what came."""
        self._last = None

    def see(self, pixels: NDArray[np.uint8], pose: Pose, people: list[Floats], expected: Vector) -> Motion | None:
        """Takes a picture; the motion since the last one, if that can be told.

        Args:
            pixels: (height, width, 4): colours and depth.
            pose: of the vehicle when it was taken; of the position only differences to `people` count.
            people: [m] where somebody is then, ned: they move by themselves.
            expected: [m/s] about how fast the vehicle goes, ned: where the search begins.
        """
        last = self._last
        if last is not None and np.array_equal(pixels, last.pixels):
            return None  # the same once more: noise never repeats, so it is no new one
        now = self._last = _taken(pixels, pose, people)
        dt_s = 0.0 if last is None else (now.time_us - last.time_us) * 1e-6
        if last is None or not NEXT_S[0] <= dt_s <= NEXT_S[1]:
            return None
        to_now = now.q_ned_from_rdf.T
        lever = now.lens_ned - last.lens_ned  # how the lens goes where the vehicle only turns
        guess = to_now @ (np.array(expected) * dt_s + lever)
        way = align(last.view, now.view, to_now @ last.q_ned_from_rdf, guess, last.counts)
        if way is None or way.fitting < _LEAST_FITTING:
            return None
        vel_ned = (now.q_ned_from_rdf @ way.moved - lever) / dt_s
        cov = now.q_ned_from_rdf @ way.cov @ to_now * (_NEIGHBOURS / dt_s) ** 2
        cov += (_STD_M_S**2 + (_STD_FRACTION * float(np.hypot(*vel_ned[:2]))) ** 2) * np.eye(3)
        return Motion((last.time_us + now.time_us) // 2, vel_ned, cov, way.fitting)


def _taken(pixels: NDArray[np.uint8], pose: Pose, people: list[Floats]) -> _Taken:
    view = view_of(pixels)
    mount = matrix_of(camera_mount())
    body = matrix_of(pose.q_ned_from_frd)
    lens = np.array(rotated(pose.q_ned_from_frd, LENS_FRD))
    counts = np.ones(view.grey.shape, bool)
    if people:
        points = (view.rays / view.inverse_depth[..., None]) @ (body @ mount).T.astype(np.float32)
        level = points[..., :2] + (np.array(pose.pos_ned) + lens)[:2]
        for place in people:
            off = level - place[:2]
            counts &= np.hypot(off[..., 0], off[..., 1]) > _PERSON_M
    return _Taken(pose.time_us, pixels, view, body @ mount, lens, counts)
