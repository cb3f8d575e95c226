"""Vibration: the IMU's spectrum over the flight, how it went with time, and PX4's vibration metric.

In: the fastest samples that the log holds. Out: amplitude spectra [m/s² and deg/s per bin] averaged by Welch's method
(IEEE Trans. Audio Electroacoust. 15, 1967), Hann windows half overlapping; a waterfall of the same windows; the metric.
"""

from dataclasses import dataclass

import numpy as np

from mission.review.curves import Panel, Rows, Section, curves
from mission.review.logged_flight import LoggedFlight, Topic

WINDOW = 512  # samples
LEAST_RATE_HZ = 50.0  # below, a spectrum tells nothing of motors
COLUMNS_MAX = 400  # of the waterfall, in time
HOLLOW_MAX = 8.0  # of the samples that there would be without holes
GAP_PERIODS = 5.0  # a window with such a hole is left out
GOOD_M_S2, BAD_M_S2 = 4.905, 9.81  # PX4's Flight Review: what its plot of the metric colours
METRIC_FORGETS = 0.01  # of PX4's metric, each sample


@dataclass(frozen=True, slots=True)
class Spectrum:
    """One sensor."""

    key: str
    title: str
    unit: str
    freq_hz: Rows  # (n,)
    amplitude: Rows  # (n, 3), root mean square in each bin
    rate_hz: float
    source: str
    times_s: Rows  # of the waterfall's columns
    waterfall_db: Rows  # (columns, n), of all axes together


@dataclass(frozen=True, slots=True)
class Metric:
    """PX4's vibration metric of the accelerometers [m/s²]."""

    time_s: Rows
    values: Rows  # (rows, sensors)
    names: tuple[str, ...]
    is_logged: bool  # False: computed here from samples that were averaged before


def spectra(flight: LoggedFlight) -> tuple[list[Spectrum], list[str]]:
    """Of accelerometer and gyro, and what is missing for them."""
    found, missing = [], []
    for key, title, unit, sources, scale in (
        (
            "accel",
            "Accelerometer",
            "m/s²",
            (("sensor_combined", "accelerometer_m_s2"), ("vehicle_acceleration", "xyz")),
            1.0,
        ),
        (
            "gyro",
            "Gyro",
            "deg/s",
            (("sensor_combined", "gyro_rad"), ("vehicle_angular_velocity", "xyz")),
            np.degrees(1.0),
        ),
    ):
        samples = _fastest(flight, sources, key)
        if samples is None:
            missing.append(f"no {title.lower()} samples fast enough for a spectrum (topic sensor_combined)")
            continue
        topic, columns = samples
        spectrum = _spectrum(key, title, unit, topic, scale * columns)
        if spectrum is None:
            missing.append(f"too few {title.lower()} samples in a row for a spectrum")
        else:
            found.append(spectrum)
    return found, missing


def _fastest(flight: LoggedFlight, sources: tuple[tuple[str, str], ...], key: str) -> tuple[Topic, Rows] | None:
    candidates = [
        (topic, topic.vector(field, 3)) for name, field in sources if (topic := flight.topic(name)) is not None
    ]
    raw = flight.topic(f"sensor_{key}")
    if raw is not None:
        candidates.append((raw, raw.columns("x", "y", "z")))
    found = [(topic, columns) for topic, columns in candidates if columns is not None and len(topic) > WINDOW]
    found = [(topic, columns) for topic, columns in found if _rate_hz(topic.time_s) >= LEAST_RATE_HZ]
    return max(found, key=lambda each: len(each[0]), default=None)


def _rate_hz(time_s: Rows) -> float:
    period_s = float(np.median(np.diff(time_s)))
    return 1.0 / period_s if period_s > 0.0 else 0.0


def _spectrum(key: str, title: str, unit: str, topic: Topic, columns: Rows) -> Spectrum | None:
    time_s, rate_hz = topic.time_s, _rate_hz(topic.time_s)
    is_good = np.isfinite(columns).all(axis=1)
    time_s, columns = time_s[is_good], columns[is_good]
    if len(time_s) < WINDOW or (time_s[-1] - time_s[0]) * rate_hz > HOLLOW_MAX * len(time_s):
        return None
    holes = np.concatenate([[0], np.cumsum(np.diff(time_s) > GAP_PERIODS / rate_hz)])
    even_s = np.arange(time_s[0], time_s[-1], 1.0 / rate_hz)
    even = np.stack([np.interp(even_s, time_s, columns[:, axis]) for axis in range(3)], axis=1)
    hole_at = holes[np.clip(np.searchsorted(time_s, even_s, side="right") - 1, 0, len(holes) - 1)]
    begins = np.arange(0, len(even) - WINDOW + 1, WINDOW // 2)
    begins = begins[hole_at[begins] == hole_at[begins + WINDOW - 1]]
    if not len(begins):
        return None
    power = np.concatenate([_power(even, part) for part in np.array_split(begins, -(-len(begins) // 256))])
    freq_hz = np.fft.rfftfreq(WINDOW, 1.0 / rate_hz)
    times_s, image = _waterfall(even_s[begins] + 0.5 * WINDOW / rate_hz, power.sum(axis=2))
    amplitude = np.sqrt(power.mean(axis=0))
    return Spectrum(key, title, unit, freq_hz[1:], amplitude[1:], rate_hz, topic.name, times_s, image[:, 1:])


def _power(even: Rows, begins: Rows) -> Rows:
    """Mean square in each bin, (windows, bins, axes)."""
    windows = even[begins[:, None] + np.arange(WINDOW)]
    windows = windows - windows.mean(axis=1, keepdims=True)
    hann = np.hanning(WINDOW)[None, :, None]
    transformed = np.fft.rfft(windows * hann, axis=1)
    power: Rows = 2.0 * np.abs(transformed) ** 2 / (WINDOW * np.sum(hann**2))
    return power


def _waterfall(times_s: Rows, power: Rows) -> tuple[Rows, Rows]:
    """Windows, several in one column where there are many, in decibels."""
    group = max(1, -(-len(times_s) // COLUMNS_MAX))
    count = len(times_s) // group
    merged = power[: count * group].reshape(count, group, -1).mean(axis=1)
    decibels: Rows = 10.0 * np.log10(np.maximum(merged, 1e-12))
    return times_s[: count * group].reshape(count, group).mean(axis=1), decibels


def metric(flight: LoggedFlight) -> Metric | None:
    """As PX4 logged it, of each IMU; else computed as PX4 does, from samples that may have been averaged before."""
    logged = [topic for topic in flight.instances("vehicle_imu_status") if "accel_vibration_metric" in topic]
    if logged:
        first = logged[0]
        columns = [np.interp(first.time_s, topic.time_s, topic["accel_vibration_metric"]) for topic in logged]
        names = tuple(f"IMU {k}" for k in range(len(logged)))
        return Metric(first.time_s, np.stack(columns, axis=1), names, is_logged=True)
    topic = flight.topic("sensor_combined")
    accel = None if topic is None else topic.vector("accelerometer_m_s2", 3)
    if topic is None or accel is None or len(topic) < WINDOW:
        return None
    steps = np.linalg.norm(np.diff(np.nan_to_num(accel), axis=0), axis=1)
    return Metric(topic.time_s[1:], _forgetting(steps)[:, None], ("IMU",), is_logged=False)


def _forgetting(values: Rows) -> Rows:
    """Exponential mean, block by block: within one the weights stay far from underflow."""
    block, keep = 512, 1.0 - METRIC_FORGETS
    weights = keep ** -np.arange(1.0, block + 1)
    out, state = np.empty(len(values)), float(values[0])
    for begin in range(0, len(values), block):
        part = values[begin : begin + block]
        weight = weights[: len(part)]
        mean = (state + METRIC_FORGETS * np.cumsum(part * weight)) / weight
        out[begin : begin + len(part)] = mean
        state = float(mean[-1])
    return out


def vibration(flight: LoggedFlight) -> Section:
    """The metric against time; the spectra are drawn beside it."""
    found = metric(flight)
    if found is None:
        return Section(
            "vibration", "Vibration", (), ("no vibration metric (topics vehicle_imu_status, sensor_combined)",)
        )
    lines = curves(found.time_s, found.values, found.names)
    bounds = ((GOOD_M_S2, "high"), (BAD_M_S2, "too high"))
    remark = (
        ""
        if found.is_logged
        else "The metric is computed from sensor_combined, whose samples are averaged: it may be higher."
    )
    panel = Panel("metric", "Vibration metric", "m/s²", tuple(lines), bounds, least_span=5.5, starts_at_zero=True)
    return Section("vibration", "Vibration", (panel,), (), remark)
