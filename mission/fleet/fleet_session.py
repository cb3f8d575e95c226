"""`honeyguide fly --vehicles`: ports and folders opened, the flights, their ends and their run folders.

Light to import: a port that is taken is told before anything heavy is loaded.
"""

import json
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from autopilot.mavlink.transport.links import LinkSource
from common.airframe import load_airframe
from common.files import write_whole
from common.params import ParameterError
from mission.boards.board_options import commands_of
from mission.boards.board_session import check_ports, station_links
from mission.connections import open_links, open_page, signing_config
from mission.console.option_checks import UserError, speed_of
from mission.console.terminal import Say, loading, print_line
from mission.fleet.fleet_boards import board_runs
from mission.fleet.fleet_options import Member, boards_of, members_of
from mission.fleet.roster import check_fleet_parameters, fleet_configs
from mission.flight_config import start_of
from mission.flight_options import flight_config
from mission.flight_settings import OURS, FlightOptions
from mission.plan.plan_file import Plan, PlanError, default_plan, moved_plan, read_plan
from mission.run_folder import OwnFiles, run_folder

if TYPE_CHECKING:
    from mission.client import Running
    from mission.fleet.fleet_flight import FleetFlight
    from mission.flight_base import FlightBase
    from mission.flight_config import FlightConfig
    from mission.log.flight_recorder import History
    from mission.log.flight_summary import Summary
    from mission.view.live import LiveView
    from mission.view.page import PageServer
    from sim.world.world import WorldMap


def fly_fleet(options: FlightOptions) -> int:
    """Flies what `check_options` and `check_fleet` have passed and returns the exit code.

    Raises:
        UserError: an option, file, port or folder is wrong; nothing has been written.
    """
    speed, console = speed_of(options.speed), Console()
    members = members_of(options.vehicles or "1", options.airframe, options.board)
    base = flight_config(options.model_copy(update={"airframe": _needing_most(members)}), None)
    try:
        check_fleet_parameters(base, members)
    except ParameterError as error:
        raise UserError(str(error)) from error
    with ExitStack() as opened:  # what is open closes if it does not come to the flight, which then closes it itself
        links = _open_all(options, speed, members, opened)
        page = open_page(options.view_port) if options.has_view else None
        with loading(console) as say:
            world, configs = _place(options, base, members, say)
        folder = opened.enter_context(run_folder(options.run_folder))
        with loading(console) as say:
            fleet = _make_fleet(options, members, world, configs, links, speed, folder, say, console)
        from mission.fleet.fleet_table import print_start

        print_start(fleet, members, options, speed, folder, console)
        if page is not None:
            print_line(console, f"live page: {page.url}")
        return _fly(fleet, options, speed, page, folder, console)


def _open_all(
    options: FlightOptions, speed: float | None, members: list[Member], opened: ExitStack
) -> list[list[LinkSource]]:
    """The ports of each vehicle; those of programs of others are looked at only, until they are needed."""
    links: list[list[LinkSource]] = []
    for i, member in enumerate(members):
        own: list[LinkSource] = []
        if member.board not in OURS:
            check_ports(member.board, i)
            alone = {"board": member.board, "instance": i, "tcp_port": None}  # it has TCP ports of its own there
            own = station_links(options.model_copy(update=alone), speed)
        elif speed is not None:
            own = open_links(options, speed, i)
        for link in own:
            opened.callback(link.close)
        links.append(own)
    return links


def _needing_most(members: list[Member]) -> str:
    """Of several airframes, the one that the world is made for: the first that needs a runway, if there is one."""
    from sim.bodies.vehicles import class_of

    airframes = [member.airframe for member in members]
    return next((name for name in airframes if class_of(load_airframe(name)).needs_runway), airframes[0])


def _place(
    options: FlightOptions, base: "FlightConfig", members: list[Member], say: Say
) -> tuple["WorldMap", list["FlightConfig"]]:
    """The world, and the configuration of each vehicle, which knows its place in it."""
    from mission.simulator.flight_rig import flight_world

    say("building the world")
    world = flight_world(base)
    return world, fleet_configs(base, members, world, options.spacing_m)


def _make_fleet(
    options: FlightOptions,
    members: list[Member],
    world: "WorldMap",
    configs: list["FlightConfig"],
    links: list[list[LinkSource]],
    speed: float | None,
    folder: Path,
    say: Say,
    console: Console,
) -> "FleetFlight":
    """The vehicles, their kernels loaded."""
    from mission.fleet.fleet_flight import FleetFlight
    from mission.kernel_loading import load_kernels

    has_camera = speed is not None or options.has_view
    for config in {config.airframe: config for config in configs}.values():
        load_kernels(say, config, has_camera=has_camera)
    commands = commands_of(options.command, boards_of(members))
    return FleetFlight(
        configs,
        world,
        boards=board_runs(members, commands, folder, partial(print_line, console)),
        links=links,
        signing=[signing_config(options, speed, None) for _ in configs],
        folder=folder,
        has_transponders=options.has_transponders,
        has_camera_threads=speed is not None,
    )


def _plan(options: FlightOptions, config: "FlightConfig") -> Plan:
    """The user's plan, or the default one of the vehicle's class, as far aside as the vehicle boots from home."""
    try:
        if options.plan is None:
            return moved_plan(read_plan(default_plan(load_airframe(config.airframe).vehicle)), start_of(config))
        plan = read_plan(options.plan)
    except PlanError as error:
        raise UserError(str(error)) from error
    if plan.home is None:
        return plan
    aside = moved_plan(plan, start_of(config.model_copy(update={"home": plan.home})))
    return replace(aside, fence=plan.fence, rally=plan.rally)


@dataclass(frozen=True, slots=True)
class _Vehicle:
    """One vehicle, what it is to fly, and the script that flies it."""

    flight: "FlightBase"
    plan: Plan | None
    path_ned: list[tuple[int, Any]]
    running: "Running | None"


def _begin(fleet: "FleetFlight", options: FlightOptions) -> list[_Vehicle]:
    """Starts the plans; none where ground stations are waited for."""
    from mission.log.flight_summary import planned_path
    from mission.script import fly_plan
    from mission.view.replay_file import keep_for_replay

    begun = []
    for flight in fleet.flights:
        plan = None if options.is_idle else _plan(options, flight.config)
        path_ned = [] if plan is None else planned_path(plan, flight.config.home, flight.config.start_ne_m)
        keep_for_replay(flight, [point for _, point in path_ned])
        running = None if plan is None else flight.drone.start(fly_plan(flight.drone, plan))
        begun.append(_Vehicle(flight, plan, path_ned, running))
    return begun


def _fly(
    fleet: "FleetFlight",
    options: FlightOptions,
    speed: float | None,
    page: "PageServer | None",
    folder: Path,
    console: Console,
) -> int:
    """Flies the plans, or waits for ground stations; writes the run folders and returns the exit code."""
    from mission.fleet.fleet_table import FleetProgress, print_end
    from mission.flight_session import run_shown
    from mission.fly_loop import end_of

    vehicles = _begin(fleet, options)
    view = None if page is None else _view(fleet, page, speed, [point for _, point in vehicles[0].path_ned])
    is_over = end_of(options, speed, [each.running for each in vehicles if each.running is not None])
    progress = FleetProgress(fleet)
    run_shown(
        lambda on_frame: fleet.run(is_over, speed=speed, on_frame=on_frame),
        [] if view is None else [view.frame],
        progress.new_texts,
        progress,
        console,
    )
    if view is not None:
        view.end(f"flight ended: logs in {folder}")
    summaries, is_whole = _write(vehicles, fleet.close(), folder, console)
    if view is not None:
        view.close()
    print_end(fleet, summaries, folder, console)
    has_succeeded = len(summaries) == len(vehicles) and all(summary.is_success for summary in summaries)
    is_lost = any(flight.end_reason for flight in fleet.flights)
    return 0 if (has_succeeded or (options.is_idle and not is_lost)) and is_whole else 1


def _view(fleet: "FleetFlight", page: "PageServer", speed: float | None, path_ned: list[Any]) -> "LiveView":
    """The live page: all vehicles, and the controls of the first."""
    from mission.view.live import LiveView

    first, *others = fleet.flights
    return LiveView(first, page, speed=speed, path_ned=path_ned, others=others, change_speed=fleet.change_speed)


def _write(
    vehicles: list[_Vehicle], histories: list["History"], folder: Path, console: Console
) -> tuple[list["Summary"], bool]:
    """Writes each vehicle's results and the list of all summaries; these, and whether all could be written."""
    from mission.fly_loop import write_results

    summaries: list[Summary] = []
    files = [OwnFiles(folder / f"vehicle-{i}", console) for i in range(1, len(vehicles) + 1)]
    for i, (each, history) in enumerate(zip(vehicles, histories, strict=True)):
        for trouble in each.flight.troubles.take():
            print_line(console, f"vehicle {i + 1}: {trouble}")
        if len(history.time_us):
            summaries.append(write_results(each.flight, history, each.running, each.plan, each.path_ned, files[i]))
    files.append(OwnFiles(folder, console))
    with files[-1].writing("summary.json") as path:
        write_whole(path, (json.dumps([summary.as_json() for summary in summaries], indent=2) + "\n").encode())
    return summaries, not any(each.missing for each in files)
