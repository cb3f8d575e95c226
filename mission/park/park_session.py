"""`honeyguide park`: a rover drives into a free spot; live page, progress, result, run folder.

Its companion on board speaks MAVLink over a link in memory, so that everything but ground stations and the live page is
the same each time.
"""

import json
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict
from math import pi

from rich.console import Console
from rich.table import Table

from autopilot.mavlink.transport.links import LinkError
from common.airframe import load_airframe
from common.files import write_whole
from mission.client import Running
from mission.connections import open_foxglove, open_links, open_page
from mission.console.guard_options import guard_of
from mission.console.option_checks import UserError, speed_of
from mission.console.terminal import busy, print_line
from mission.dataset.recording import record_flight
from mission.flight import Flight
from mission.flight_base import FlightBase
from mission.flight_config import FlightConfig
from mission.flight_options import flight_config
from mission.flight_session import FlightSession
from mission.flight_settings import ParkOptions
from mission.follow.guard_report import guard_figures, guard_text
from mission.follow.lockstep import flight_with_driver
from mission.kernel_loading import PARKING, load_kernels
from mission.park.parking import Arrival, drive, get_ready
from mission.run_folder import run_folder
from mission.script import Drone, ScriptError
from mission.simulator.flight_rig import flight_world
from mission.view.pose_goals import Pose, PoseGoals
from policies.companion.companion import Companion
from policies.companion.engagement import Phase
from policies.companion.pilot import PilotError
from policies.companion.skills.driving import Driving
from policies.companion.vector_pilot import DrivingPilot
from policies.learn.export.policy_file import load_policy
from policies.learn.export.policy_path import CheckpointError, find_policy
from sim.bodies.vehicles import class_of
from sim.world.spots import Spot, spots_of

REVERSES = {"HG_RO_OFFB_BODY": 1.0}  # stock PX4's Offboard does not


def park_session(options: ParkOptions) -> int:
    """Parks as asked and returns the exit code: 0 if it stands in its spot, and has touched nothing.

    Raises:
        UserError: an option, file, port or folder is wrong; nothing has been written.
    """
    with ExitStack() as held:
        return _park(options, held)


def park_config(options: ParkOptions) -> FlightConfig:
    """The flight that the options describe.

    Raises:
        UserError: its vehicle has no wheels.
    """
    config = flight_config(options, None)
    if not class_of(load_airframe(config.airframe)).drives:
        raise UserError(f"--airframe {config.airframe}: a drone does not park")
    return config.model_copy(update={"parameters": REVERSES | config.parameters})


def _park(options: ParkOptions, held: ExitStack) -> int:
    """The drive, with what must be held until its end."""
    console = Console()
    speed = speed_of(options.speed)
    config = park_config(options)
    guard = guard_of(options.has_guard, options.guard_settings)
    pilot = _pilot(options.policy)
    with busy(console, "loading kernels") as say:
        has_camera = options.has_view or options.has_mcap or options.has_foxglove
        load_kernels(say, config, has_camera=has_camera, others=PARKING)
        spot = chosen_spot(spots_of(flight_world(config)), options)
    foxglove = open_foxglove(options, held)
    try:
        links = [] if speed is None else open_links(options, speed)
    except LinkError as error:
        raise UserError(str(error)) from error
    page = open_page(options.view_port) if options.has_view else None
    folder = held.enter_context(run_folder(options.run_folder))
    flight, companion = flight_with_driver(config, pilot, links=links, folder=folder, guard=guard)
    if options.is_recorded:
        record_flight(flight, companion, folder, options.policy)
    arrivals: list[Arrival] = []

    async def script(drone: Drone) -> None:
        await get_ready(drone)
        if spot is not None:
            arrivals.append(await drive(drone, flight, companion, pose_in(spot, is_reverse=options.is_reverse)))

    goals = _goals(flight, companion, is_reverse=options.is_reverse)
    score = lambda: (_state(companion),)  # noqa: E731
    session = FlightSession(flight, speed, page, folder, console, score=score, goals=goals, foxglove=foxglove)
    running = flight.drone.start(script(flight.drone))
    where = "lockstep, without network links" if speed is None else f"ground stations on UDP {options.gcs_port}"
    aim = f"drives into spot {spot.number}" if spot is not None else "waits for a goto"
    print_line(console, f"the policy {options.policy} {aim}; {where}")
    print_line(console, f"logs: {folder}")
    if page is not None:
        print_line(console, f"live page: {page.url}")
    session.fly(_end(options, running), running)
    running.cancel()
    if spot is not None:
        _report(spot, arrivals, running, companion, session, console)
    print_line(console, guard_text(companion))
    print_line(console, f"logs: {folder}")
    session.close()
    is_good = spot is None or (bool(arrivals) and arrivals[0].is_there)
    return 0 if is_good and not session.files.missing else 1


def _end(options: ParkOptions, running: Running) -> Callable[[FlightBase], bool]:
    """What is asked after each frame: whether the drive is over."""
    end_us = None if options.seconds is None else int(options.seconds * 1e6)

    def is_over(flight: FlightBase) -> bool:
        is_late = end_us is not None and flight.time_us >= end_us
        return is_late or (running.is_done and not options.is_idle)

    return is_over


def _report(
    spot: Spot,
    arrivals: list[Arrival],
    running: Running,
    companion: Companion,
    session: FlightSession,
    console: Console,
) -> None:
    """Shows and writes how it ended."""
    if not arrivals:
        print_line(console, f"result: {running.error}")
        return
    console.print(_table(spot, arrivals[0]))
    with session.files.writing("summary.json") as path:
        summary = {"spot": spot.number} | asdict(arrivals[0]) | guard_figures(companion)
        write_whole(path, (json.dumps(summary, indent=2) + "\n").encode())


def chosen_spot(spots: list[Spot], options: ParkOptions) -> Spot | None:
    """The spot that is asked for, or a free one that the seed draws; None: it waits for gotos.

    Raises:
        UserError: there is no such spot, or it is taken.
    """
    if options.is_idle:
        return None
    free = [spot for spot in spots if spot.is_free]
    if options.spot is None:
        return free[options.seed % len(free)]
    names = ", ".join(str(spot.number) for spot in free)
    for spot in spots:
        if spot.number == options.spot:
            if not spot.is_free:
                raise UserError(f"--spot {options.spot}: a car stands there; free are {names}")
            return spot
    raise UserError(f"--spot {options.spot}: there are {len(spots)}; free are {names}")


def pose_in(spot: Spot, *, is_reverse: bool) -> Pose:
    """The pose in a spot, the tail to the aisle, or with its nose, for which a car reverses in."""
    return spot.north_m, spot.east_m, spot.out_rad if is_reverse else spot.out_rad + pi


def _pilot(name: str) -> DrivingPilot:
    try:
        path = find_policy(name)
        return DrivingPilot(load_policy(path)[0], str(path))
    except (CheckpointError, PilotError) as error:
        raise UserError(str(error)) from error


def _goals(flight: Flight, companion: Companion, *, is_reverse: bool) -> PoseGoals:
    """The free spots, for the page."""

    def now() -> Pose | None:
        skill = companion.skill
        return skill.goal_pose(companion.vehicle.own) if isinstance(skill, Driving) else None

    async def go(drone: Drone, pose: Pose) -> None:
        arrival = await drive(drone, flight, companion, pose)
        if not arrival.is_there:
            raise ScriptError(_outcome(arrival))

    free = [spot for spot in spots_of(flight.world) if spot.is_free]
    named = tuple((f"spot {spot.number}", pose_in(spot, is_reverse=is_reverse)) for spot in free)
    return PoseGoals(named, go, now)


def _outcome(arrival: Arrival) -> str:
    """How a drive ended, in words."""
    result = {"there": "parked", "touched": "touched something", "missed": "not in its spot"}[arrival.outcome]
    return f"{result}: {arrival.why}" if arrival.why else result


def _state(companion: Companion) -> str:
    trouble = f" ({companion.trouble})" if companion.trouble else ""
    state = companion.skill.flying if companion.phase is Phase.FLYING else companion.phase.value
    return f"companion: {state}{trouble}"


def _table(spot: Spot, arrival: Arrival) -> Table:
    table = Table("figure", "value", title="parking", title_justify="left")
    rows = [
        ("result", _outcome(arrival)),
        ("spot", str(spot.number)),
        ("off its middle", f"{arrival.distance_m:.2f} m"),
        ("off its heading", f"{arrival.turn_deg:.1f} deg"),
        ("time", f"{arrival.seconds:.1f} s"),
    ]
    for row in rows:
        table.add_row(*row)
    return table
