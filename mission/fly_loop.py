"""A flight of `honeyguide fly`, from its first frame to its run folder: progress, texts, summary, logs, picture."""

import gc
import json
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from rich.console import Console
from rich.live import Live
from rich.table import Table

from common.files import write_to_nowhere, write_whole
from mission.client import Running
from mission.console.progress_line import TABLE_PERIOD_S, Progress
from mission.console.terminal import LINE_PERIOD_S, print_line
from mission.flight import Flight
from mission.flight_settings import FlightOptions
from mission.log.flight_plots import plot_flight
from mission.log.flight_recorder import History
from mission.log.flight_summary import Summary, curved_items, planned_path, summarise
from mission.plan.plan_file import Plan
from mission.run_folder import OwnFiles
from mission.script import fly_plan
from mission.view.replay_file import keep_for_replay

if TYPE_CHECKING:
    from mission.view.page import PageServer


def fly_to_the_end(
    flight: Flight,
    plan: Plan | None,
    options: FlightOptions,
    speed: float | None,
    page: "PageServer | None",
    folder: Path,
    console: Console,
) -> int:
    """Flies the plan, or waits for ground stations; writes the run folder and returns the exit code."""
    path_ned = [] if plan is None else planned_path(plan, flight.config.home)
    running = None if plan is None else flight.drone.start(fly_plan(flight.drone, plan))
    way_ned = [point for _, point in path_ned]
    keep_for_replay(flight, way_ned)
    watchers: list[Callable[[], None]] = []
    if page is not None:
        from mission.view.live import LiveView

        view = LiveView(flight, page, speed=speed, path_ned=way_ned)
        watchers.append(view.frame)
    advance(flight, _end(options, speed, running), speed, watchers, Progress(flight, running), console)
    if page is not None:
        view.end(f"flight ended: logs in {folder}")
    history = flight.close()  # before what takes long: who is to stop may be killed soon
    files = OwnFiles(folder, console)
    exit_code = _finish(flight, history, running, plan, path_ned, folder, files, console)
    if page is not None:
        view.close()
    return exit_code


def _end(options: FlightOptions, speed: float | None, running: Running | None) -> Callable[[Flight], bool]:
    """What is asked after each frame: whether the flight is over."""
    end_us = int(options.seconds * 1e6) if options.seconds is not None else None
    ends_with_script = options.once or (speed is None and end_us is None)

    def is_over(flight: Flight) -> bool:
        if end_us is not None and flight.time_us >= end_us:
            return True
        return ends_with_script and (running is None or running.is_done)

    return is_over


def advance(
    flight: Flight,
    is_over: Callable[[Flight], bool],
    speed: float | None,
    watchers: Sequence[Callable[[], None]],
    progress: Progress,
    console: Console,
) -> None:
    """Advances the flight until it is over or the user stops it, and shows a line of figures.

    Args:
        flight: what flies.
        is_over: asked after each frame.
        speed: simulated seconds per second; None: as fast as possible.
        watchers: called after each frame.
        progress: the line.
        console: where it is shown.
    """
    gc.freeze()  # what is loaded by now stays: to look through it for garbage takes 0.2 s, in the middle of a flight
    try:
        with _signals_interrupt(), Live(console=console, transient=True, auto_refresh=False) as live:
            told = 0

            def on_frame(_: Flight) -> None:
                nonlocal told
                for watch in watchers:
                    watch()
                for text in flight.texts.since(told):
                    print_line(console, str(text))
                told = flight.texts.count
                if console.is_terminal and progress.is_due(TABLE_PERIOD_S):
                    live.update(progress.table(), refresh=True)
                elif not console.is_terminal and progress.is_due(LINE_PERIOD_S):
                    print_line(console, progress.line())

            flight.run(is_over, speed=speed, on_frame=on_frame)
    except KeyboardInterrupt:
        console.print("stopped by the user")
    except SystemExit:  # rich's: who read what is printed has gone, which is as a terminal that was closed
        write_to_nowhere(1)


@contextmanager
def _signals_interrupt() -> Iterator[None]:
    """Inside, SIGTERM is what Ctrl-C is, and so is SIGHUP: a terminal that was closed takes no more lines."""

    def interrupt(*_: object) -> NoReturn:
        raise KeyboardInterrupt

    def hang_up(*_: object) -> NoReturn:
        write_to_nowhere(1, 2)
        raise KeyboardInterrupt

    before = {
        number: signal.signal(number, handler)
        for number, handler in ((signal.SIGTERM, interrupt), (signal.SIGHUP, hang_up))
    }
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _finish(
    flight: Flight,
    history: History,
    running: Running | None,
    plan: Plan | None,
    path_ned: list[tuple[int, Any]],
    folder: Path,
    files: OwnFiles,
    console: Console,
) -> int:
    """Writes the rest of the run folder and prints the summary; returns the exit code."""
    for trouble in flight.troubles.take():
        print_line(console, trouble)
    if len(history.time_us) == 0:
        console.print("the flight ended before its first frame")
        return 0 if running is None else 1
    summary = summarise(flight, history, running, path_ned, curved_items(plan) if plan else frozenset())
    with files.writing("summary.json") as path:
        write_whole(path, (json.dumps(summary.as_json(), indent=2) + "\n").encode())
    title = f"{flight.airframe.name}, wind {flight.config.wind_m_s:g} m/s, seed {flight.config.seed}: {summary.result}"
    with files.writing("flight.png") as path:
        plot_flight(history, flight.world, path_ned, title, path)
    if summary.armed_s > 0.0:
        console.print(_summary_table(summary))
    else:
        print_line(console, f"result: {summary.result}\nsimulated: {summary.simulated_s:.1f} s, never armed")
    print_line(console, f"{'what could be written' if files.missing else 'logs, summary and picture'}: {folder}")
    return 0 if (summary.is_success or running is None) and not files.missing else 1


def _summary_table(summary: Summary) -> Table:
    table = Table("figure", "value", title="flight", title_justify="left")
    rows = [
        ("result", summary.result),
        ("simulated / armed", f"{summary.simulated_s:.1f} s / {summary.armed_s:.1f} s"),
        ("power-on to ready", f"{summary.ready_s:.1f} s"),
        ("cross-track, 95 %", f"{summary.cross_track_p95_m:.2f} m"),
        (
            "landing error, true / by estimate",
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
