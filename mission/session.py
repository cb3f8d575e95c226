"""`honeyguide fly`: options to a flight, live progress, summary table and run folder."""

import json
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, NoReturn

from rich.console import Console
from rich.live import Live
from rich.table import Table

from common.airframe import AirframeError, load_airframe
from common.clock import wall_date_text
from common.files import write_whole
from common.geodesy import GeoPoint
from common.params import ParameterError
from common.state_folder import StateFolder
from mission.client import Running
from mission.connections import open_images, open_links, open_page, open_stream, signing_config
from mission.flight import Flight, flight_parameters
from mission.net_guard import LOOPBACK
from mission.options import FlightOptions, UserError, check_end, flight_config, speed_of
from mission.plan import DEFAULT_PLAN, Plan, PlanError, moved_plan, read_plan
from mission.plots import plot_flight
from mission.progress import Progress
from mission.script import fly_plan
from mission.state import StateError, keep_home, open_state
from mission.summary import Summary, curved_items, planned_path, summarise
from mission.view.recording import Recorder

WIND_EXPECTED_M_S = 13.0  # measured: an x500 finishes the default mission for 12 of 12 seeds; at 14 m/s for 10


def fly_session(options: FlightOptions) -> int:
    """Flies as asked and returns the exit code.

    Raises:
        UserError: an option, file, port or folder is wrong; nothing has been written.
    """
    speed = speed_of(options.speed)
    check_end(options, speed)
    if options.state is None:
        return _fly(options, speed, None)
    try:
        state = open_state(options.state)
    except StateError as error:
        raise UserError(str(error)) from error
    with closing(state):
        return _fly(options, speed, state)


def _fly(options: FlightOptions, speed: float | None, state: StateFolder | None) -> int:
    console = Console()
    config = flight_config(options, state)
    plan = None if options.is_idle else _plan(options.plan, config.home)
    try:
        flight_parameters(config, load_airframe(config.airframe))
    except (AirframeError, ParameterError) as error:
        raise UserError(str(error)) from error
    signing = signing_config(options, speed, state)
    links = [] if speed is None else open_links(options, speed)
    stream = open_stream(options.stream_port)
    images = None if speed is None else open_images(options)
    page = open_page(options.view_port) if options.has_view else None
    folder = new_folder(options.run_folder)
    if state is not None and options.home is not None:
        keep_home(state, config.home)
    with console.status("building the world and loading the kernels (the first time they are compiled: 20 s)"):
        flight = Flight(
            config,
            links=links,
            folder=folder,
            signing=signing,
            state=state,
            stream=stream,
            has_camera_thread=speed is not None,
        )
    if images is not None and flight.onboard is not None:
        flight.onboard.add_sink(images.publish)
        flight.computers.append(images)
    if state is not None:
        for problem in (*state.problems, *(flight.persistence.problems if flight.persistence else ())):
            print_line(console, problem)
    path_ned = [] if plan is None else planned_path(plan, config.home)
    running = None if plan is None else flight.drone.start(fly_plan(flight.drone, plan))
    way_ned = [point for _, point in path_ned]
    recorder = Recorder(flight, way_ned)
    watchers = [recorder.frame]
    if page is not None:
        from mission.view.live import LiveView

        view = LiveView(flight, page, speed=speed, path_ned=way_ned)
        watchers.append(view.frame)
    _print_start(options, speed, folder, console)
    if page is not None:
        print_line(console, f"live page: {page.url}")
    advance(flight, _end(options, speed, running), speed, watchers, Progress(flight, running), console)
    if page is not None:
        view.close()
    if images is not None:
        images.close()
    recorder.recording().save(folder)
    return _finish(flight, running, plan, path_ned, folder, console)


def _plan(path: Path | None, home: GeoPoint) -> Plan:
    """The user's plan as it is, or the default one at the vehicle's home."""
    try:
        return moved_plan(read_plan(DEFAULT_PLAN), home) if path is None else read_plan(path)
    except PlanError as error:
        raise UserError(str(error)) from error


def new_folder(folder: Path | None) -> Path:
    """Makes the run folder; one that already holds a flight is left alone."""
    if folder is None:
        stem = Path("runs") / wall_date_text()
        folder = next(path for path in _candidates(stem) if not path.exists())
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any((folder / name).exists() for name in ("flight.ulg", "flight.tlog", "summary.json")):
            raise UserError(f"{folder}: already holds a flight; name another --run-folder")
        write_whole(folder / "flight.tlog", b"")
        (folder / "flight.tlog").unlink()
    except OSError as error:
        raise UserError(f"{folder}: cannot write there: {error.strerror}") from error
    return folder


def _candidates(stem: Path) -> Any:
    yield stem
    number = 2
    while True:
        yield stem.with_name(f"{stem.name}-{number}")
        number += 1


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
    try:
        with _sigterm_interrupts(), Live(console=console, transient=True, auto_refresh=False) as live:

            def on_frame(_: Flight) -> None:
                for watch in watchers:
                    watch()
                if progress.is_due():
                    live.update(progress.table(), refresh=True)

            flight.run(is_over, speed=speed, on_frame=on_frame)
    except KeyboardInterrupt:
        console.print("stopped by the user")


@contextmanager
def _sigterm_interrupts() -> Iterator[None]:
    """Inside, SIGTERM is what Ctrl-C is."""

    def interrupt(*_: object) -> NoReturn:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _print_start(options: FlightOptions, speed: float | None, folder: Path, console: Console) -> None:
    ports = f"UDP {options.gcs_port} (ground stations), {options.api_port} (offboard API)"
    if options.tcp_port is not None:
        ports += f", TCP {options.tcp_port}"
    where = "lockstep, without network links" if speed is None else ports
    print_line(console, f"flying: {where}; logs in {folder}")
    if options.owner is not None and speed is not None:
        print_line(console, f"pictures for a companion: tcp://{LOOPBACK}:{options.image_port}")
    if options.stream_port:
        print_line(console, f"the camera's picture: http://{LOOPBACK}:{options.stream_port}/")
    if options.wind_m_s > WIND_EXPECTED_M_S:
        print_line(console, f"wind of {options.wind_m_s:g} m/s is more than an x500 can be relied on to fly")


def print_line(console: Console, text: str) -> None:
    """One line however narrow the console is, at once also into a pipe: rich flushes."""
    console.print(text, markup=False, highlight=False, soft_wrap=True)


def _finish(
    flight: Flight,
    running: Running | None,
    plan: Plan | None,
    path_ned: list[tuple[int, Any]],
    folder: Path,
    console: Console,
) -> int:
    """Writes the run folder and prints the summary; returns the exit code."""
    history = flight.close()
    if len(history.time_us) == 0:
        console.print("the flight ended before its first frame")
        return 0 if running is None else 1
    summary = summarise(flight, history, running, path_ned, curved_items(plan) if plan else frozenset())
    write_whole(folder / "summary.json", (json.dumps(summary.as_json(), indent=2) + "\n").encode())
    title = f"{flight.airframe.name}, wind {flight.config.wind_m_s:g} m/s, seed {flight.config.seed}: {summary.result}"
    plot_flight(history, flight.world, path_ned, title, folder / "flight.png")
    if summary.armed_s > 0.0:
        console.print(_summary_table(summary))
    else:
        print_line(console, f"result: {summary.result}\nsimulated: {summary.simulated_s:.1f} s, never armed")
    print_line(console, f"logs, summary and picture: {folder}")
    return 0 if summary.is_success or running is None else 1


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
