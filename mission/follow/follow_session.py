"""`honeyguide follow`: an owner walks, a drone or a rover follows by a policy; progress, scorecard, run folder, film.

The vehicle takes off if it flies, its companion on board engages, and after the time asked for it lands, or stops. The
companion speaks MAVLink over a link in memory, so that everything but ground stations and the live page is the same
each time.
"""

import json
from collections.abc import Callable
from contextlib import ExitStack, closing
from dataclasses import asdict
from functools import partial
from math import isfinite
from pathlib import Path

from rich.console import Console
from rich.table import Table

from autopilot.mavlink.transport.links import LinkError, LinkSource
from common.airframe import AirframeError, load_airframe
from common.clock import wall_time_s
from common.files import write_whole
from common.params import ParameterError
from mission.boards.board_options import check_board, commands_of
from mission.boards.board_runs import run_of
from mission.boards.board_session import station_links
from mission.connections import open_foxglove, open_links, open_page
from mission.console.guard_options import guard_of
from mission.console.option_checks import UserError, speed_of
from mission.console.terminal import busy, print_line
from mission.dataset.recording import record_flight
from mission.flight import Flight, flight_parameters
from mission.flight_base import FlightBase
from mission.flight_config import FlightConfig
from mission.flight_session import FlightSession
from mission.flight_settings import OURS, FollowOptions
from mission.follow.companion_process import latency_text
from mission.follow.follow_options import follow_config
from mission.follow.follow_scoring import FollowWatch, Smoothness, taken_over
from mission.follow.guard_report import guard_figures, guard_row, guard_text
from mission.follow.lockstep import flight_with_companion
from mission.kernel_loading import load_kernels
from mission.run_folder import OwnFiles, run_folder
from mission.script import Drone, set_out
from mission.view.film import write_film
from mission.view.replay_file import RecordingError, load_recording
from policies.companion.companion import Companion
from policies.companion.engagement import Phase
from policies.companion.names import FOLLOWER, SCRIPTED
from policies.companion.pilot import PilotError
from policies.companion.skills.following import Pilot
from policies.companion.skills.load_skill import load_follower
from policies.companion.vector_pilot import NavigationPilot
from policies.tasks.follow_me.scorecard import Scorecard, lines, named_lines, scorecard
from sim.bodies.vehicles import class_of

ENGAGE_S = 20.0  # after the take-off, until it follows
STOP_S = 3.0  # of what drives, until it stands
ROVER_POLICY = "navigate-rover-follow"
FILM = "flight.mp4"
SHOWN = ("in_band", "in_view", "distance_median_m", "collision")  # figures of the scorecard on the live page


def follow_session(options: FollowOptions) -> int:
    """Flies as asked and returns the exit code: 1 only if what the policy flew was not followed to its end and landed.

    Raises:
        UserError: an option, file, port or folder is wrong; nothing has been written.
    """
    with ExitStack() as held:
        return _follow(options, held)


def _follow(options: FollowOptions, held: ExitStack) -> int:
    """The flight, with what must be held until its end."""
    console = Console()
    speed = speed_of(options.speed)
    guard = guard_of(options.has_guard, options.guard_settings)
    pilot, name = chosen_pilot(options)
    config = follow_config(options, has_scanner=isinstance(pilot, NavigationPilot))
    foxglove, links = open_foxglove(options, held), _links(options, config, speed)
    page = open_page(options.view_port) if options.has_view else None
    folder = held.enter_context(run_folder(options.run_folder))
    with busy(console, "loading kernels") as say:
        load_kernels(say, config, has_camera=page is not None)
        say("building the world")
        make_flight: Callable[..., FlightBase] = Flight
        peer_run = None
        if options.board != "own":
            peer_run = held.enter_context(closing(run_of(options, folder, console)))
            make_flight = partial(peer_run.make_flight, has_companion=True)
        flight, companion = flight_with_companion(
            config,
            pilot,
            links=links,
            folder=folder,
            wall_s=wall_time_s,
            make_flight=make_flight,
            guard=guard,
        )
    if options.is_recorded:
        held.callback(record_flight(flight, companion, folder, options.policy or name).close)
    watch = watch_of(flight, companion, options.seconds)
    session = FlightSession(
        flight,
        speed,
        page,
        folder,
        console,
        action=lambda: companion.action,
        score=lambda: score_lines(watch, companion),
        foxglove=foxglove,
    )
    running = flight.drone.start(follow(flight.drone, companion, options.seconds))
    where = "lockstep, without network links" if speed is None else f"ground stations on UDP {options.gcs_port}"
    print_line(console, f"{name} follows an owner who {options.owner}s; {where}\nlogs: {folder}")
    if page is not None:
        print_line(console, f"live page: {page.url}")
    if peer_run is not None:
        peer_run.start(flight)
    session.fly(lambda _: running.is_done, running, [watch.frame])
    is_stopped = not running.is_done and not flight.end_reason
    running.cancel()
    if trouble := flight.end_reason or running.error:
        print_line(console, f"result: {trouble}")
    is_down = not trouble and not flight.is_crashed
    exit_code = finish(watch, companion, session.files, console, is_down=is_down, is_stopped=is_stopped)
    _show_flown(flight, watch, companion, console)
    has_film = options.has_film and filmed(flight, folder, console)
    print_line(console, f"{'logs, scorecard and film' if has_film else 'logs and scorecard'}: {folder}")
    session.close()
    return exit_code


def _show_flown(flight: FlightBase, watch: FollowWatch, companion: Companion, console: Console) -> None:
    """Whether it crashed, what the guard has changed, and how long decisions took."""
    if flight.is_crashed:
        print_line(console, "the vehicle crashed" + (f" ({', '.join(watch.takeovers)})" if watch.takeovers else ""))
    print_line(console, f"{guard_text(companion)}\n{latency_text(companion)}")


def _links(options: FollowOptions, config: FlightConfig, speed: float | None) -> list[LinkSource]:
    """Of ground stations.

    Raises:
        UserError: a parameter, the airframe or a port is wrong.
    """
    if options.board == "own":
        commands_of(options.command, [])
    else:
        check_board(options)
    if options.board not in OURS:
        return station_links(options, speed)
    try:
        flight_parameters(config, load_airframe(config.airframe))
        return [] if speed is None else open_links(options, speed)
    except (AirframeError, ParameterError, LinkError) as error:
        raise UserError(str(error)) from error


def filmed(flight: FlightBase, folder: Path, console: Console) -> bool:
    """Whether the film could be made: from the log, which a full disk ends."""
    try:
        recording = load_recording(folder)
    except RecordingError as error:
        print_line(console, f"no film: {error}")
        return False
    write_film(recording, flight.world, folder / FILM, console)
    return True


def chosen_pilot(options: FollowOptions) -> tuple[Pilot | NavigationPilot, str]:
    """Who flies or drives, and how it is called.

    Raises:
        UserError: no such policy, or none for this vehicle.
    """
    drives = class_of(load_airframe(options.airframe)).drives
    name = options.policy or (ROVER_POLICY if drives else FOLLOWER)
    try:
        pilot = load_follower(name)
    except PilotError as error:
        raise UserError(str(error)) from error
    if drives != (isinstance(pilot, NavigationPilot) and pilot.drives):
        raise UserError(f"--policy {name}: it was made for another kind of vehicle than --airframe {options.airframe}")
    return pilot, "a script" if name == SCRIPTED else f"the policy {name}"


def watch_of(flight: FlightBase, companion: Companion, seconds: float) -> FollowWatch:
    """What judges a flight by what its companion flies of it."""
    restarts_over = 0  # those after which it has followed again

    def taken(has_begun: bool) -> str:
        nonlocal restarts_over
        if companion.phase is Phase.FLYING and flight.controller.state.is_armed:
            restarts_over = flight.restart_count
        is_put_back = flight.restart_count > restarts_over
        return taken_over(flight, companion.engagement, has_begun=has_begun, is_put_back=is_put_back)

    return FollowWatch(flight, lambda: companion.phase is Phase.FLYING, seconds, taken)


async def follow(drone: Drone, companion: Companion, seconds: float) -> None:
    """Takes off if it flies, lets the companion follow for so long, and lands or stops, unless it is down by then."""
    await set_out(drone)
    await drone.until(lambda: companion.phase is Phase.FLYING, ENGAGE_S, "the companion's taking over")
    await drone.sleep(seconds)
    if not drone.is_armed:
        return
    if drone.drives:
        await drone.hold()
        await drone.sleep(STOP_S)
        await drone.disarm()
    else:
        await drone.land()


def score_lines(watch: FollowWatch, companion: Companion) -> tuple[str, ...]:
    """How it goes so far, for the live page: figures of the scorecard under its names."""
    state = f"companion: {companion.phase.value}" + (f" ({companion.trouble})" if companion.trouble else "")
    track = watch.so_far()
    if track is None:
        return (state,)
    card = scorecard([track])
    figures = ", ".join(f"{label} {text}" for name, label, text in named_lines(card) if name in SHOWN)
    return (state, f"{watch.judged_s:.0f} s flown by the policy: {figures}")


def finish(
    watch: FollowWatch,
    companion: Companion,
    files: OwnFiles,
    console: Console,
    *,
    is_down: bool,
    is_stopped: bool,
) -> int:
    """Writes and shows the scorecard of what the policy flew, if anything was; returns the exit code.

    Args:
        watch: which judged it.
        companion: whose guard is judged, too.
        files: of the run.
        console: where it is shown.
        is_down: it landed in the end, in one piece.
        is_stopped: the user stopped the program; what was planned beyond does not count.
    """
    track = watch.so_far() if is_stopped else watch.track()
    if watch.takeovers:
        why = ", ".join(watch.takeovers)
        print_line(
            console, f"judged: the {watch.judged_s:.1f} s that the policy flew; for {watch.paused_s:.1f} s {why}"
        )
    is_excused = bool(watch.takeovers) or is_stopped
    if track is None:
        print_line(console, "the owner was not followed: there is no scorecard")
        return 0 if is_excused and not files.missing else 1
    card, smoothness = scorecard([track]), watch.smoothness()
    with files.writing("summary.json") as path:
        summary = summary_of(card) | asdict(smoothness) | guard_figures(companion)
        write_whole(path, (json.dumps(summary, indent=2) + "\n").encode())
    console.print(_table(card, smoothness, companion))
    is_good = track.is_whole and card.collision.value == 0.0 and (is_down or is_excused)
    return 0 if is_good and not files.missing else 1


def summary_of(card: Scorecard) -> dict[str, float | None]:
    """What `summary.json` holds: the scorecard's figures; null for what the flight had none of."""
    names = [name for name in Scorecard.__dataclass_fields__ if name not in ("episodes", "minutes")]
    figures = {name: getattr(card, name).value for name in names}
    return {name: value if isfinite(value) else None for name, value in figures.items()} | {"minutes": card.minutes}


def _table(card: Scorecard, smoothness: Smoothness, companion: Companion) -> Table:
    table = Table("figure", "value", title="scorecard", title_justify="left")
    for row in lines(card):
        table.add_row(*row)
    table.add_row("own level acceleration, RMS", f"{smoothness.accel_rms:.2f} m/s²")
    table.add_row("own yaw rate, RMS", f"{smoothness.yaw_rate_rms:.1f} deg/s")
    table.add_row(*guard_row(companion))
    return table
