"""`honeyguide fly`: its options checked, its ports and folder opened, then the flight.

Light to import: what is wrong is told, and a port that is taken, before anything heavy is loaded.
"""

from collections.abc import Callable
from contextlib import ExitStack, closing
from pathlib import Path

from rich.console import Console

from common.airframe import load_airframe
from common.files import write_whole
from common.geodesy import GeoPoint
from common.state_folder import StateFolder
from mission.boards.board_options import check_board, commands_of
from mission.connections import (
    open_foxglove,
    open_images,
    open_links,
    open_page,
    open_stream,
    open_video,
    signing_config,
)
from mission.console.option_checks import UserError, speed_of
from mission.console.terminal import loading, print_line
from mission.flight_options import flight_config
from mission.flight_settings import OURS, FlightOptions
from mission.flight_state_folder import StateError, keep_home, open_state
from mission.net_guard import LOOPBACK
from mission.plan.plan_file import Plan, PlanError, default_plan, moved_plan, read_plan
from mission.run_folder import OwnFiles, run_folder
from mission.video.rtp_video import session_description

VIDEO = "video.sdp"
WIND_EXPECTED_M_S = 13.0  # measured: an x500 finishes the default mission for 12 of 12 seeds; at 14 m/s for 10


def fly_session(options: FlightOptions) -> int:
    """Flies what `check_options` has passed and returns the exit code.

    Raises:
        UserError: an option, file, port or folder is wrong; nothing has been written.
    """
    speed = speed_of(options.speed)
    with ExitStack() as held:
        if options.board not in OURS:
            from mission.boards.board_session import fly_board

            home = flight_config(options, None).home
            return fly_board(
                options, speed, None if options.is_idle else _plan(options.plan, options.airframe, home), held
            )
        if options.board == "own":
            commands_of(options.command, [])
        else:
            check_board(options)
        if options.state is None:
            return _fly(options, speed, None, held)
        try:
            state = held.enter_context(closing(open_state(options.state)))
        except StateError as error:
            raise UserError(str(error)) from error
        return _fly(options, speed, state, held)


def _fly(options: FlightOptions, speed: float | None, state: StateFolder | None, held: ExitStack) -> int:
    """The flight, with what must be held until its end."""
    console = Console()
    config = flight_config(options, state)
    plan = None if options.is_idle else _plan(options.plan, options.airframe, config.home)
    signing, foxglove = signing_config(options, speed, state), open_foxglove(options, held)
    links = [] if speed is None else open_links(options, speed)
    stream = open_stream(options.stream_port)
    is_reached = speed is not None and not options.stream_port  # stations are told of one stream
    video = open_video(options.video_port, options.host, may_wait=is_reached)
    images = None if speed is None else open_images(options)
    page = open_page(options.view_port) if options.has_view else None
    folder = held.enter_context(run_folder(options.run_folder))
    if state is not None and options.home is not None:
        keep_home(state, config.home)
    with loading(console) as say:
        from mission.flight import Flight
        from mission.fly_loop import fly_to_the_end
        from mission.kernel_loading import load_kernels

        if options.owner is not None:
            import mission.follow.onboard_camera
            import mission.follow.owner_device  # noqa: F401  (their kernels are loaded with the others)

        has_camera = speed is not None or any(shown is not None for shown in (stream, page, foxglove))
        load_kernels(say, config, has_camera=has_camera)
        say("building the world")
        make_flight: Callable[..., Flight] = Flight
        run = None
        if options.board != "own":
            from mission.boards.betaflight_run import BetaflightRun

            run = held.enter_context(closing(BetaflightRun.of(options, folder, console)))
            make_flight = run.make_flight
        flight = make_flight(
            config,
            links=links,
            folder=folder,
            signing=signing,
            state=state,
            stream=stream,
            video=video,
            has_camera_thread=speed is not None,
        )
    if images is not None and flight.onboard is not None:
        flight.onboard.add_sink(images.publish)
        flight.computers.append(images)
    if state is not None:
        for problem in (*state.problems, *(flight.persistence.problems if flight.persistence else ())):
            print_line(console, problem)
    _print_start(options, speed, folder, console)
    if page is not None:
        print_line(console, f"live page: {page.url}")
    if run is not None:
        run.start(flight)
    try:
        return fly_to_the_end(flight, plan, options, speed, page, folder, console, foxglove)
    finally:
        if images is not None:
            images.close()


def _plan(path: Path | None, airframe: str, home: GeoPoint) -> Plan:
    """The user's plan as it is, or the default one of the vehicle's class at its home."""
    try:
        if path is not None:
            return read_plan(path)
        return moved_plan(read_plan(default_plan(load_airframe(airframe).vehicle)), home)
    except PlanError as error:
        raise UserError(str(error)) from error


def _print_start(options: FlightOptions, speed: float | None, folder: Path, console: Console) -> None:
    ports = f"UDP {options.gcs_port} (ground stations), {options.api_port} (offboard API)"
    if options.tcp_port is not None:
        ports += f", TCP {options.tcp_port}"
    where = "lockstep, without network links" if speed is None else ports
    print_line(console, f"flying: {where}")
    print_line(console, f"logs: {folder}")
    if options.owner is not None and speed is not None:
        print_line(console, f"pictures for a companion: tcp://{LOOPBACK}:{options.image_port}")
    if options.stream_port:
        print_line(console, f"the camera's picture: http://{LOOPBACK}:{options.stream_port}/")
    if options.video_port:
        with OwnFiles(folder, console).writing(VIDEO) as path:
            write_whole(path, session_description(options.host, options.video_port).encode())
        print_line(console, f"video: UDP {options.video_port} (H.264 in RTP); players open {folder / VIDEO}")
    if options.wind_m_s > WIND_EXPECTED_M_S:
        print_line(console, f"wind of {options.wind_m_s:g} m/s is more than an x500 can be relied on to fly")
