"""A flight of `honeyguide fly`, from its plan to its run folder: summary, logs, picture."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table

from common.files import write_whole
from mission.client import Running
from mission.console.terminal import print_line
from mission.flight_base import FlightBase
from mission.flight_session import FlightSession
from mission.flight_settings import FlightOptions
from mission.log.flight_recorder import History
from mission.log.flight_summary import Summary, curved_items, planned_path, summarise
from mission.plan.plan_file import Plan
from mission.run_folder import OwnFiles
from mission.script import fly_plan

if TYPE_CHECKING:
    from mission.foxglove.outputs import FoxgloveOutputs
    from mission.view.page import PageServer


def fly_to_the_end(
    flight: FlightBase,
    plan: Plan | None,
    options: FlightOptions,
    speed: float | None,
    page: "PageServer | None",
    folder: Path,
    console: Console,
    foxglove: "FoxgloveOutputs | None" = None,
) -> int:
    """Flies the plan, or waits for ground stations; writes the run folder and returns the exit code."""
    path_ned = [] if plan is None else planned_path(plan, flight.config.home, flight.config.start_ne_m)
    running = None if plan is None else flight.drone.start(fly_plan(flight.drone, plan))
    way_ned = [point for _, point in path_ned]
    session = FlightSession(flight, speed, page, folder, console, path_ned=way_ned, foxglove=foxglove)
    history = session.fly(end_of(options, speed, [] if running is None else [running]), running)
    exit_code = _finish(flight, history, running, plan, path_ned, folder, session.files, console)
    session.close()
    return exit_code


def end_of(options: FlightOptions, speed: float | None, running: Sequence[Running]) -> Callable[[Any], bool]:
    """What is asked after each frame: whether the flight, or all of a fleet, is over."""
    end_us = int(options.seconds * 1e6) if options.seconds is not None else None
    ends_with_script = options.once or (speed is None and end_us is None)

    def is_over(flight: Any) -> bool:
        if end_us is not None and flight.time_us >= end_us:
            return True
        return ends_with_script and all(each.is_done for each in running)

    return is_over


def _finish(
    flight: FlightBase,
    history: History,
    running: Running | None,
    plan: Plan | None,
    path_ned: list[tuple[int, Any]],
    folder: Path,
    files: OwnFiles,
    console: Console,
) -> int:
    """Writes the rest of the run folder and prints the summary; returns the exit code."""
    if len(history.time_us) == 0:
        print_line(console, flight.end_reason or "the flight ended before its first frame")
        return 0 if running is None and not flight.end_reason else 1
    summary = write_results(flight, history, running, plan, path_ned, files)
    if summary.armed_s > 0.0:
        console.print(_summary_table(summary, drives=flight.drives))
    else:
        print_line(console, f"result: {summary.result}\nsimulated: {summary.simulated_s:.1f} s, never armed")
    print_line(console, f"{'what could be written' if files.missing else 'logs, summary and picture'}: {folder}")
    return 0 if (summary.is_success or (running is None and not flight.end_reason)) and not files.missing else 1


def write_results(
    flight: FlightBase,
    history: History,
    running: Running | None,
    plan: Plan | None,
    path_ned: list[tuple[int, Any]],
    files: OwnFiles,
) -> Summary:
    """Judges a flight that had a frame; writes its summary and its picture."""
    summary = summarise(flight, history, running, path_ned, curved_items(plan) if plan else frozenset())
    with files.writing("summary.json") as path:
        write_whole(path, (json.dumps(summary.as_json(), indent=2) + "\n").encode())
    title = f"{flight.airframe.name}, wind {flight.config.wind_m_s:g} m/s, seed {flight.config.seed}: {summary.result}"
    with files.writing("flight.png") as path:
        from mission.log.flight_plots import plot_flight  # matplotlib: nobody waits for it before the flight

        plot_flight(history, flight.world, path_ned, title, path, flight.drives)
    return summary


def _summary_table(summary: Summary, *, drives: bool) -> Table:
    table = Table("figure", "value", title="flight", title_justify="left")
    rows = [
        ("result", summary.result),
        ("simulated / armed", f"{summary.simulated_s:.1f} s / {summary.armed_s:.1f} s"),
        ("power-on to ready", f"{summary.ready_s:.1f} s"),
        ("cross-track, 95 %", f"{summary.cross_track_p95_m:.2f} m"),
        (
            f"{'parking' if drives else 'landing'} error, true / by estimate",
            f"{summary.landing_error_true_m:.2f} / {summary.landing_error_est_m:.2f} m",
        ),
        ("estimator error RMS, horizontal axis / vertical", f"{summary.pos_h_rms_m:.2f} / {summary.pos_v_rms_m:.2f} m"),
        ("velocity RMS, worst axis", f"{summary.vel_rms_m_s:.3f} m/s"),
        ("tilt / yaw RMS", f"{summary.tilt_rms_deg:.2f} / {summary.yaw_rms_deg:.2f} deg"),
        ("least clearance", f"{summary.clearance_min_m:.1f} m"),
        ("battery left", f"{100.0 * summary.battery_remaining:.0f} %"),
    ]
    for row in rows:
        table.add_row(*row)
    return table
