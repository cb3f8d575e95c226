"""Plots of a flight: the track from above and from the side, and the estimator's errors over time."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt

from mission.log.euler_angles import euler_rad
from mission.log.flight_recorder import History
from sim.world.world import WorldMap

mpl.use("Agg")
from matplotlib.axes import Axes
from matplotlib.figure import Figure

Rows = npt.NDArray[Any]
TRUE_COLOUR = "#0b7285"
ESTIMATE_COLOUR = "#e8590c"
AIRSPEED_COLOUR = "#862e9c"
PLAN_COLOUR = "#495057"
DRAWN_MAX = 60_000  # frames, 20 minutes: more are no more to see, and take memory


def plot_flight(
    history: History,
    world: WorldMap,
    path_ned: Sequence[tuple[int, Rows]],
    title: str,
    target: Path,
    drives: bool = False,
) -> None:
    """Writes the plots of a flight as PNG; of a long one every few frames are drawn.

    Of what drives the speed is shown, not the height, which is the ground's.
    """
    every = -(-len(history.time_us) // DRAWN_MAX)
    history = History(*(getattr(history, name)[::every] for name in History.__dataclass_fields__))
    figure = Figure(figsize=(12, 8), layout="constrained")
    figure.suptitle(title)
    grid = figure.add_gridspec(3, 2, width_ratios=(1.15, 1.0))
    _track(figure.add_subplot(grid[:2, 0]), history, world, path_ned)
    beneath = figure.add_subplot(grid[2, 0])
    if drives:
        _speed(beneath, history)
    elif np.isfinite(history.airspeed).any():
        _profile(beneath, history, world)
        _airspeed(beneath.twinx(), history)
    else:
        _profile(beneath, history, world)
    time_s = history.time_us * 1e-6
    pos_error = history.pos_ned_est.astype(float) - history.pos_ned_true
    vel_error = history.vel_ned_est.astype(float) - history.vel_ned_true
    _errors(figure.add_subplot(grid[0, 1]), time_s, pos_error, "position error [m]")
    _errors(figure.add_subplot(grid[1, 1]), time_s, vel_error, "velocity error [m/s]")
    attitude = figure.add_subplot(grid[2, 1])
    _errors(attitude, time_s, _euler_error_deg(history), "attitude error [deg]", ("roll", "pitch", "yaw"))
    attitude.set_xlabel("time [s]")
    figure.savefig(target, dpi=90)


def _track(axes: Axes, history: History, world: WorldMap, path_ned: Sequence[tuple[int, Rows]]) -> None:
    north, east = history.pos_ned_true[:, 0], history.pos_ned_true[:, 1]
    reach = max(30.0, float(np.abs(history.pos_ned_true[:, :2]).max()) + 15.0)
    line = np.linspace(-reach, reach, 160)
    heights = world.height(*np.meshgrid(line, line, indexing="ij"))
    shade = axes.pcolormesh(line, line, heights, cmap="Greens_r", alpha=0.55, shading="auto")
    axes.figure.colorbar(shade, ax=axes, label="ground [m]", shrink=0.8)
    trees = world.trees
    near = (np.abs(trees["north"]) < reach) & (np.abs(trees["east"]) < reach)
    axes.scatter(trees["east"][near], trees["north"][near], s=6, c="#2b8a3e", alpha=0.5, label="trees")
    axes.plot(east, north, color=TRUE_COLOUR, lw=3.0, alpha=0.6, label="true")
    axes.plot(history.pos_ned_est[:, 1], history.pos_ned_est[:, 0], color=ESTIMATE_COLOUR, lw=1, label="estimate")
    if len(path_ned) > 1:
        points = np.array([point for _, point in path_ned])
        axes.plot(points[:, 1], points[:, 0], "--", color=PLAN_COLOUR, lw=1.2, marker=".", label="plan")
        for seq, point in path_ned[1:]:  # the first is where it takes off
            axes.annotate(str(seq + 1), (point[1], point[0]), xytext=(4, 4), textcoords="offset points", fontsize=8)
    axes.set(xlabel="east [m]", ylabel="north [m]", aspect="equal", xlim=(-reach, reach), ylim=(-reach, reach))
    _legend_above(axes)


def _profile(axes: Axes, history: History, world: WorldMap) -> None:
    time_s = history.time_us * 1e-6
    axes.plot(time_s, -history.pos_ned_est[:, 2], color=ESTIMATE_COLOUR, lw=1, label="estimate")
    axes.plot(time_s, -history.pos_ned_true[:, 2], color=TRUE_COLOUR, lw=1.5, label="true")
    ground = world.height(history.pos_ned_true[:, 0].astype(float), history.pos_ned_true[:, 1].astype(float))
    axes.fill_between(time_s, ground, min(0.0, float(ground.min())) - 1.0, color="#2b8a3e", alpha=0.4, label="ground")
    axes.set(xlabel="time [s]", ylabel="height above home [m]")
    _legend_above(axes)


def _speed(axes: Axes, history: History) -> None:
    time_s = history.time_us * 1e-6
    for rows, colour, width, name in (
        (history.vel_ned_true, TRUE_COLOUR, 1.5, "true"),
        (history.vel_ned_est, ESTIMATE_COLOUR, 1.0, "estimate"),
    ):
        axes.plot(time_s, np.linalg.norm(rows, axis=1), color=colour, lw=width, label=name)
    axes.set(xlabel="time [s]", ylabel="speed [m/s]", ylim=(0.0, None))
    _legend_above(axes)


def _airspeed(axes: Axes, history: History) -> None:
    """Over the height: where there is none, the line is broken."""
    axes.plot(history.time_us * 1e-6, history.airspeed, color=AIRSPEED_COLOUR, lw=0.8, label="airspeed")
    axes.set(ylabel="airspeed [m/s]", ylim=(0.0, None))
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2, fontsize=8, frameon=False)


def _errors(
    axes: Axes, time_s: Rows, errors: Rows, label: str, names: Sequence[str] = ("north", "east", "down")
) -> None:
    for name, column in zip(names, errors.T, strict=True):
        axes.plot(time_s, column, lw=0.9, label=name)
    axes.axhline(0.0, color="black", lw=0.5)
    axes.set_ylabel(label)
    _legend_above(axes)


def _legend_above(axes: Axes) -> None:
    """Beside the curves, not over them."""
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2, fontsize=8, ncols=4, frameon=False)


def _euler_error_deg(history: History) -> Rows:
    estimated, true = euler_rad(history.q_est), euler_rad(history.q_true)
    return np.degrees((estimated - true + np.pi) % (2.0 * np.pi) - np.pi)
