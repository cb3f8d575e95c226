"""`honeyguide fly --board`: an outside autopilot started or waited for, its console shown, and the flight.

Ports and folder are opened before the program is started, and it is ended with the flight.
"""

from contextlib import ExitStack, closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from autopilot.mavlink.transport.links import LinkSource
from common.airframe import load_airframe
from mission.boards.process import PeerProcess
from mission.boards.watch import Watch, filled_in
from mission.connections import open_images, open_links, open_page
from mission.console.option_checks import UserError
from mission.console.terminal import loading, print_line
from mission.flight_config import FlightConfig
from mission.flight_options import flight_config
from mission.flight_settings import FlightOptions
from mission.plan.plan_file import Plan
from mission.run_folder import run_folder
from sim.boards.outside import PeerError

if TYPE_CHECKING:
    from mission.boards.betaflight_run import BetaflightRun
    from mission.boards.board_flight import BoardFlight

PACE_MAX = 20.0  # guess: how much faster than real time a flight in lockstep is at most, for time-outs of links
FLOWN = {"ardupilot": ("multirotor", "rover"), "px4": ("multirotor",), "betaflight": ("multirotor",)}
FAST = (("ardupilot", "multirotor"), ("betaflight", "multirotor"))
"""Classes of airframes that each flies here, and who exchanges each millisecond."""
BETAFLIGHT = "betaflight"
"""Flies under our own flight controller, which then has all that it ever has."""
_OURS_ALONE = {
    "dialect": "--dialect", "announces_components": "--announce-components", "traffic_count": "--traffic",
    "has_lidar": "--lidar", "has_base": "--rtk", "stream_port": "--stream-port", "video_port": "--video-port",
    "state": "--state", "has_to_sign": "--require-signing",
}  # fmt: skip


def check_board(options: FlightOptions) -> None:
    """Refuses options that only our own flight controller has, or that its place leaves without meaning.

    Raises:
        UserError: there is one.
    """
    for name, flag in () if options.board == BETAFLIGHT else _OURS_ALONE.items():
        if getattr(options, name) != FlightOptions.model_fields[name].default:
            raise UserError(f"{flag} and --board {options.board}: choose one; the first is our own flight controller's")
    vehicle = load_airframe(options.airframe).vehicle
    if vehicle not in FLOWN[options.board]:
        raise UserError(f"--board {options.board}: it flies no {vehicle} here")
    if (options.board, vehicle) in FAST and options.engine != "native":
        raise UserError(f"--board {options.board} and --engine {options.engine}: only the native one gives it 1,000 Hz")
    if options.board == "px4" and options.noise == 0.0:
        raise UserError("--noise 0 and --board px4: it takes sensors that never change for broken; use --noise 0.1")
    if options.board == BETAFLIGHT and options.instance != 0:
        raise UserError("--instance and --board betaflight: choose one; its ports are always the same")


class PeerRun:
    """An outside autopilot for the length of a flight.

    Args:
        options: of the flight.
        folder: of the run.
        console: where its console is shown.
    """

    def __init__(self, options: FlightOptions, folder: Path, console: Console) -> None:
        from mission.boards.peers import PEERS

        self._options, self._folder = options, folder
        self._peer = PEERS[options.board]
        self._watch = Watch(self._peer.name, console)

    def make_flight(self, config: FlightConfig, **parts: Any) -> "BoardFlight":
        """The flight, with its port open; `parts` as of `BoardFlight`.

        Raises:
            UserError: the port is taken, or the autopilot cannot fly such a vehicle.
        """
        from mission.boards.board_flight import BoardFlight

        try:
            flight = BoardFlight(config, self._peer, self._watch, instance=self._options.instance, **parts)
            flight.on_close = self.close
        except (PeerError, ValueError) as error:
            raise UserError(str(error)) from error
        self._watch.hint = self._peer.waits_for.format(port=flight.board.local_port)
        return flight

    def start(self, flight: "BoardFlight") -> None:
        """Writes what the autopilot is told of the vehicle, and starts its program if there is a command.

        Raises:
            UserError: it cannot be started; the flight is closed.
        """
        config = flight.config
        own, command = self._folder / self._options.board, self._options.command
        own.mkdir(exist_ok=True)
        environment = self._peer.prepare(config, load_airframe(config.airframe), own, self._options.instance)
        if command is not None:
            command = filled_in(command, own, config.home, self._options.instance)
            try:
                self._watch.process = PeerProcess(command, own, environment, own / "console.log")
            except PeerError as error:
                flight.close()
                raise UserError(str(error)) from error

    def close(self) -> None:
        self._watch.close()


def run_of(options: FlightOptions, folder: Path, console: Console) -> "PeerRun | BetaflightRun":
    """The autopilot that the options name, for the length of a flight."""
    if options.board == BETAFLIGHT:
        from mission.boards.betaflight_run import BetaflightRun

        return BetaflightRun(options, folder, console)
    return PeerRun(options, folder, console)


def fly_board(options: FlightOptions, speed: float | None, plan: Plan | None, held: ExitStack) -> int:
    """Flies what the options say and returns the exit code.

    Raises:
        UserError: an option, port, folder or the program is wrong.
    """
    check_board(options)
    console = Console()
    config = flight_config(options, None)
    links = station_links(options, speed)
    images = open_images(options)
    page = open_page(options.view_port) if options.has_view else None
    folder = held.enter_context(run_folder(options.run_folder))
    with loading(console) as say:
        from mission.fly_loop import fly_to_the_end
        from mission.kernel_loading import load_kernels

        if options.owner is not None:
            import mission.follow.onboard_camera
            import mission.follow.owner_device  # noqa: F401  (their kernels are loaded with the others)

        load_kernels(say, config, has_camera=page is not None)
        say("building the world")
        run = held.enter_context(closing(PeerRun(options, folder, console)))
        flight = run.make_flight(config, links=links, folder=folder)
    if images is not None and flight.onboard is not None:
        flight.onboard.add_sink(images.publish)
        flight.computers.append(images)
        held.callback(images.close)
    print_line(console, f"logs: {folder}")
    if page is not None:
        print_line(console, f"live page: {page.url}")
    run.start(flight)
    return fly_to_the_end(flight, plan, options, speed, page, folder, console)


def station_links(options: FlightOptions, speed: float | None) -> list[LinkSource]:
    """For ground stations and companions, of an autopilot that does not speak to them itself."""
    return [] if options.board == "px4" else open_links(options, speed or PACE_MAX, options.instance)
