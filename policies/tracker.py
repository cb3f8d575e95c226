"""Where the owner is: one estimate from what the camera sees of them and from what their phone says, 10 to 20 Hz.

In: sightings (direction, and range if depth shows it) with the camera's pose as the flight controller estimates it, and
reports of FOLLOW_TARGET. Out: place and velocity of the owner's chest in the vehicle's ned frame, with covariance, also
while either source or both are missing. Interacting multiple models (Blom and Bar-Shalom 1988), filterpy's: the owner
either keeps their velocity or manoeuvres. State: place, velocity, and the error of the phone's places in this frame,
which sightings teach and which then serves while the owner is hidden.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, exp, inf, isfinite, pi, sin, sqrt
from sys import float_info

import numpy as np
from filterpy.kalman import IMMEstimator, KalmanFilter
from numpy.typing import NDArray

from common.attitude import rotated

Array = NDArray[np.float64]

STEP_US = 50_000  # of the filter: 20 Hz
_STEP_S = STEP_US * 1e-6
_STATES = 9
_POS, _VEL, _BIAS = slice(0, 3), slice(3, 6), slice(6, 9)
_UNKNOWN_M = 1000.0  # standard deviation of a place, or of a range, of which nothing is known
_NEAR_M, _FAR_M = 0.5, 10.0  # a direction without range is taken as of an owner at least and at most this far away
_GATE = 16.27  # chi-square of three degrees of freedom, exceeded by one good measurement in a thousand
_MANOEUVRING = 1  # index of the model; 0: steady
_FORGET_US = 60_000_000  # after so long without a call nothing is left to carry on
_ASTRAY_M = 5.0  # what is added to the uncertainty of a place that turned out wrong; guess


@dataclass(frozen=True, slots=True)
class TrackerSettings:
    """How the owner moves and how good the sources are. Standard deviations are per axis; north and east, then down."""

    steady_nsd: tuple[float, float] = (0.25, 0.1)
    """Noise density of the velocity while the owner keeps going [m/s/√s]; guess: gait and small corrections."""
    manoeuvre_speed_std: tuple[float, float] = (2.0, 0.4)
    """Spread of the velocity that a manoeuvring owner comes to [m/s]; guess, for speeds to 5 m/s."""
    manoeuvre_time_s: float = 1.2
    """How fast they come to it; guess, twice the relaxation time of people's speed."""
    steady_s: float = 3.0
    """Mean time between manoeuvres [s]; guess."""
    manoeuvre_s: float = 1.0
    """Mean length of a manoeuvre [s]; guess."""
    direction_std_rad: float = 0.04
    """Of a sighting: where in the image, and how the camera is held; guess, 2.3 degrees."""
    range_std_m: float = 0.15
    """Of the range, near; guess: half the depth of a body."""
    range_std_fraction: float = 0.05
    """What is added per metre of range; guess."""
    report_std_m: tuple[float, float] = (0.3, 0.6)
    """White error of reported places; the phone model's."""
    report_bias_std_m: tuple[float, float] = (1.7, 3.2)
    """Slow error of reported places in the vehicle's frame: the phone's and the vehicle's own together."""
    report_bias_time_s: float = 60.0
    """Correlation time of that error."""
    report_vel_std: float = 0.25
    """Error of reported velocities [m/s]."""
    rejections_max: int = 8
    """That many measurements of one source rejected in a row are believed: the owner was somewhere else."""


@dataclass(frozen=True, slots=True)
class Sighting:
    """The owner's chest in an image."""

    azimuth_rad: float  # in the camera frame rdf: from the optical axis to the right
    elevation_rad: float  # and up, from the plane of the axis and the right
    range_m: float | None  # from the camera; None if depth does not show it
    camera_pos_ned: Sequence[float]  # [m] as the flight controller estimates it
    q_ned_from_rdf: Sequence[float]  # x, y, z, w


@dataclass(frozen=True, slots=True)
class PhoneReport:
    """One FOLLOW_TARGET, in the vehicle's ned frame."""

    time_us: int  # of validity
    pos_ned: Sequence[float]  # [m]
    vel_ned: Sequence[float] | None  # [m/s]; None if the phone does not say


@dataclass(frozen=True, slots=True)
class OwnerTrack:
    """What is known of the owner at a time."""

    time_us: int
    pos_ned: Array  # [m] of the chest, (3,)
    vel_ned: Array  # [m/s], (3,)
    pos_cov: Array  # [m²], (3, 3)
    vel_cov: Array  # [m²/s²], (3, 3)
    seen_age_s: float  # since the last sighting that was believed; inf: never
    heard_age_s: float  # since the validity of the last report that was believed; inf: never
    manoeuvre_probability: float  # probability that the owner is manoeuvring

    @property
    def is_known(self) -> bool:
        """Whether anything has ever been seen or heard."""
        return isfinite(self.seen_age_s) or isfinite(self.heard_age_s)


class _Filter(KalmanFilter):  # type: ignore[misc]  # filterpy has no types
    """filterpy's filter of one model; its own likelihood asks scipy and takes most of a step's time."""

    @property
    def likelihood(self) -> float:
        """Density of the last innovation, never zero."""
        exponent = -0.5 * float(self.y @ self.SI @ self.y)
        return max(exp(exponent) / sqrt((2.0 * pi) ** len(self.y) * float(np.linalg.det(self.S))), float_info.min)


class _Models(IMMEstimator):  # type: ignore[misc]  # filterpy has no types
    """filterpy's estimator, with the chain of models run at every step; its own runs it at every measurement."""

    mu: Array  # probability of each model
    cbar: Array  # the same after the chain has run

    def step(self) -> None:
        """One step of STEP_US without a measurement."""
        self._compute_mixing_probabilities()
        self.mu = self.cbar.copy()
        self.predict()

    def fuse(self, z: Array, H: Array, R: Array) -> None:
        """One measurement of three numbers, H the same for all models."""
        for model in self.filters:
            model.H, model.R = H, R
        self.cbar = self.mu.copy()
        self.update(z)


class OwnerTracker:
    """The filter. Feed it in the order in which things arrive; the same inputs give the same track, bit for bit.

    Args:
        settings: how the owner moves and how good the sources are.
    """

    def __init__(self, settings: TrackerSettings | None = None) -> None:
        self._settings = settings or TrackerSettings()
        self._models = _models(self._settings)
        self._nsd2 = np.array([model.accel_nsd2 for model in _motions(self._settings)])
        self._time_us: int | None = None  # of the filter; None before the first measurement
        self._camera = _Source()
        self._phone = _Source()

    def see(self, time_us: int, sighting: Sighting) -> bool:
        """Fuses a sighting; false if it was rejected: not plausible, or not a number.

        Args:
            time_us: when the image was taken.
            sighting: the owner in it.
        """
        self._advance(time_us)
        axes_ned = sighting_axes_ned(sighting)
        camera_pos_ned = np.asarray(sighting.camera_pos_ned, np.float64)
        range_m, std_m = self._range_and_std(sighting, axes_ned, camera_pos_ned)
        is_behind = range_m < 0.0
        H = np.zeros((3, _STATES))
        H[:, _POS] = axes_ned
        H[:, _VEL] = -self._lag_s(time_us) * axes_ned
        z = axes_ned @ camera_pos_ned + np.array([range_m, 0.0, 0.0])
        if not np.isfinite(z).all():
            return False
        R = np.diag(std_m**2) + axes_ned @ self._lag_cov(time_us) @ axes_ned.T
        if not self._admits(self._camera, not is_behind and self._is_plausible(z, H, R), _POS):
            return False
        self._models.fuse(z, H, R)
        self._camera.last_us = time_us
        return True

    def hear(self, time_us: int, report: PhoneReport) -> bool:
        """Fuses a report; false if it was rejected: not plausible, or not a number.

        Args:
            time_us: when it came.
            report: what it says.
        """
        self._advance(time_us)
        s = self._settings
        lag_s = self._lag_s(report.time_us)
        H = np.zeros((3, _STATES))
        H[:, _POS] = H[:, _BIAS] = np.eye(3)
        H[:, _VEL] = -lag_s * np.eye(3)
        R = _level_diagonal(s.report_std_m) ** 2 + self._lag_cov(report.time_us)
        z = np.asarray(report.pos_ned, np.float64)
        if not np.isfinite(z).all():
            return False
        if not self._admits(self._phone, self._is_plausible(z, H, R), _BIAS):
            return False
        self._models.fuse(z, H, R)
        self._phone.last_us = report.time_us
        if report.vel_ned is not None:
            H = np.zeros((3, _STATES))
            H[:, _VEL] = np.eye(3)
            R = s.report_vel_std**2 * np.eye(3) + abs(lag_s) * np.diag(self._mean_nsd2())
            vel = np.asarray(report.vel_ned, np.float64)
            if self._is_plausible(vel, H, R):
                self._models.fuse(vel, H, R)
        return True

    def at(self, time_us: int) -> OwnerTrack:
        """What is known at a time; one before the newest measurement is answered by going back straight."""
        self._advance(time_us)
        x, P = self._models.x, self._models.P
        lead_s = -self._lag_s(time_us)
        cross = P[_POS, _VEL]
        pos_cov = P[_POS, _POS] + lead_s * (cross + cross.T) + lead_s**2 * P[_VEL, _VEL] + self._lag_cov(time_us)
        return OwnerTrack(
            time_us,
            x[_POS] + lead_s * x[_VEL],
            x[_VEL].copy(),
            pos_cov,
            P[_VEL, _VEL] + abs(lead_s) * np.diag(self._mean_nsd2()),
            self._camera.age_s(time_us),
            self._phone.age_s(time_us),
            float(self._models.mu[_MANOEUVRING]),
        )

    def _advance(self, time_us: int) -> None:
        """Steps the filter to the last whole step at or before a time: when it is asked does not change its state."""
        if self._time_us is None:
            self._time_us = time_us
        if time_us - self._time_us > _FORGET_US:
            self._models = _models(self._settings)
            self._time_us = time_us
        while self._time_us + STEP_US <= time_us:
            self._models.step()
            self._time_us += STEP_US

    def _lag_s(self, valid_us: int) -> float:
        """From the validity of a measurement to the filter's time; negative for a measurement within its next step."""
        return ((self._time_us or 0) - valid_us) * 1e-6

    def _mean_nsd2(self) -> Array:
        """Noise density of the velocity, squared, over the models [m²/s³], (3,)."""
        return np.asarray(self._models.mu @ self._nsd2)

    def _lag_cov(self, valid_us: int) -> Array:
        """What the owner's acceleration adds over the lag to a place carried on with their velocity [m²], (3, 3)."""
        return np.diag(self._mean_nsd2()) * abs(self._lag_s(valid_us)) ** 3 / 3.0

    def _range_and_std(self, sighting: Sighting, axes_ned: Array, camera_pos_ned: Array) -> tuple[float, Array]:
        """Range [m], and standard deviations along the ray and across it, twice [m]."""
        s = self._settings
        if sighting.range_m is not None:
            across = max(sighting.range_m, _NEAR_M) * s.direction_std_rad
            return sighting.range_m, np.array([s.range_std_m + s.range_std_fraction * sighting.range_m, across, across])
        # the range says nothing, the direction is worth what it is at the expected range
        way = self._models.x[_POS] - camera_pos_ned
        expected = sqrt(float(way @ way) + float(np.trace(self._models.P[_POS, _POS])))
        across = min(max(expected, _NEAR_M), _FAR_M) * s.direction_std_rad
        is_placed = expected < _UNKNOWN_M
        return float(axes_ned[0] @ way) if is_placed else _NEAR_M, np.array([_UNKNOWN_M, across, across])

    def _is_plausible(self, z: Array, H: Array, R: Array) -> bool:
        """Whether the innovation is within the gate; not a number never is."""
        innov = z - H @ self._models.x
        innov_var = H @ self._models.P @ H.T + R
        return float(innov @ np.linalg.solve(innov_var, innov)) < _GATE

    def _admits(self, source: "_Source", is_plausible: bool, doubted: slice) -> bool:
        """Whether to fuse a measurement: it is plausible, or so many were not that the track is doubted instead."""
        source.refused = 0 if is_plausible else source.refused + 1
        if source.refused <= self._settings.rejections_max:
            return is_plausible
        for model in self._models.filters:
            model.P[doubted, doubted] += _ASTRAY_M**2 * np.eye(3)
        source.refused = 0
        return True


@dataclass(slots=True)
class _Source:
    """What came from the camera or the phone so far."""

    last_us: int | None = None  # validity of the last measurement that was believed
    refused: int = 0  # in a row

    def age_s(self, time_us: int) -> float:
        return inf if self.last_us is None else (time_us - self.last_us) / 1e6


@dataclass(frozen=True, slots=True)
class _Motion:
    """One model of the owner's velocity: kept, or drawn towards zero, with noise."""

    keep: float  # factor over a step
    vel_var: Array  # [m²/s²] added over a step, (3,)
    accel_nsd2: Array  # [m²/s³], (3,)


def sighting_axes_ned(sighting: Sighting) -> Array:
    """The ray to the owner, and two directions across it: rows, unit, (3, 3)."""
    right, up = sighting.azimuth_rad, sighting.elevation_rad
    axes_rdf = (
        (sin(right) * cos(up), -sin(up), cos(right) * cos(up)),
        (cos(right), 0.0, -sin(right)),
        (sin(right) * sin(up), cos(up), cos(right) * sin(up)),
    )
    return np.array([rotated(sighting.q_ned_from_rdf, axis) for axis in axes_rdf])


def _level_diagonal(level_and_down: tuple[float, float]) -> Array:
    """North, east and down as a diagonal matrix."""
    return np.diag([level_and_down[0], level_and_down[0], level_and_down[1]])


def _motions(s: TrackerSettings) -> tuple[_Motion, _Motion]:
    """The steady and the manoeuvring owner."""
    steady = np.diag(_level_diagonal(s.steady_nsd)) ** 2
    spread = np.diag(_level_diagonal(s.manoeuvre_speed_std)) ** 2
    keep = exp(-_STEP_S / s.manoeuvre_time_s)
    return (
        _Motion(1.0, steady * _STEP_S, steady),
        _Motion(keep, spread * (1.0 - keep**2), 2.0 * spread / s.manoeuvre_time_s),
    )


def _models(s: TrackerSettings) -> _Models:
    """The filters of both motions, of an owner of whom nothing is known."""
    bias_std = _level_diagonal(s.report_bias_std_m)
    bias_keep = exp(-_STEP_S / s.report_bias_time_s)
    filters = []
    for motion in _motions(s):
        model = _Filter(dim_x=_STATES, dim_z=3)
        model.x = np.zeros(_STATES)
        model.P = np.zeros((_STATES, _STATES))
        model.P[_POS, _POS] = _UNKNOWN_M**2 * np.eye(3)
        model.P[_VEL, _VEL] = _level_diagonal(s.manoeuvre_speed_std) ** 2
        model.P[_BIAS, _BIAS] = bias_std**2
        model.F = np.eye(_STATES)
        model.F[_POS, _VEL] = _STEP_S * np.eye(3)
        model.F[_VEL, _VEL] *= motion.keep
        model.F[_BIAS, _BIAS] *= bias_keep
        model.Q = np.zeros((_STATES, _STATES))
        # a velocity that wanders over the step moves the place by half of it, and a little more
        model.Q[_POS, _POS] = np.diag(motion.vel_var) * _STEP_S**2 / 3.0
        model.Q[_POS, _VEL] = model.Q[_VEL, _POS] = np.diag(motion.vel_var) * _STEP_S / 2.0
        model.Q[_VEL, _VEL] = np.diag(motion.vel_var)
        model.Q[_BIAS, _BIAS] = bias_std**2 * (1.0 - bias_keep**2)
        filters.append(model)
    leave_steady, leave_manoeuvre = 1.0 - exp(-_STEP_S / s.steady_s), 1.0 - exp(-_STEP_S / s.manoeuvre_s)
    chain = np.array([[1.0 - leave_steady, leave_steady], [leave_manoeuvre, 1.0 - leave_manoeuvre]])
    fraction = np.array([s.steady_s, s.manoeuvre_s]) / (s.steady_s + s.manoeuvre_s)
    return _Models(filters, fraction, chain)
