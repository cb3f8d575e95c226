"""`honeyguide fly`: options to a flight, live progress, summary table and run folder."""

import json
import signal
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from pydantic import ValidationError
from rich.console import Console
from rich.live import Live
from rich.table import Table

from autopilot.mavlink.links import LinkError, LinkRole, LinkSource
from autopilot.mavlink.signing import FileStore, MemoryStore, SigningConfig
from autopilot.mavlink.tcp import TcpPort
from autopilot.mavlink.udp import SILENCE_US, UdpPort, address_towards
from common.airframe import AirframeError, load_airframe
from common.clock import wall_date_text, wall_unix_us
from common.files import write_whole
from common.geodesy import DEFAULT_HOME, GeoPoint
from common.params import ParameterError
from common.state_folder import StateFolder
from mission.client import Running
from mission.flight import Flight, FlightConfig, flight_parameters
from mission.plan import DEFAULT_PLAN, Plan, PlanError, moved_plan, read_plan
from mission.plots import plot_flight
from mission.progress import Progress
from mission.script import fly_plan
from mission.state import StateError, keep_home, open_state, stored_home
from mission.stream import LOOPBACK, StreamServer
from mission.summary import Summary, curved_items, planned_path, summarise
from sim.world.world import WorldConfig

GROUND_PORT_STEP = 18570 - 14550  # from a client's port to the vehicle's own: PX4's where the client's is PX4's
API_PORT_STEP = 14580 - 14540
PORT_MAX = 65535
WIND_EXPECTED_M_S = 13.0  # measured: an x500 finishes the default mission for 12 of 12 seeds; at 14 m/s for 10
HOME_MOST = (89.0, 180.0, 6000.0)  # latitude and longitude [deg], altitude [m]: highest airfields


class UserError(ValueError):
    """Something the user gave is wrong; the message is one sentence."""


@dataclass(frozen=True, slots=True)
class FlightOptions:
    """The options of `honeyguide fly`, as given."""

    plan: Path | None
    is_idle: bool
    once: bool
    speed: str
    seconds: float | None
    seed: int
    wind_m_s: float
    wind_from_deg: float
    noise: float
    airframe: str
    home: str | None  # None: the stored one, or else the default
    world_seed: int
    trees_per_ha: float
    hill_height_m: float
    has_walls: bool
    host: str
    bind: str
    tcp_port: int | None
    has_to_sign: bool
    gcs_port: int
    api_port: int
    run_folder: Path | None
    dialect: str = "px4"
    stream_port: int = 0
    parameters: tuple[str, ...] = ()  # NAME=VALUE
    state: Path | None = None
    traffic_count: int = 0
    has_lidar: bool = False


def fly_session(options: FlightOptions) -> int:
    """Flies as asked and returns the exit code.

    Raises:
        UserError: an option, file, port or folder is wrong; nothing has been written.
    """
    speed = _speed(options.speed)
    _check_end(options, speed)
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
    config = _config(options, state)
    plan = None if options.is_idle else _plan(options.plan, config.home)
    try:
        flight_parameters(config, load_airframe(config.airframe))
    except (AirframeError, ParameterError) as error:
        raise UserError(str(error)) from error
    signing = _signing(options, speed, state)
    links = [] if speed is None else _links(options, speed)
    stream = _stream(options.stream_port)
    folder = _new_folder(options.run_folder)
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
    if state is not None:
        for problem in (*state.problems, *(flight.persistence.problems if flight.persistence else ())):
            _print_line(console, problem)
    running = None if plan is None else flight.drone.start(fly_plan(flight.drone, plan))
    _run(flight, running, options, speed, folder, console)
    return _finish(flight, running, plan, folder, console)


def _stream(port: int) -> StreamServer | None:
    """The camera's live picture, if it is asked for."""
    if port == 0:
        return None
    try:
        return StreamServer(port)
    except OSError as error:
        raise UserError(f"--stream-port {port}: {error.strerror}") from error


def _speed(text: str) -> float | None:
    if text == "max":
        return None
    try:
        speed = float(text)
    except ValueError:
        speed = -1.0
    if not 0.0 < speed <= 1000.0:
        raise UserError(f"--speed {text}: must be a number above 0, or 'max'")
    return speed


def _check_end(options: FlightOptions, speed: float | None) -> None:
    """Refuses options that leave nothing to fly, or nothing to wait for."""
    if options.is_idle and options.plan is not None:
        raise UserError("--plan and --idle: choose one, to fly a plan or to wait for a ground station")
    if options.is_idle and options.once:
        raise UserError("--idle and --once: without a plan there is no mission to end with; use --seconds to end")
    if options.is_idle and speed is None and options.seconds is None:
        raise UserError("--idle --speed max: nobody can connect, so give --seconds to say when it ends")


def _config(options: FlightOptions, state: StateFolder | None) -> FlightConfig:
    home = stored_home(state) if options.home is None else _home(options.home)
    try:
        return FlightConfig(
            airframe=options.airframe,
            home=home,
            seed=options.seed,
            wind_m_s=options.wind_m_s,
            wind_from_deg=options.wind_from_deg,
            noise=options.noise,
            dialect=options.dialect,
            traffic_count=options.traffic_count,
            has_lidar=options.has_lidar,
            parameters=dict(_parameter(text) for text in options.parameters),
            world=WorldConfig(
                seed=options.world_seed,
                trees_per_ha=options.trees_per_ha,
                hill_height_m=options.hill_height_m,
                has_walls=options.has_walls,
            ),
        )
    except ValidationError as error:
        first = error.errors()[0]
        raise UserError(f"{'.'.join(map(str, first['loc']))}: {first['msg']}") from error


def _parameter(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        return name.strip(), float(value)
    except ValueError as error:
        raise UserError(f"--param {text}: must be NAME=VALUE, with a number") from error


def _home(text: str) -> GeoPoint:
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) == 2:
        values.append(DEFAULT_HOME.alt_m)
    if len(values) != 3 or not all(abs(value) <= most for value, most in zip(values, HOME_MOST, strict=True)):
        latitude, longitude, altitude = HOME_MOST
        raise UserError(
            f"--home {text}: must be latitude,longitude or latitude,longitude,altitude, with the latitude within "
            f"±{latitude:g}, the longitude within ±{longitude:g} and the altitude within ±{altitude:g} m"
        )
    return GeoPoint(*values)


def _plan(path: Path | None, home: GeoPoint) -> Plan:
    """The user's plan as it is, or the default one at the vehicle's home."""
    try:
        return moved_plan(read_plan(DEFAULT_PLAN), home) if path is None else read_plan(path)
    except PlanError as error:
        raise UserError(str(error)) from error


def _new_folder(folder: Path | None) -> Path:
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


def _links(options: FlightOptions, speed: float) -> list[LinkSource]:
    _check_ports(options)
    links: list[LinkSource] = []
    silence_us = int(SILENCE_US * max(speed, 1.0))  # clients' heartbeats follow the wall clock
    try:
        bind = options.bind or address_towards(options.host)
        for role, port, step in (
            (LinkRole.GROUND, options.gcs_port, GROUND_PORT_STEP),
            (LinkRole.ONBOARD, options.api_port, API_PORT_STEP),
        ):
            links.append(UdpPort(port, role, options.host, local_port=port + step, bind=bind, silence_us=silence_us))
        if options.tcp_port is not None:
            links.append(TcpPort(options.tcp_port, bind=bind))
    except LinkError as error:
        for link in links:
            link.close()
        options_of = {"UDP": "--gcs-port or --api-port", "TCP": "--tcp-port"}
        name = next((name for name in options_of if f"{name} port" in str(error) and " is in use " in str(error)), "")
        hint = f"; another flight may be running: choose {options_of[name]}" if name else ""
        raise UserError(f"{str(error).rstrip('.')}{hint}") from error
    return links


def _signing(options: FlightOptions, speed: float | None, state: StateFolder | None) -> SigningConfig | None:
    """Signatures follow the wall clock of the other end; in lockstep there is none, and the date is simulated."""
    if speed is None:
        return None
    store = MemoryStore() if state is None else FileStore(state.folder / "signing.json")
    try:
        store.load()
    except ValueError as error:  # without its key the vehicle would obey anybody
        raise UserError(f"{error}; remove it to fly without signing") from error
    return SigningConfig(store, wall_unix_us, options.has_to_sign)


def _check_ports(options: FlightOptions) -> None:
    """The clients' two ports and the vehicle's own two must exist and be four."""
    gcs_port, api_port = options.gcs_port, options.api_port
    for name, port, step in (("gcs", gcs_port, GROUND_PORT_STEP), ("api", api_port, API_PORT_STEP)):
        if port + step > PORT_MAX:
            raise UserError(
                f"--{name}-port {port}: must be at most {PORT_MAX - step}: the vehicle's own is {step} above"
            )
    own = (gcs_port + GROUND_PORT_STEP, api_port + API_PORT_STEP)
    if len({gcs_port, api_port, *own}) < 4:
        raise UserError(
            f"--gcs-port {gcs_port} and --api-port {api_port}: must differ, also from the vehicle's own ports "
            f"{own[0]} and {own[1]}"
        )


def _run(
    flight: Flight, running: Running | None, options: FlightOptions, speed: float | None, folder: Path, console: Console
) -> None:
    """Advances the flight until it is over or the user stops it."""
    end_us = int(options.seconds * 1e6) if options.seconds is not None else None
    ends_with_script = options.once or (speed is None and end_us is None)

    def is_over(flight: Flight) -> bool:
        if end_us is not None and flight.time_us >= end_us:
            return True
        return ends_with_script and (running is None or running.is_done)

    progress = Progress(flight, running)
    try:
        with _sigterm_interrupts():
            _print_start(options, speed, folder, console)
            with Live(console=console, transient=True, auto_refresh=False) as live:

                def on_frame(_: Flight) -> None:
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
    _print_line(console, f"flying: {where}; logs in {folder}")
    if options.stream_port:
        _print_line(console, f"the camera's picture: http://{LOOPBACK}:{options.stream_port}/")
    if options.wind_m_s > WIND_EXPECTED_M_S:
        _print_line(console, f"wind of {options.wind_m_s:g} m/s is more than an x500 can be relied on to fly")


def _print_line(console: Console, text: str) -> None:
    """One line however narrow the console is, at once also into a pipe: rich flushes."""
    console.print(text, markup=False, highlight=False, soft_wrap=True)


def _finish(flight: Flight, running: Running | None, plan: Plan | None, folder: Path, console: Console) -> int:
    """Writes the run folder and prints the summary; returns the exit code."""
    history = flight.close()
    if len(history.time_us) == 0:
        console.print("the flight ended before its first frame")
        return 0 if running is None else 1
    path_ned = [] if plan is None else planned_path(plan, flight.config.home)
    summary = summarise(flight, history, running, path_ned, curved_items(plan) if plan else frozenset())
    write_whole(folder / "summary.json", (json.dumps(summary.as_json(), indent=2) + "\n").encode())
    title = f"{flight.airframe.name}, wind {flight.config.wind_m_s:g} m/s, seed {flight.config.seed}: {summary.result}"
    plot_flight(history, flight.world, path_ned, title, folder / "flight.png")
    if summary.armed_s > 0.0:
        console.print(_summary_table(summary))
    else:
        _print_line(console, f"result: {summary.result}\nsimulated: {summary.simulated_s:.1f} s, never armed")
    _print_line(console, f"logs, summary and picture: {folder}")
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
