"""`honeyguide fly --board`: an outside autopilot started or waited for, its console shown, and the flight.

Ports and folder are opened before the program is started, and it is ended with the flight.
"""

from contextlib import ExitStack, closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Self

from rich.console import Console

from autopilot.mavlink.transport.links import LinkError, LinkSource
from mission.boards.board_options import check_board, commands_of
from mission.boards.process import PeerProcess
from mission.boards.watch import Watch, filled_in
from mission.connections import open_foxglove, open_images, open_links, open_page
from mission.console.option_checks import UserError
from mission.console.terminal import Say, loading, print_line
from mission.flight_config import FlightConfig
from mission.flight_options import flight_config
from mission.flight_settings import FlightOptions
from mission.plan.plan_file import Plan
from mission.run_folder import run_folder
from sim.boards.outside import PeerError

if TYPE_CHECKING:
    from mission.boards.board_flight import BoardFlight
    from mission.flight_base import FlightBase

PACE_MAX = 20.0  # guess: how much faster than real time a flight in lockstep is at most, for time-outs of links


class BoardRun(Protocol):
    """The program of others that flies one of several vehicles."""

    is_ours: bool
    """Our own flight controller flies by it, and takes what that takes."""

    def make_flight(self, config: FlightConfig, **parts: Any) -> "FlightBase":
        """The flight, with its port open; of `parts` there are `links`, `folder`, `world`, and what is ours alone.

        Raises:
            UserError: the port is taken, or it cannot fly such a vehicle.
        """

    def launch(self, flight: "FlightBase") -> None:
        """Starts the program, if we are to; it ends with the flight.

        Raises:
            UserError: it cannot be started.
        """


class PeerRun:
    """An outside autopilot for the length of a flight.

    Args:
        board: which.
        command: starts it; None: whoever else does.
        folder: of the flight, in which it gets one of its own.
        say: shows a line of its console, or about it.
        instance: its number.
        whose: what else is to be said where there are several.
        shows_console: its console is shown.
    """

    is_ours = False

    def __init__(
        self,
        board: str,
        command: str | None,
        folder: Path,
        say: Say,
        *,
        instance: int = 0,
        whose: str = "",
        shows_console: bool = True,
    ) -> None:
        from mission.boards.peers import PEERS

        self._command, self._folder, self._instance = command, folder / board, instance
        self._peer = PEERS[board]
        self._watch = Watch(self._peer.name + whose, say, shows_console=shows_console)

    @classmethod
    def of(cls, options: FlightOptions, folder: Path, console: Console) -> Self:
        """That of a single flight."""
        command = commands_of(options.command, [options.board]).get(options.board)
        return cls(options.board, command, folder, partial(print_line, console), instance=options.instance)

    def make_flight(self, config: FlightConfig, **parts: Any) -> "BoardFlight":
        """The flight, with its port open; `parts` as of `BoardFlight`.

        Raises:
            UserError: the port is taken, or the autopilot cannot fly such a vehicle.
        """
        from mission.boards.board_flight import BoardFlight

        try:
            flight = BoardFlight(config, self._peer, self._watch, instance=self._instance, **parts)
            flight.on_close = self.close
        except (PeerError, LinkError, ValueError) as error:
            raise UserError(str(error)) from error
        model = self._peer.model(flight.airframe)
        self._watch.hint = self._peer.waits_for.format(port=flight.board.local_port, model=model)
        return flight

    def start(self, flight: "FlightBase") -> None:
        """As `launch`, but closes the flight if there is none."""
        try:
            self.launch(flight)
        except UserError:
            flight.close()
            raise

    def launch(self, flight: "FlightBase") -> None:
        """Writes what the autopilot is told of the vehicle, and starts its program if there is a command.

        Raises:
            UserError: it cannot be started.
        """
        own, instance = self._folder, self._instance
        own.mkdir(parents=True, exist_ok=True)
        try:
            environment = self._peer.prepare(flight.config, flight.airframe, own, instance)
            if self._command is not None:
                command = filled_in(self._command, own, flight.config, instance)
                self._watch.process = PeerProcess(command, own, environment, own / "console.log")
        except (PeerError, ValueError) as error:
            raise UserError(str(error)) from error

    def close(self) -> None:
        self._watch.close()


def fly_board(options: FlightOptions, speed: float | None, plan: Plan | None, held: ExitStack) -> int:
    """Flies what the options say and returns the exit code.

    Raises:
        UserError: an option, port, folder or the program is wrong.
    """
    check_board(options)
    console = Console()
    config = flight_config(options, None)
    check_ports(options.board, options.instance)
    foxglove = open_foxglove(options, held)
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
        run = held.enter_context(closing(PeerRun.of(options, folder, console)))
        flight = run.make_flight(config, links=links, folder=folder)
    if images is not None and flight.onboard is not None:
        flight.onboard.add_sink(images.publish)
        flight.computers.append(images)
        held.callback(images.close)
    print_line(console, f"logs: {folder}")
    if page is not None:
        print_line(console, f"live page: {page.url}")
    run.start(flight)
    return fly_to_the_end(flight, plan, options, speed, page, folder, console, foxglove)


def check_ports(board: str, instance: int) -> None:
    """Refuses an instance one of whose ports is taken.

    Raises:
        UserError: of such.
    """
    from mission.boards.peers import PEERS

    try:
        PEERS[board].check_ports(instance)
    except LinkError as error:
        trouble = str(error).removeprefix("MAVLink: ").rstrip(".")
        raise UserError(
            f"{PEERS[board].name}, instance {instance}: {trouble}; another flight may be running"
        ) from error


def station_links(options: FlightOptions, speed: float | None) -> list[LinkSource]:
    """For ground stations and companions, of an autopilot that does not speak to them itself."""
    return [] if options.board == "px4" else open_links(options, speed or PACE_MAX, options.instance)
