"""What a fit came to: tables of numbers and of held-out errors, and an image of what was predicted and logged."""

from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from sim.bodies.fit.least_squares import Errors, Fit
from sim.bodies.fit.numbers import NUMBERS, Fittable, value_of
from sim.bodies.fit.segments import SEGMENT_S, WINDOW_S, Segments


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """What an airframe predicted of held-out segments, by its errors."""

    errors: Errors

    @property
    def rms(self) -> tuple[float, float]:
        """Of velocities [m/s] and rates [rad/s]."""
        return self.errors.rms()


def print_report(
    console: Console, start: Fittable, fit: Fit, held: Segments, before: Prediction, after: Prediction
) -> None:
    """Prints both tables."""
    table = Table("number", "start", "fitted", "±", "what", title="numbers", title_justify="left")
    for number in NUMBERS:
        value = f"{value_of(start, number):.4g}"
        if number in fit.stds:
            std = f"{100 * fit.stds[number]:.1f} %" if number.is_factor else f"{fit.stds[number]:.3f}"
            table.add_row(number.name, value, f"{value_of(fit.airframe, number):.4g}", std, number.meaning)
        else:
            table.add_row(number.name, value, "stays", _why(fit.unknown.get(number)), number.meaning)
    console.print(table)
    unchanged = unchanged_rms(held)
    table = Table("held-out error", "before", "after", "of no change", title_justify="left")
    for k, what in enumerate((f"velocity after {SEGMENT_S:g} s (m/s)", f"rates after {WINDOW_S:g} s (rad/s)")):
        table.add_row(what, f"{before.rms[k]:.3f}", f"{after.rms[k]:.3f}", f"{unchanged[k]:.3f}")
    console.print(table)


def _why(std: float | None) -> str:
    """Why a number stays."""
    if std is None:
        return "not asked"
    return f"{100 * std:.0f} %: not told" if isfinite(std) else "not told"


def unchanged_rms(segments: Segments) -> tuple[float, float]:
    """Errors of who predicts that nothing changes [m/s], [rad/s]."""
    (vel_ned, omega_frd), (vel_begun, omega_begun) = segments.flown, segments.begun
    return Errors(vel_begun - vel_ned, omega_begun - omega_frd).rms()


def draw(held: Segments, before: Prediction, after: Prediction, target: Path) -> None:
    """Of each kind of axis: the change that was predicted over the one that was logged, before and after.

    Raises:
        DatasetError: the file cannot be written.
    """
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    from mission.dataset.show import write_figure

    (vel_ned, omega_frd), (vel_begun, omega_begun) = held.flown, held.begun
    changes = vel_ned - vel_begun, omega_frd - omega_begun
    errors = [(each.errors.vel_ned, each.errors.omega_frd) for each in (before, after)]
    panels = (
        ("velocity, level [m/s]", 0, slice(0, 2)),
        ("velocity, down [m/s]", 0, slice(2, 3)),
        ("roll and pitch rate [rad/s]", 1, slice(0, 2)),
        ("yaw rate [rad/s]", 1, slice(2, 3)),
    )
    figure, areas = plt.subplots(1, len(panels), figsize=(14.0, 3.8), layout="constrained")
    for area, (title, kind, axes) in zip(areas, panels, strict=True):
        logged: NDArray[Any] = changes[kind][..., axes].ravel()
        for error, colour, label in zip(errors, ("#999999", "#0072b2"), ("before", "after"), strict=True):
            area.plot(logged, logged + error[kind][..., axes].ravel(), ".", color=colour, markersize=3, label=label)
        ends = np.array([logged.min(), logged.max()])
        area.plot(ends, ends, color="black", linewidth=0.8)
        area.set_title(f"change of {title}", fontsize=9)
        area.set_xlabel("logged")
        area.set_ylabel("predicted")
    areas[0].legend()
    write_figure(figure, target, 80)
