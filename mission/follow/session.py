"""`honeyguide follow`: an owner walks, the drone follows by a policy; live progress, scorecard, run folder, film.

The vehicle takes off, its companion on board engages, and after the time asked for it lands. The companion speaks
MAVLink over a link in memory, so that everything but ground stations and the live page is the same each time.
"""

import json
from collections.abc import Callable
from contextlib import ExitStack
from math import isfinite

import numpy as np
from rich.console import Console
from rich.table import Table

from autopilot.mavlink.links import LinkError
from common.airframe import AirframeError, load_airframe
from common.clock import wall_time_s
from common.files import write_whole
from common.params import ParameterError
from mission.connections import open_links, open_page
from mission.flight import flight_parameters
from mission.flying import advance
from mission.follow.companion import latency_text
from mission.follow.lockstep import flight_with_companion, take_off
from mission.follow.options import FollowOptions, follow_config
from mission.follow.watch import FollowWatch
from mission.loading import load_kernels
from mission.options import UserError, speed_of
from mission.progress import Progress
from mission.run_folder import OwnFiles, run_folder
from mission.script import Drone
from mission.terminal import busy, print_line
from mission.view.film import write_film
from mission.view.recording import FILE as RECORDING
from mission.view.recording import Recorder
from policies.companion.companion import Companion, Pilot
from policies.companion.engagement import Phase
from policies.companion.names import SCRIPTED, TASK
from policies.companion.pilot import PilotError, load_pilot
from policies.pretrained.shelf import pretrained
from policies.tasks.follow_me.scorecard import Scorecard, lines, scorecard
from policies.tasks.follow_me.track import Ranges, Track

ENGAGE_S = 20.0  # after the take-off, until it follows
FILM = "flight.mp4"


def follow_session(options: FollowOptions) -> int:
    """Flies as asked and returns the exit code: 0 if it followed all the time and landed.

    Raises:
        UserError: an option, file, port or folder is wrong; nothing has been written.
    """
    with ExitStack() as held:
        return _follow(options, held)


def _follow(options: FollowOptions, held: ExitStack) -> int:
    """The flight, with what must be held until its end."""
    console = Console()
    speed = speed_of(options.flight.speed)
    config = follow_config(options)
    pilot, name = chosen_pilot(options.policy)
    try:
        flight_parameters(config, load_airframe(config.airframe))
        links = [] if speed is None else open_links(options.flight, speed)
    except (AirframeError, ParameterError, LinkError) as error:
        raise UserError(str(error)) from error
    page = open_page(options.flight.view_port) if options.flight.has_view else None
    folder = held.enter_context(run_folder(options.flight.run_folder))
    with busy(console, "loading kernels") as say:
        load_kernels(say, has_camera=page is not None, has_owner=True)
        say("building the world")
        flight, companion = flight_with_companion(config, pilot, links=links, folder=folder, wall_s=wall_time_s)
    recorder = Recorder(flight, action=lambda: companion.action)
    watch = FollowWatch(flight, lambda: companion.phase is Phase.FLYING, options.seconds)
    watchers: list[Callable[[], None]] = [recorder.frame, watch.frame]
    if page is not None:
        from mission.view.live import LiveView

        view = LiveView(
            flight, page, speed=speed, action=lambda: companion.action, score=lambda: score_lines(watch, companion)
        )
        watchers.append(view.frame)
    running = flight.drone.start(follow(flight.drone, companion, options.seconds))
    where = "lockstep, without network links" if speed is None else f"ground stations on UDP {options.flight.gcs_port}"
    print_line(console, f"{name} follows an owner who {options.pace}s; {where}")
    print_line(console, f"logs: {folder}")
    if page is not None:
        print_line(console, f"live page: {page.url}")
    advance(flight, lambda _: running.is_done, speed, watchers, Progress(flight, running), console)
    if page is not None:
        view.close()
    running.cancel()
    flight.close()
    for trouble in flight.troubles.take():
        print_line(console, trouble)
    files = OwnFiles(folder, console)
    with files.writing(RECORDING):
        recorder.recording().save(folder)
    if running.error is not None:
        print_line(console, f"result: {running.error}")
    exit_code = finish(watch.track(), files, console, is_landed=running.error is None)
    print_line(console, latency_text(companion))
    if options.has_film:
        write_film(recorder.recording(), flight.world, folder / FILM, console)
    print_line(console, f"{'logs, scorecard and film' if options.has_film else 'logs and scorecard'}: {folder}")
    return exit_code


def chosen_pilot(policy: str | None) -> tuple[Pilot, str]:
    """Who flies, and how it is called."""
    name = policy or (TASK if pretrained(TASK) is not None else SCRIPTED)
    try:
        return load_pilot(name), "a script" if name == SCRIPTED else f"the policy {name}"
    except PilotError as error:
        raise UserError(str(error)) from error


async def follow(drone: Drone, companion: Companion, seconds: float) -> None:
    """Takes off, lets the companion follow for so long, and lands."""
    await take_off(drone)
    await drone.until(lambda: companion.phase is Phase.FLYING, ENGAGE_S, "the companion's taking over")
    await drone.sleep(seconds)
    await drone.land()


def score_lines(watch: FollowWatch, companion: Companion) -> tuple[str, ...]:
    """How it goes so far, for the live page."""
    state = f"companion: {companion.phase.value}" + (f" ({companion.trouble})" if companion.trouble else "")
    track, ranges = watch.track(), Ranges()
    if track is None:
        return (state,)
    distance = track.distance_m
    is_near = (distance >= ranges.near_m) & (distance <= ranges.far_m)
    band = f"{ranges.near_m:g} to {ranges.far_m:g} m"
    return (state, f"within {band}: {100.0 * is_near.mean():.0f} %, median {float(np.median(distance)):.1f} m")


def finish(track: Track | None, files: OwnFiles, console: Console, *, is_landed: bool) -> int:
    """Writes and shows the scorecard of what was followed, if anything was; returns the exit code."""
    is_good = False
    if track is not None:
        card = scorecard([track])
        is_good = is_landed and track.is_whole and card.collision.value == 0.0
        with files.writing("summary.json") as path:
            write_whole(path, (json.dumps(summary_of(card), indent=2) + "\n").encode())
        console.print(_table(card))
    else:
        print_line(console, "the owner was not followed: there is no scorecard")
    return 0 if is_good and not files.missing else 1


def summary_of(card: Scorecard) -> dict[str, float | None]:
    """What `summary.json` holds: the scorecard's figures; null for what the flight had none of."""
    names = [name for name in Scorecard.__dataclass_fields__ if name not in ("episodes", "minutes")]
    figures = {name: getattr(card, name).value for name in names}
    return {name: value if isfinite(value) else None for name, value in figures.items()} | {"minutes": card.minutes}


def _table(card: Scorecard) -> Table:
    table = Table("figure", "value", title="scorecard", title_justify="left")
    for row in lines(card):
        table.add_row(*row)
    return table
