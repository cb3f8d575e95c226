"""Curved ways: splines, turns round a position, and a point that moves along them as fast as the bends allow.

The vehicle is asked to be with that point, at its velocity; the point waits for a vehicle that lags behind.
"""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import atan2, cos, hypot, inf, pi, sin, sqrt
from typing import Protocol

from autopilot.navigator.context import distance
from autopilot.navigator.setpoint import Vector
from common.kernels import FRAME_US

_FRAME_S = FRAME_US * 1e-6
_SAMPLES = 48  # per spline: a chord of a 10 m turn is then a few millimetres off its arc
_SLOWEST_M_S = 0.5  # the point never stands still on its way; guess


@dataclass(frozen=True, slots=True)
class Pace:
    """How fast a curve may be flown."""

    cruise: float  # [m/s] horizontal
    climb: float
    descend: float
    accel: float  # [m/s²] along the way, and across it
    jerk: float  # [m/s³] along the way
    lag_max: float  # [m] behind the point at which it waits


class Curve(Protocol):
    """A way of known length."""

    length: float  # [m]

    def at(self, arc_length: float) -> tuple[Vector, Vector]:
        """Place [m] and unit direction after `arc_length` metres."""
        ...

    def top_speed(self, arc_length: float) -> float:
        """The speed [m/s] that is allowed there, so that all that follows can be braked for."""
        ...


class Polyline:
    """A smooth curve given by close points, with the speed that its bends allow.

    Args:
        points: [m] at least two, no two neighbours equal.
        pace: limits.
        exit_speed: [m/s] allowed at its end.
    """

    def __init__(self, points: Sequence[Vector], pace: Pace, exit_speed: float) -> None:
        self._points = points
        self._arc_lengths = [0.0]
        for a, b in pairwise(points):
            self._arc_lengths.append(self._arc_lengths[-1] + distance(a, b))
        self.length = self._arc_lengths[-1]
        last = len(points) - 1
        self._directions = [_direction(points[max(k - 1, 0)], points[min(k + 1, last)]) for k in range(last + 1)]
        self._speeds = [self._bend_speed(k, pace) for k in range(last + 1)]
        self._speeds[last] = min(self._speeds[last], max(exit_speed, _SLOWEST_M_S))
        self._brake = 2.0 * pace.accel
        for k in range(last - 1, -1, -1):
            reach = self._arc_lengths[k + 1] - self._arc_lengths[k]
            self._speeds[k] = min(self._speeds[k], sqrt(self._speeds[k + 1] ** 2 + self._brake * reach))

    def at(self, arc_length: float) -> tuple[Vector, Vector]:
        k, fraction = self._find(arc_length)
        return _mix(self._points[k], self._points[k + 1], fraction), _mix(
            self._directions[k], self._directions[k + 1], fraction
        )

    def top_speed(self, arc_length: float) -> float:
        k, fraction = self._find(arc_length)
        speeds = self._speeds
        return speeds[k] + (speeds[k + 1] - speeds[k]) * fraction

    def _find(self, arc_length: float) -> tuple[int, float]:
        k = min(max(bisect_right(self._arc_lengths, arc_length) - 1, 0), len(self._arc_lengths) - 2)
        return k, min(
            max((arc_length - self._arc_lengths[k]) / (self._arc_lengths[k + 1] - self._arc_lengths[k]), 0.0), 1.0
        )

    def _bend_speed(self, k: int, pace: Pace) -> float:
        """The speed at which the bend at a point needs no more than the acceleration allowed."""
        north, east, down = self._directions[k]
        speed = pace.cruise / max(hypot(north, east), 1e-3)
        if down:
            speed = min(speed, (pace.descend if down > 0.0 else pace.climb) / abs(down))
        if 0 < k < len(self._points) - 1:
            before = _direction(self._points[k - 1], self._points[k])
            after = _direction(self._points[k], self._points[k + 1])
            bend = distance(before, after) / (0.5 * (self._arc_lengths[k + 1] - self._arc_lengths[k - 1]))
            speed = min(speed, sqrt(pace.accel / bend) if bend > 1e-6 else inf)
        return max(speed, _SLOWEST_M_S)


class Turns:
    """Level turns around a centre.

    Args:
        centre_ned: [m] with the height to fly at.
        start_rad: direction from the centre to where it begins.
        radius: [m] positive clockwise, negative counter-clockwise.
        turns: how many, also parts of one.
        pace: limits.
    """

    def __init__(self, centre_ned: Vector, start_rad: float, radius: float, turns: float, pace: Pace) -> None:
        self._centre = centre_ned
        self._start = start_rad
        self._radius = abs(radius)
        self._sign = 1.0 if radius > 0.0 else -1.0
        self.length = 2.0 * pi * self._radius * turns
        self._accel = pace.accel
        self._speed = max(min(pace.cruise, sqrt(pace.accel * self._radius)), _SLOWEST_M_S)

    def at(self, arc_length: float) -> tuple[Vector, Vector]:
        angle = self._start + self._sign * arc_length / self._radius
        north, east, down = self._centre
        c, s = cos(angle), sin(angle)
        return (
            (north + self._radius * c, east + self._radius * s, down),
            (-self._sign * s, self._sign * c, 0.0),
        )

    def top_speed(self, arc_length: float) -> float:
        return min(self._speed, sqrt(2.0 * self._accel * max(self.length - arc_length, 0.0)) + _SLOWEST_M_S)


class Runner:
    """The point that moves along a curve."""

    __slots__ = ("_accel", "_pace", "arc_length", "curve", "speed")

    def __init__(self, curve: Curve, pace: Pace, speed: float) -> None:
        self.curve = curve
        self._pace = pace
        self.arc_length = 0.0  # [m]
        self.speed = speed  # [m/s]
        self._accel = 0.0

    @property
    def is_at_end(self) -> bool:
        return self.arc_length >= self.curve.length

    def step(self, here: Vector) -> tuple[Vector, Vector]:
        """Moves on by one frame and returns place [m] and velocity [m/s]; `here` is where the vehicle is."""
        pace, curve = self._pace, self.curve
        position, _ = curve.at(self.arc_length)
        fraction = min(max(2.0 - 2.0 * distance(position, here) / pace.lag_max, 0.0), 1.0)
        top = curve.top_speed(self.arc_length)
        if self.speed < top:
            self._accel = min(self._accel + pace.jerk * _FRAME_S, pace.accel)
            self.speed = min(self.speed + self._accel * _FRAME_S, top)
        else:
            self._accel = 0.0
            self.speed = max(self.speed - pace.accel * _FRAME_S, top)
        self.arc_length = min(self.arc_length + fraction * self.speed * _FRAME_S, curve.length)
        position, (north, east, down) = curve.at(self.arc_length)
        flown = 0.0 if self.arc_length >= curve.length else fraction * self.speed
        return position, (north * flown, east * flown, down * flown)


def spline(start: Vector, start_along: Vector, end: Vector, end_along: Vector) -> list[Vector]:
    """Points of the cubic Hermite curve between two places.

    Args:
        start: [m] where it begins.
        start_along: direction there, of any length; zero: from rest.
        end: [m] where it ends.
        end_along: direction there, of any length; zero: to rest.
    """
    chord = distance(start, end)
    leave, arrive = _scaled(start_along, chord), _scaled(end_along, chord)
    points = []
    for k in range(_SAMPLES + 1):
        t = k / _SAMPLES
        t2, t3 = t * t, t * t * t
        h00, h10, h01, h11 = 2 * t3 - 3 * t2 + 1, t3 - 2 * t2 + t, 3 * t2 - 2 * t3, t3 - t2
        points.append(
            (
                h00 * start[0] + h10 * leave[0] + h01 * end[0] + h11 * arrive[0],
                h00 * start[1] + h10 * leave[1] + h01 * end[1] + h11 * arrive[1],
                h00 * start[2] + h10 * leave[2] + h01 * end[2] + h11 * arrive[2],
            )
        )
    return points


def distinct(points: list[Vector]) -> list[Vector]:
    """The points without repetitions."""
    kept: list[Vector] = []
    for point in points:
        if not kept or hypot(point[0] - kept[-1][0], point[1] - kept[-1][1]) + abs(point[2] - kept[-1][2]) > 1e-3:
            kept.append(point)
    return kept


def bearing(from_ned: Vector, to_ned: Vector) -> float:
    """Direction [rad] from one position to another."""
    return atan2(to_ned[1] - from_ned[1], to_ned[0] - from_ned[0])


def between(a: Vector, b: Vector) -> Vector:
    """The way [m] from a to b."""
    return b[0] - a[0], b[1] - a[1], b[2] - a[2]


def _direction(a: Vector, b: Vector) -> Vector:
    return _scaled(between(a, b), 1.0)


def _scaled(vector: Vector, length: float) -> Vector:
    size = sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    fraction = length / size if size > 1e-6 else 0.0
    return vector[0] * fraction, vector[1] * fraction, vector[2] * fraction


def _mix(a: Vector, b: Vector, fraction: float) -> Vector:
    return a[0] + (b[0] - a[0]) * fraction, a[1] + (b[1] - a[1]) * fraction, a[2] + (b[2] - a[2]) * fraction
