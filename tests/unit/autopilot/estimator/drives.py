"""Simulated drives in plain NumPy, independent of the simulator: a car on hills, its tyres slip, encoders count."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tests.unit.autopilot.estimator.flights import (
    Array,
    Flight,
    SensorNoise,
    hold,
    sensed,
)

REAR_X_M, CENTRE_HEIGHT_M, TRACK_M = -0.25, 0.12, 0.36
TYRE_SLIP = 0.007  # [s²/m] per specific force: an eighth of what a tyre of mu 1 at 8 deg needs
STEP_S = 0.004
WHEELS_EVERY = 5  # ticks: 50 Hz
COUNT_M = 6.0e-4  # of tread per count of an encoder


@dataclass(frozen=True)
class Drive:
    """What is driven; speed and curves by time."""

    speed_m_s: float = 3.0
    slope_deg: float = 10.0  # of the steepest hills
    turn_rad_s: float = 0.5
    rest_s: float = 8.0
    stop_s: float = 1e9  # from here on it stands
    duration_s: float = 100.0
    scale: tuple[float, float] = (0.0, 0.0)  # by which the wheels turn too little
    slip: float = TYRE_SLIP
    yaw0: float = 0.7
    noise: SensorNoise | None = None


def speed_at(drive: Drive, time_s: Array) -> Array:
    """[m/s] taken up and lost within two seconds, and a little uneven."""
    up = np.clip((time_s - drive.rest_s) / 2.0, 0.0, 1.0)
    down = np.clip((drive.stop_s - time_s) / 2.0, 0.0, 1.0)
    share = np.minimum(up, down)
    return np.asarray(drive.speed_m_s * share**2 * (3.0 - 2.0 * share) * (1.0 - 0.15 * np.sin(0.35 * time_s) ** 2))


def summed(rate: Array) -> Array:
    """The integral from zero over steps of STEP_S."""
    steps = 0.5 * (rate[1:] + rate[:-1]) * STEP_S
    return np.concatenate([np.zeros((1, *rate.shape[1:])), np.cumsum(steps, axis=0)])


def differentiated(value: Array) -> Array:
    return np.asarray(np.gradient(value, STEP_S, axis=0))


def make_drive(seed: int = 0, drive: Drive | None = None) -> Flight:
    """A drive and its samples: the rear axle follows a curve on the ground, but for what the tyres slip."""
    drive = drive or Drive()
    rng = np.random.default_rng(seed)
    edges = np.arange(round(drive.duration_s / STEP_S) + 1) * STEP_S
    speed = speed_at(drive, edges)
    phase = rng.uniform(0.0, 6.28, 3)
    turn_rate = drive.turn_rad_s * (0.7 * np.sin(0.23 * edges + phase[0]) + 0.6 * np.sin(0.61 * edges + phase[1]))
    course = drive.yaw0 + summed(turn_rate * speed / drive.speed_m_s)
    place = summed(np.stack([np.cos(course), np.sin(course)], -1) * speed[:, None])
    wave, steepest = 2.0 * np.pi / 40.0, np.tan(np.radians(drive.slope_deg))
    n, e = wave * place[:, 0] + phase[2], wave * place[:, 1]
    ground = steepest / wave * np.sin(n) * np.cos(e)
    rear = np.column_stack([place, ground[0] - ground])
    up_ned = np.column_stack([-steepest * np.cos(n) * np.cos(e), steepest * np.sin(n) * np.sin(e), -np.ones(len(n))])
    side_force = speed * differentiated(course)
    yaw = course + drive.slip * side_force
    down = -up_ned / np.linalg.norm(up_ned, axis=1, keepdims=True)
    right = np.cross(down, np.column_stack([np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)]))
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    nose = np.cross(right, down)
    q = Rotation.from_matrix(np.stack([nose, right, down], -1)).as_quat()
    pos = rear - REAR_X_M * nose - CENTRE_HEIGHT_M * down
    pos -= pos[0]
    flight = sensed(rng, edges, pos, differentiated(pos), q, yaw, speed > 0.0, drive.noise or SensorNoise())
    add_wheels(flight, drive, rng, edges, rear, nose, right)
    return flight


def add_wheels(
    flight: Flight, drive: Drive, rng: np.random.Generator, edges: Array, rear: Array, nose: Array, right: Array
) -> None:
    """Encoders on both sides' rear wheels, counted over 20 ms."""
    vel = differentiated(rear)
    force = differentiated(np.sum(vel * nose, -1)) - 9.80665 * nose[:, 2]
    wheels = flight.samples["wheels"]
    at = np.arange(WHEELS_EVERY - 1, len(wheels), WHEELS_EVERY)
    wheels["time_us"][at] = np.round(edges[1:][at] * 1e6).astype(np.int64)
    for name, side, scale in (("left_m_s", -1.0, drive.scale[0]), ("right_m_s", 1.0, drive.scale[1])):
        contact = differentiated(rear + 0.5 * side * TRACK_M * right)
        tread = np.sum(contact * nose, -1) * (1.0 + drive.slip * force) / (1.0 + scale)
        counts = np.floor(summed(tread) / COUNT_M + rng.uniform())
        wheels[name][at] = np.diff(counts[at + 1], prepend=counts[0]) * COUNT_M / (WHEELS_EVERY * STEP_S)
    hold(wheels)


def varied(seed: int, drive: Drive | None = None, scale_std: float = 0.015) -> Flight:
    """A drive whose wheels have scale errors drawn by its seed."""
    drawn = np.random.default_rng(1000 + seed).normal(0.0, scale_std, 2)
    return make_drive(seed, replace(drive or Drive(), scale=(float(drawn[0]), float(drawn[1]))))


def outage(flight: Flight, from_s: float, seconds: float) -> tuple[int, int]:
    """Takes GNSS away; returns the ticks of its first and last moment."""
    first, end = round(from_s / STEP_S), round((from_s + seconds) / STEP_S)
    column: Any = flight.samples["gnss"]
    column[first:end] = column[first]
    return first, end


def distance(flight: Flight, first: int, end: int) -> float:
    """[m] driven between two ticks."""
    return float(np.linalg.norm(np.diff(flight.pos_ned[first:end], axis=0), axis=1).sum())
