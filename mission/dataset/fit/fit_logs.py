"""`honeyguide dataset fit`: the simulator's numbers of an airframe, fitted to logs of its flights.

The numbers are fitted to four segments of five. Those of a group, forces or turns, are kept if with them the fifths,
which no fit has seen, are predicted better than with the airframe that it began with; else nothing is written of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from common.airframe import AirframeError
from mission.console.terminal import print_line
from mission.dataset.fit.airframe_file import write_airframe
from mission.dataset.fit.flight_segments import flight_segments
from mission.dataset.fit.report import Prediction, draw, print_report
from mission.dataset.source_logs import DAMAGED, damaged, logs_at, refuse_twice
from policies.datasets.episodes import DatasetError
from sim.bodies.fit.least_squares import Fit, errors_of, fit_airframe, fit_flights
from sim.bodies.fit.numbers import NUMBERS, Fittable, FittedNumber, fittable, motor_count
from sim.bodies.fit.segments import Segments, joined

_LEAST_SEGMENTS = 20
_HELD_OUT = 5  # each fifth segment
_RATES_LEAST_HZ = 25.0  # of motor commands: seldomer, what turns a vehicle within 0.2 s is not in the log


@dataclass(frozen=True, slots=True)
class FitOptions:
    """What the command is given."""

    sources: tuple[Path, ...]
    airframe: str
    output: Path
    mass_kg: float | None
    image: Path | None


def fit_logs(options: FitOptions, console: Console) -> None:
    """Fits, prints and writes.

    Raises:
        DatasetError: logs that cannot be used, an airframe that cannot be fitted, numbers that predict no better than
            those it began with, or a file that cannot be written.
    """
    for file in (options.output, options.image):
        if file is not None and not file.absolute().parent.is_dir():
            raise DatasetError(f"{file}: cannot be written: its folder does not exist")
    start = _start(options)
    logs = [log for source in options.sources for log in logs_at(source)]
    refuse_twice(logs)
    for log in damaged(logs):
        print_line(console, f"{log}: {DAMAGED}")
    segments, motor_hz = _segments(logs, start, console)
    is_held = np.concatenate([_held_out(int(count)) for count in np.bincount(segments.log)])
    learnt, held = segments.only(~is_held), segments.only(is_held)
    asked = [number for number in NUMBERS if not number.by_rates or motor_hz >= _RATES_LEAST_HZ]
    if len(asked) < len(NUMBERS):
        hertz = f"motor commands were logged at {motor_hz:.0f} Hz, and need {_RATES_LEAST_HZ:.0f}"
        print_line(console, f"lag and inertias stay: {hertz}")
    before = _predicted(start, fit_flights(start, learnt), held)
    fit = fit_airframe(start, learnt, asked)
    fit, after = _kept(start, fit, learnt, held, before, console)
    if not fit.stds:
        vel = f"{before.rms[0]:.2f} m/s"
        raise DatasetError(f"{logs[0]}: no number of '{start.name}' is told by these flights, held-out error {vel}")
    origin = f"{len(learnt)} s of flight in {', '.join(log.name for log in logs[:3])}{', ...' if len(logs) > 3 else ''}"
    write_airframe(options.airframe, fit, options.output, origin, options.mass_kg)
    print_report(console, start, fit, held, before, after)
    print_line(console, f"{options.output}: fitted to {len(learnt)} segments of 1 s, judged on {len(held)} others")
    if options.image is not None:
        draw(held, before, after, options.image)
        print_line(console, f"predicted and logged: {options.image}")


def _held_out(count: int) -> NDArray[np.bool_]:
    """Which segments of a flight are not learnt from: each fifth, so that all are learnt of one of four."""
    held: NDArray[np.bool_] = np.arange(count) % _HELD_OUT == _HELD_OUT - 1
    return held


def _start(options: FitOptions) -> Fittable:
    try:
        airframe = fittable(options.airframe)
    except AirframeError as error:
        raise DatasetError(str(error)) from error
    if options.mass_kg is None:
        return airframe
    return airframe.model_copy(update={"body": airframe.body.model_copy(update={"mass_kg": options.mass_kg})})


def _segments(logs: Sequence[Path], airframe: Fittable, console: Console) -> tuple[Segments, float]:
    """The segments of all logs, and how often the motors' commands were logged where it was seldomest."""
    parts: list[Segments] = []
    motor_hz = float("inf")
    battery = airframe.battery
    for log in logs:
        if log.suffix == ".tlog":
            raise DatasetError(f"{log}: a telemetry log holds no motor commands, which a fit needs")
        found = flight_segments(log, motor_count(airframe), battery.cells, battery.full_cell_v)
        for note in found.notes:
            print_line(console, note)
        if len(found.segments):
            parts.append(found.segments)
            motor_hz = min(motor_hz, found.motor_hz)
    count = sum(len(part) for part in parts)
    if count < _LEAST_SEGMENTS:
        raise DatasetError(f"{logs[0]}: {count} whole seconds in the air, of {_LEAST_SEGMENTS} that a fit needs")
    return joined(parts), motor_hz


def _predicted(airframe: Fittable, fit: Fit, held: Segments) -> Prediction:
    return Prediction(errors_of(airframe, held, fit.flights))


def _kept(
    start: Fittable, fit: Fit, learnt: Segments, held: Segments, before: Prediction, console: Console
) -> tuple[Fit, Prediction]:
    """A fit without the group of numbers that predicts held-out segments no better, and what it predicts."""
    after = _predicted(fit.airframe, fit, held)
    for by_rates, what, unit in ((False, "thrust and drags", "m/s"), (True, "lag and inertias", "rad/s")):
        k = int(by_rates)
        mine: list[FittedNumber] = [number for number in fit.stds if number.by_rates == by_rates]
        if mine and after.rms[k] >= before.rms[k]:
            figures = f"{after.rms[k]:.3f} {unit} after {before.rms[k]:.3f}"
            print_line(console, f"{what} stay: with fitted ones held-out segments are predicted no better, {figures}")
            others = [number for number in fit.stds if number.by_rates != by_rates]
            left = dict.fromkeys(mine, float("inf")) | fit.unknown
            fit = replace(fit_airframe(start, learnt, others), unknown=left)
            after = _predicted(fit.airframe, fit, held)
    return fit, after
