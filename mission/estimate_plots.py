"""Pictures of a replayed estimate: where it went, and how well the measurements agreed with it."""

from collections.abc import Callable
from io import BytesIO

import matplotlib as mpl
import numpy as np

from mission.angles import euler_rad
from mission.estimate_run import Replay, time_s
from mission.estimate_summary import track_pos_ned
from mission.sensor_log import Rows, SensorLog

mpl.use("Agg")
from matplotlib.axes import Axes
from matplotlib.figure import Figure

ESTIMATE_COLOUR = "#e8590c"
OTHER_COLOUR = "#0b7285"
GNSS_COLOUR = "#adb5bd"
MAX_POINTS = 3000  # per line: more than the picture has columns
DPI = 80

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
    """PNG of track, height, attitude, velocity and biases."""
    figure = Figure(figsize=(13, 10), layout="constrained")
    figure.suptitle(f"{log.recording.path.name}: estimate")
    axes = figure.subplots(3, 2)
    estimate = _sparse(replay.estimate)
    seconds = time_s(log, estimate["time_us"])
    _track(axes[0, 0], log, estimate)
    _height(axes[0, 1], log, estimate)
    euler = np.degrees(euler_rad(estimate["q_ned_from_frd"]))
    _lines(axes[1, 0], seconds, euler, "attitude [deg]", ("roll", "pitch", "yaw"), ",")
    _lines(axes[1, 1], seconds, estimate["vel_ned"], "velocity [m/s]", ("north", "east", "down"))
    _lines(axes[2, 0], seconds, np.degrees(estimate["gyro_bias_frd"]), "gyro bias [deg/s]")
    _lines(axes[2, 1], seconds, estimate["accel_bias_frd"], "accelerometer bias [m/s²]")
    for panel in axes[2]:
        panel.set_xlabel("time [s]")
    return _png(figure)


def plot_innovations(log: SensorLog, replay: Replay) -> bytes:
    """PNG of the innovations of every source that was judged, with their bands of two standard deviations."""
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
        band = 2.0 * np.sqrt(shown["innov_var"][:, component])
        panel.fill_between(seconds, -band, band, color=OTHER_COLOUR, alpha=0.2, lw=0.0)
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
        pos_ned = _sparse(track_pos_ned(track, log.origin))
        axes.plot(pos_ned[:, 1], pos_ned[:, 0], color=OTHER_COLOUR, lw=1.5, label=track.name)
    axes.plot(estimate["pos_ned"][:, 1], estimate["pos_ned"][:, 0], color=ESTIMATE_COLOUR, lw=1, label="estimate")
    axes.set(xlabel="east [m]", ylabel="north [m]")
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(fontsize=8)


def _height(axes: Axes, log: SensorLog, estimate: Rows) -> None:
    gnss = _sparse(log.gnss)
    axes.plot(time_s(log, gnss["time_us"]), -gnss["pos_ned"][:, 2], ".", ms=2, color=GNSS_COLOUR, label="GNSS")
    for track in log.recording.tracks[:1]:
        height = -_sparse(track_pos_ned(track, log.origin))[:, 2]
        axes.plot(time_s(log, _sparse(track.pos_time_us)), height, color=OTHER_COLOUR, lw=1.5, label=track.name)
    seconds = time_s(log, estimate["time_us"])
    axes.plot(seconds, -estimate["pos_ned"][:, 2], color=ESTIMATE_COLOUR, lw=1, label="estimate")
    axes.set(xlabel="time [s]", ylabel="height above the origin [m]")
    axes.legend(fontsize=8)


def _lines(
    axes: Axes,
    seconds: Rows,
    columns: Rows,
    label: str,
    names: tuple[str, ...] = ("x", "y", "z"),
    marker: str = "",
) -> None:
    """Three lines; a marker instead of a line keeps a wrapping angle from being drawn across the picture."""
    for name, column in zip(names, columns.T, strict=True):
        is_dotted = marker and name == "yaw"
        axes.plot(
            seconds, column, marker="." if is_dotted else "", ms=1.5, ls="" if is_dotted else "-", lw=0.9, label=name
        )
    axes.axhline(0.0, color="black", lw=0.5)
    axes.set_ylabel(label)
    axes.legend(fontsize=8, ncols=3)


def _sparse(rows: Rows) -> Rows:
    return rows[:: max(1, -(-len(rows) // MAX_POINTS))]


def _png(figure: Figure) -> bytes:
    stream = BytesIO()
    figure.savefig(stream, dpi=DPI, format="png")
    return stream.getvalue()


PLOTS: dict[str, Callable[[SensorLog, Replay], bytes]] = {
    "estimate.png": plot_estimate,
    "innovations.png": plot_innovations,
}
