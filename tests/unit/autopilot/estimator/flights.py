"""Simulated flights in plain NumPy, independent of the simulator: true motion and the samples its sensors give.

A vehicle rests, climbs, and flies a figure of eight while it turns. Attitude follows from the acceleration (a
multirotor's thrust axis) and heading; IMU samples are exact differences of the motion over each interval, plus noise.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from autopilot.ports import Samples

Array = NDArray[np.float64]
Path = Callable[[Array], tuple[Array, Array]]

GRAVITY = np.array([0.0, 0.0, 9.80665])
FIELD_NED_GAUSS = (0.212, 0.011, 0.430)  # Zurich, rounded
SAMPLES = Samples.numpy_dtype()


@dataclass
class SensorNoise:
    """One standard deviation each; the defaults are those of the default sensors."""

    gyro: float = 0.005  # [rad/s] per sample
    accel: float = 0.2  # [m/s²] per sample
    gyro_bias: float = 0.0017  # [rad/s]
    accel_bias: float = 0.02  # [m/s²]
    gnss_white: float = 0.3  # [m]
    gnss_wander: float = 0.6  # [m] correlated over 60 s
    gnss_vel: float = 0.1  # [m/s]
    baro: float = 1.2  # [Pa]
    baro_drift: float = 4.0  # [Pa] correlated over 300 s
    mag: float = 1.5e-4  # [gauss]
    hard_iron: float = 3.0e-3  # [gauss]
    soft_iron: float = 3.0e-3
    range: float = 0.02  # [m]


@dataclass
class Flight:
    """Truth at the end of each IMU interval, and the samples delivered then; arrays have one row per tick."""

    time_s: Array
    dt_s: Array
    pos_ned: Array
    vel_ned: Array
    q: Array  # q_ned_from_frd as x, y, z, w
    yaw: Array
    gyro_bias: Array
    accel_bias: Array
    samples: Any
    wind_ned: Array = field(default_factory=lambda: np.zeros(3))


def quat_multiply(a: Array, b: Array) -> Array:
    av, aw, bv, bw = a[..., :3], a[..., 3:], b[..., :3], b[..., 3:]
    return np.concatenate([aw * bv + bw * av + np.cross(av, bv), aw * bw - np.sum(av * bv, -1, keepdims=True)], -1)


def quat_conjugate(q: Array) -> Array:
    return q * np.array([-1.0, -1.0, -1.0, 1.0])


def quat_rotate(q: Array, v: Array) -> Array:
    t = 2.0 * np.cross(q[..., :3], v)
    return v + q[..., 3:] * t + np.cross(q[..., :3], t)


def rotvec_from_quat(q: Array) -> Array:
    q = np.where(q[..., 3:] < 0.0, -q, q)
    length = np.linalg.norm(q[..., :3], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(length, q[..., 3:])
    return q[..., :3] * np.where(length > 1e-12, angle / np.maximum(length, 1e-12), 2.0)


def attitude(thrust_dir_ned: Array, yaw: Array) -> Array:
    """Attitudes whose body down axis is opposite to the thrust and whose heading is yaw."""
    down = -thrust_dir_ned / np.linalg.norm(thrust_dir_ned, axis=-1, keepdims=True)
    heading = np.stack([np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)], -1)
    right = np.cross(down, heading)
    right /= np.linalg.norm(right, axis=-1, keepdims=True)
    forward = np.cross(right, down)
    m = np.stack([forward, right, down], -1)
    trace = m[:, 0, 0] + m[:, 1, 1] + m[:, 2, 2]
    w = 0.5 * np.sqrt(np.maximum(1.0 + trace, 1e-9))
    x = (m[:, 2, 1] - m[:, 1, 2]) / (4.0 * w)
    y = (m[:, 0, 2] - m[:, 2, 0]) / (4.0 * w)
    z = (m[:, 1, 0] - m[:, 0, 1]) / (4.0 * w)
    q = np.stack([x, y, z, w], -1)
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def wander(rng: np.random.Generator, count: int, std: float, tau_s: float, dt_s: float, width: int) -> Array:
    """First-order Gauss-Markov process, shape (count, width)."""
    keep = np.exp(-dt_s / tau_s)
    out = np.empty((count, width))
    value = rng.normal(0.0, std, width)
    for k in range(count):
        out[k] = value
        value = keep * value + np.sqrt(1.0 - keep * keep) * rng.normal(0.0, std, width)
    return out


def isa_pressure(alt_m: Array) -> Array:
    return np.asarray(101325.0 * (1.0 - 0.0065 * alt_m / 288.15) ** 5.255880)


def figure_of_eight(time_s: Array, rest_s: float, size_m: float, rate: float, yaw_rate: float, yaw0: float) -> Any:
    """Position and heading over time: rest, then climb to 15 m and blend into the figure."""
    t = np.maximum(time_s - rest_s, 0.0)
    blend = np.clip(t / 8.0, 0.0, 1.0)
    blend = blend**3 * (10.0 - 15.0 * blend + 6.0 * blend**2)
    pos = np.stack(
        [
            blend * size_m * np.sin(rate * t),
            blend * 0.5 * size_m * np.sin(2.0 * rate * t),
            -blend * (15.0 + 3.0 * np.sin(0.3 * t)),
        ],
        -1,
    )
    return pos, yaw0 + blend * (yaw_rate * t + 0.8 * np.sin(0.2 * t))


def make_flight(
    seed: int = 0,
    duration_s: float = 60.0,
    rest_s: float = 6.0,
    size_m: float = 20.0,
    rate: float = 0.35,
    yaw_rate: float = 0.1,
    yaw0: float = 0.7,
    noise: SensorNoise | None = None,
    jitter: float = 0.0,
    gnss_delay_s: float = 0.12,
    path: Path | None = None,
    leans: bool = True,
) -> Flight:
    """A flight and its samples.

    Args:
        seed: of all noise.
        duration_s: length.
        rest_s: time on the ground.
        size_m: half length of the figure of eight.
        rate: [rad/s] of the figure.
        yaw_rate: [rad/s] mean turn rate.
        yaw0: [rad] heading at the start.
        noise: of the sensors.
        jitter: share by which IMU intervals vary about 4 ms.
        gnss_delay_s: from validity to delivery.
        path: position and heading at given times, in the place of the figure of eight.
        leans: a multirotor leans into its acceleration, a ground vehicle stays level.
    """
    noise = noise or SensorNoise()
    rng = np.random.default_rng(seed)
    count = round(duration_s / 0.004)
    dt_us = np.round(4000.0 * (1.0 + jitter * rng.uniform(-1.0, 1.0, count))).astype(np.int64)
    time_us = np.cumsum(dt_us)
    edges = np.concatenate([[0.0], time_us * 1e-6])
    path = path or (lambda times_s: figure_of_eight(times_s, rest_s, size_m, rate, yaw_rate, yaw0))
    pos, yaw = path(edges)
    h = 1e-3
    before, _ = path(edges - h)
    after, _ = path(edges + h)
    vel = (after - before) / (2.0 * h)
    accel = (after - 2.0 * pos + before) / h**2
    q = attitude(accel - GRAVITY if leans else np.broadcast_to(-GRAVITY, accel.shape), yaw)
    return sensed(rng, edges, pos, vel, q, yaw, edges > rest_s, noise, gnss_delay_s)


def sensed(
    rng: np.random.Generator,
    edges: Array,
    pos: Array,
    vel: Array,
    q: Array,
    yaw: Array,
    is_moving: Array,
    noise: SensorNoise,
    gnss_delay_s: float = 0.12,
) -> Flight:
    """What the sensors give of a true motion.

    Args:
        rng: of all noise.
        edges: [s] from zero, the ends of the IMU intervals, in whole microseconds.
        pos: [m] ned, at each of them, as all that follow.
        vel: [m/s] ned.
        q: q_ned_from_frd as x, y, z, w.
        yaw: [rad]
        is_moving: the vehicle shakes then.
        noise: of the sensors.
        gnss_delay_s: from validity to delivery.
    """
    count = len(edges) - 1
    time_us = np.round(edges[1:] * 1e6).astype(np.int64)
    dt = np.diff(time_us, prepend=0) * 1e-6
    turn = rotvec_from_quat(quat_multiply(quat_conjugate(q[:-1]), q[1:]))
    middle = quat_multiply(q[:-1], np.concatenate([0.25 * turn * 2.0 / 2.0, np.ones((count, 1))], -1))
    middle /= np.linalg.norm(middle, axis=-1, keepdims=True)
    force = quat_rotate(quat_conjugate(middle), (vel[1:] - vel[:-1]) / dt[:, None] - GRAVITY)
    gyro_bias = rng.normal(0.0, noise.gyro_bias, 3)
    accel_bias = rng.normal(0.0, noise.accel_bias, 3)
    samples = np.zeros(count, dtype=SAMPLES)
    imu = samples["imu"]
    imu["time_us"] = time_us
    imu["dt_s"] = dt
    quiet = np.where(is_moving[1:, None], 1.0, 0.3)
    imu["gyro_frd"] = turn / dt[:, None] + gyro_bias + quiet * rng.normal(0.0, max(noise.gyro, 1e-12), (count, 3))
    imu["accel_frd"] = force + accel_bias + quiet * rng.normal(0.0, max(noise.accel, 1e-12), (count, 3))
    true_pos, true_vel, true_q = pos[1:], vel[1:], q[1:]

    gnss_every, baro_every, mag_every, range_every = 50, 5, 10, 10
    gnss_at = np.arange(gnss_every, count, gnss_every)
    error = wander(rng, len(gnss_at), noise.gnss_wander, 60.0, 0.2, 3)
    error += rng.normal(0.0, max(noise.gnss_white, 1e-12), error.shape)
    error[:, 2] *= 1.5
    for k, at in enumerate(gnss_at):
        arrives = np.searchsorted(time_us, time_us[at] + round(gnss_delay_s * 1e6))
        sample = samples["gnss"][arrives : arrives + 1]
        if len(sample) == 0:
            continue
        sample["time_us"] = time_us[at]
        sample["fix_type"], sample["satellites"] = 3, 14
        sample["pos_ned"] = true_pos[at] + error[k]
        sample["vel_ned"] = true_vel[at] + rng.normal(0.0, max(noise.gnss_vel, 1e-12), 3)
        sample["pos_h_std"], sample["pos_v_std"], sample["vel_std"] = 0.95, 1.0, 0.17
    baro_at = np.arange(0, count, baro_every)
    drift = wander(rng, len(baro_at), noise.baro_drift, 300.0, 0.02, 1)[:, 0]
    pressure = isa_pressure(488.0 - true_pos[baro_at, 2]) + drift + rng.normal(0.0, max(noise.baro, 1e-12), len(drift))
    samples["baro"]["time_us"][baro_at] = time_us[baro_at]
    samples["baro"]["pressure_pa"][baro_at] = pressure
    mag_at = np.arange(0, count, mag_every)
    soft = rng.normal(0.0, noise.soft_iron, (3, 3))
    soft = np.eye(3) + 0.5 * (soft + soft.T)
    field_frd = quat_rotate(quat_conjugate(true_q[mag_at]), np.array(FIELD_NED_GAUSS))
    field_frd = field_frd @ soft.T + rng.normal(0.0, noise.hard_iron, 3)
    samples["mag"]["time_us"][mag_at] = time_us[mag_at]
    samples["mag"]["field_frd_gauss"][mag_at] = field_frd + rng.normal(0.0, max(noise.mag, 1e-12), field_frd.shape)
    range_at = np.arange(0, count, range_every)
    down = quat_rotate(true_q[range_at], np.array([0.0, 0.0, 1.0]))[:, 2]
    distance = (0.2 - true_pos[range_at, 2]) / down
    distance += np.maximum(noise.range, 0.0033 * distance) * rng.normal(0.0, 1.0, len(distance)) * (noise.range > 0.0)
    samples["range"]["time_us"][range_at] = time_us[range_at]
    samples["range"]["distance_m"][range_at] = distance
    samples["range"]["is_valid"][range_at] = 1
    for name in ("gnss", "baro", "mag", "range"):
        hold(samples[name])
    return Flight(edges[1:], dt, true_pos, true_vel, true_q, yaw[1:], gyro_bias, accel_bias, samples)


def hold(column: Any) -> None:
    """Repeats each sample until the next one, as a driver does."""
    last = np.maximum.accumulate(np.where(column["time_us"] > 0, np.arange(len(column)), -1))
    known = last >= 0
    column[known] = column[last[known]]


def freeze(column: Any, from_tick: int, fields: tuple[str, ...]) -> None:
    """A stuck sensor: new time stamps, old values."""
    for name in fields:
        column[name][from_tick:] = column[name][from_tick]


def silence(column: Any, from_tick: int, to_tick: int | None = None) -> None:
    """A sensor that is off: the last sample stays."""
    column[from_tick:to_tick] = column[from_tick]


def stacked(flights: list[Flight]) -> Any:
    """The samples of several flights of equal length, one row each."""
    rows = np.empty((len(flights), len(flights[0].samples)), dtype=SAMPLES)
    for row, flight in zip(rows, flights, strict=True):
        row[:] = flight.samples
    return rows
