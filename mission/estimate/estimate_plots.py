"""Plots of a replayed estimate: where it went, and how well the measurements agreed with it."""

from io import BytesIO
from math import nan

import matplotlib as mpl
import numpy as np

from autopilot.ports import POSITION_VALID
from mission.estimate.estimate_difference import track_pos_ned
from mission.estimate.estimate_noise import FoundNoise
from mission.estimate.estimate_run import Replay, time_s
from mission.estimate.sensor_log import Rows, SensorLog
from mission.log.euler_angles import euler_rad

mpl.use("Agg")
from matplotlib.axes import Axes
from matplotlib.figure import Figure

ESTIMATE_COLOUR = "#e8590c"
OTHER_COLOUR = "#0b7285"
GNSS_COLOUR = "#adb5bd"
MAX_POINTS = 3000  # per line: more than the image has columns
DPI = 80
GAP_US, GAP_STEPS = 200_000, 5.0  # a line ends at a gap as long as that and of so many steps
MAP_MARGIN = 0.15  # of the extent of the estimate
HALF_TURN_DEG = 180.0

PANELS = [  # source, component, title, unit
    ("gnss_pos", 0, "GNSS north", "m"),
    ("gnss_pos", 1, "GNSS east", "m"),
    ("gnss_height", 0, "GNSS down", "m"),
    ("gnss_vel", 0, "GNSS velocity north", "m/s"),
    ("gnss_vel", 1, "GNSS velocity east", "m/s"),
    ("gnss_vel", 2, "GNSS velocity down", "m/s"),
    ("mag", 0, "magnetometer x", "gauss"),
    ("mag", 1, "magnetometer y", "gauss"),
    ("mag", 2, "magnetometer z", "gauss"),
    ("baro", 0, "barometer, down", "m"),
    ("range", 0, "range finder", "m"),
    ("drag", 0, "drag x", "m/s²"),
]


def plot_estimate(log: SensorLog, replay: Replay) -> bytes:
    """PNG of track, height, attitude, velocity and biases; the log's own answer beside ours where it holds one."""
    figure = Figure(figsize=(13, 10), layout="constrained")
    figure.suptitle(f"{log.recording.path.name}: estimate")
    axes = figure.subplots(3, 2)
    estimate = _sparse(replay.estimate)
    seconds = time_s(log, estimate["time_us"])
    _track(axes[0, 0], log, estimate)
    _height(axes[0, 1], log, estimate)
    _attitude(axes[1, 0], log, estimate)
    _lines(axes[1, 1], seconds, estimate["vel_ned"], "velocity [m/s]", ("north", "east", "down"))
    _lines(axes[2, 0], seconds, np.degrees(estimate["gyro_bias_frd"]), "gyro bias [deg/s]")
    _lines(axes[2, 1], seconds, estimate["accel_bias_frd"], "accelerometer bias [m/s²]")
    for panel in axes[2]:
        panel.set_xlabel("time [s]")
    return _png(figure)


def plot_innovations(log: SensorLog, replay: Replay, noise: dict[str, FoundNoise]) -> bytes:
    """PNG of the innovations of every source that was judged, with their bands of two standard deviations.

    The bands are those of the noise found from the log, where it was.
    """
    panels = [panel for panel in PANELS if len(replay.events[panel[0]])]
    rows = max(1, -(-len(panels) // 3))
    figure = Figure(figsize=(13, 2.6 * rows + 0.6), layout="constrained")
    figure.suptitle(f"{log.recording.path.name}: innovations, band of 2 sigma, rejected samples in red")
    axes = figure.subplots(rows, 3, squeeze=False, sharex=True).ravel()
    for panel, (source, component, title, unit) in zip(axes, panels, strict=False):
        events = replay.events[source]
        rejected = events[~(events["is_fused"] | events["is_reset"])]
        shown = _sparse(events)
        seconds = time_s(log, shown["time_us"])
        scale = noise[source].scale if source in noise else 1.0
        band = 2.0 * scale * np.sqrt(shown["innov_var"][:, component])
        steps_us = np.diff(shown["time_us"], append=shown["time_us"][-1])
        is_joined = steps_us <= max(GAP_US, GAP_STEPS * float(np.median(steps_us)))
        panel.fill_between(seconds, -band, band, where=is_joined, color=OTHER_COLOUR, alpha=0.2, lw=0.0)
        panel.plot(seconds, shown["innov"][:, component], ".", ms=2, color=OTHER_COLOUR)
        panel.plot(time_s(log, rejected["time_us"]), rejected["innov"][:, component], ".", ms=3, color="#c92a2a")
        reach = 1.2 * max(float(np.percentile(np.abs(shown["innov"][:, component]), 99.0)), float(np.median(band)))
        panel.set(title=title, ylabel=f"[{unit}]", ylim=(-reach, reach))
    for panel in axes[len(panels) :]:
        panel.set_axis_off()
    for panel in axes[max(0, len(panels) - 3) : len(panels)]:
        panel.set_xlabel("time [s]")
        panel.tick_params(labelbottom=True)
    return _png(figure)


def _track(axes: Axes, log: SensorLog, estimate: Rows) -> None:
    gnss = _sparse(log.gnss)
    axes.plot(gnss["pos_ned"][:, 1], gnss["pos_ned"][:, 0], ".", ms=2, color=GNSS_COLOUR, label="GNSS")
    for track in log.recording.tracks[:1]:
        _, pos_ned = _broken(_sparse(track.pos_time_us), _sparse(track_pos_ned(track, log.origin)))
        axes.plot(pos_ned[:, 1], pos_ned[:, 0], color=OTHER_COLOUR, lw=1.5, label=track.name)
    known_ned = estimate["pos_ned"].astype(float)
    is_known = (estimate["flags"] & POSITION_VALID) != 0
    if is_known.any():
        known_ned[~is_known] = nan  # before the first fix it stands at the origin
    _, pos_ned = _broken(estimate["time_us"], known_ned)
    axes.plot(pos_ned[:, 1], pos_ned[:, 0], color=ESTIMATE_COLOUR, lw=1, label="estimate")
    axes.set(xlabel="east [m]", ylabel="north [m]")
    low, high = np.nanmin(known_ned, axis=0), np.nanmax(known_ned, axis=0)
    middle, reach = 0.5 * (low + high), (0.5 + MAP_MARGIN) * max(float((high - low)[:2].max()), 1.0)
    axes.set(xlim=(middle[1] - reach, middle[1] + reach), ylim=(middle[0] - reach, middle[0] + reach))
    axes.set_aspect("equal")
    _legend(axes)


def _height(axes: Axes, log: SensorLog, estimate: Rows) -> None:
    """Heights of others are shifted to ours by the median of their difference: their references differ."""
    height = -estimate["pos_ned"][:, 2].astype(float)
    gnss = _sparse(log.gnss)
    others = [("GNSS", gnss["time_us"], -gnss["pos_ned"][:, 2].astype(float))]
    others += [
        (track.name, _sparse(track.pos_time_us), -_sparse(track_pos_ned(track, log.origin))[:, 2])
        for track in log.recording.tracks[:1]
    ]
    for name, times, other in others:
        shift = float(np.median(np.interp(times, estimate["time_us"], height) - other)) if len(times) else 0.0
        label = f"{name} {shift:+.2f} m"
        if name == "GNSS":
            axes.plot(time_s(log, times), other + shift, ".", ms=2, color=GNSS_COLOUR, label=label)
        else:
            line_us, line = _broken(times, other + shift)
            axes.plot(time_s(log, line_us), line, color=OTHER_COLOUR, lw=1.5, label=label)
    times, height = _broken(estimate["time_us"], height)
    axes.plot(time_s(log, times), height, color=ESTIMATE_COLOUR, lw=1, label="estimate")
    low, high = float(np.nanmin(height)), float(np.nanmax(height))
    margin = MAP_MARGIN * max(high - low, 1.0)
    axes.set(xlabel="time [s]", ylabel="height above the origin [m]", ylim=(low - margin, high + margin))
    _legend(axes)


def _attitude(axes: Axes, log: SensorLog, estimate: Rows) -> None:
    """Roll, pitch and yaw; those of the log's own answer as broad pale lines below."""
    for track in log.recording.tracks[:1]:
        times, q = _sparse(track.q_time_us), _sparse(track.q_ned_from_frd)
        _angles(axes, time_s(log, times), np.degrees(euler_rad(q)), ("", "", ""), width=3.0, alpha=0.35)
        axes.plot([], [], color="grey", lw=3.0, alpha=0.35, label=track.name)
    euler = np.degrees(euler_rad(estimate["q_ned_from_frd"]))
    _angles(axes, time_s(log, estimate["time_us"]), euler, ("roll", "pitch", "yaw"), width=0.9)
    axes.axhline(0.0, color="black", lw=0.5)
    axes.set_ylabel("attitude [deg]")
    _legend(axes)


def _angles(
    axes: Axes, seconds: Rows, angles: Rows, names: tuple[str, ...], *, width: float, alpha: float = 1.0
) -> None:
    """Three angles, whose lines end at gaps and where an angle turns over at 180 deg."""
    for colour, name, column in zip(("C0", "C1", "C2"), names, angles.T, strict=True):
        turned = np.flatnonzero(np.abs(np.diff(column)) > HALF_TURN_DEG) + 1
        times, values = _broken(seconds * 1e6, column, turned)
        axes.plot(times * 1e-6, values, color=colour, label=name, lw=width, alpha=alpha)


def _lines(axes: Axes, seconds: Rows, columns: Rows, label: str, names: tuple[str, ...] = ("x", "y", "z")) -> None:
    times, broken = _broken(seconds * 1e6, columns)
    for name, column in zip(names, broken.T, strict=True):
        axes.plot(times * 1e-6, column, lw=0.9, label=name)
    axes.axhline(0.0, color="black", lw=0.5)
    axes.set_ylabel(label)
    _legend(axes)


def _broken(time_us: Rows, values: Rows, ends: Rows | None = None) -> tuple[Rows, Rows]:
    """Times and values with a NaN in each gap and before each of the rows `ends`: lines end there."""
    times, steps = np.asarray(time_us, dtype=float), np.diff(time_us)
    is_end = np.zeros(len(times), dtype=bool)
    if len(steps):
        is_end[1:] = steps > max(GAP_US, GAP_STEPS * float(np.median(steps)))
    if ends is not None:
        is_end[ends] = True
    before = np.flatnonzero(is_end)
    return np.insert(times, before, times[before]), np.insert(np.asarray(values, dtype=float), before, nan, axis=0)


def _legend(axes: Axes) -> None:
    """Above the panel, where no curve is."""
    axes.legend(fontsize=8, ncols=4, loc="lower left", bbox_to_anchor=(0.0, 1.0), frameon=False, borderpad=0.1)


def _sparse(rows: Rows) -> Rows:
    return rows[:: max(1, -(-len(rows) // MAX_POINTS))]


def _png(figure: Figure) -> bytes:
    stream = BytesIO()
    figure.savefig(stream, dpi=DPI, format="png")
    return stream.getvalue()
