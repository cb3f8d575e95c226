"""Betaflight for the length of a flight: its program found, set up, started, watched, and ended with the flight."""

import socket
from collections.abc import Callable
from contextlib import closing, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, cast

from rich.console import Console

from common.airframe import load_airframe
from common.airframes.multirotor import MultirotorAirframe
from common.clock import wall_sleep_s, wall_time_s
from common.files import write_whole
from mission.boards.betaflight_setup import CommandLine, UnansweredError, packaged_program, settings
from mission.boards.board_options import commands_of
from mission.boards.process import PeerProcess
from mission.boards.watch import Watch, filled_in
from mission.console.option_checks import UserError
from mission.console.terminal import Say, print_line
from mission.flight_base import FlightBase
from mission.flight_config import FlightConfig
from mission.flight_settings import FlightOptions
from sim.boards import betaflight_msp as msp
from sim.boards.outside import POLL_S, PeerError

if TYPE_CHECKING:
    from mission.boards.betaflight_flight import BetaflightFlight

SETUP = "setup.txt"
TRIES = 5
STARTS_S = 4.0  # of wall clock time, in which it answers; it takes half a second
ENDS_S = 10.0  # of wall clock time, in which it saves and ends
_PORTS = (9003, 9004)
_HIDDEN = ("[FLASH_ProgramWord]",)  # a line for each word that it saves
HINT = "it is asked at TCP port 5761, and its motors are expected at UDP port {port}"


class BetaflightRun:
    """See `PeerRun`; without a command it is the program of the package, if that is installed."""

    is_ours = True

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
        self._folder, self._instance, self._say = folder / board, instance, say
        program = packaged_program() if command is None else None
        self._command = command if program is None else f'"{program}"'
        self._watch = Watch("Betaflight" + whose, say, shows_console=shows_console, hidden=_HIDDEN)

    @classmethod
    def of(cls, options: FlightOptions, folder: Path, console: Console) -> Self:
        """That of a single flight."""
        command = commands_of(options.command, [options.board]).get(options.board)
        return cls(options.board, command, folder, partial(print_line, console))

    def make_flight(self, config: FlightConfig, *, has_companion: bool = False, **parts: Any) -> "BetaflightFlight":  # noqa: ARG002  (it is ours)
        """The flight, with its port open; `parts` as of `Flight`.

        Raises:
            UserError: the port is taken, or Betaflight cannot fly such a vehicle.
        """
        from mission.boards.betaflight_flight import BetaflightFlight

        try:
            self._lines = settings(cast(MultirotorAirframe, load_airframe(config.airframe)))
            flight = self._flight = BetaflightFlight(config, self._watch, **parts)
            flight.on_close = self.close
        except (PeerError, ValueError) as error:
            raise UserError(str(error)) from error
        self._watch.hint = HINT.format(port=flight.board.local_port)
        return flight

    def start(self, flight: FlightBase) -> None:
        """As `launch`, but closes the flight if there is none."""
        try:
            self.launch(flight)
        except UserError:
            flight.close()
            raise

    def launch(self, flight: FlightBase) -> None:
        """Writes its set-up; if we start the program, sets it up and starts it to fly.

        Raises:
            UserError: it cannot be started or set up.
        """
        own = self._folder
        own.mkdir(parents=True, exist_ok=True)
        write_whole(own / SETUP, "\n".join([*self._lines, "save", ""]).encode())
        if self._command is None:
            return
        command = filled_in(self._command, own, flight.config, self._instance)
        start = partial(PeerProcess, command, own, {})
        try:
            check_ports_free()
            self._say("Betaflight is being set up")
            tried(lambda: self._set_up(started(partial(start, own / "setup.log"))))
            self._watch.process = tried(lambda: started(partial(start, own / "console.log")))
            self._flight.board.is_ours = True
        except PeerError as error:
            raise UserError(str(error)) from error

    def _set_up(self, process: PeerProcess) -> PeerProcess:
        """Tells a program its settings, and waits until it has ended."""

        def check() -> None:
            process.lines()
            process.check()

        with closing(process):
            with closing(CommandLine(check)) as command_line:
                for line in self._lines:
                    command_line.say(line)
                command_line.save()
            end_s = wall_time_s() + ENDS_S
            while not process.has_ended:
                if wall_time_s() >= end_s:
                    raise UnansweredError("Betaflight does not end after it has been told to save its settings")
                process.lines()
                wall_sleep_s(0.01)
        return process

    def close(self) -> None:
        self._watch.close()


def tried(start: Callable[[], PeerProcess]) -> PeerProcess:
    """What a start gives, as often as it takes."""
    for _ in range(TRIES - 1):
        with suppress(UnansweredError):
            return start()
    return start()


def started(start: Callable[[], PeerProcess]) -> PeerProcess:
    """A program that answers.

    Raises:
        PeerError: it has ended, does not answer, or is another version.
    """
    process = start()
    end_s = wall_time_s() + STARTS_S
    try:
        while not msp.is_reached():
            process.check()
            if wall_time_s() >= end_s:
                raise UnansweredError(f"Betaflight does not answer at TCP port {msp.PORT}")
            wall_sleep_s(POLL_S)
    except PeerError:
        process.close()
        raise
    return process


def check_ports_free() -> None:
    """Betaflight itself would share its ports with another, and each would hear a part.

    Raises:
        PeerError: one is taken.
    """
    for port in _PORTS:
        with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as probe:
            try:
                probe.bind(("", port))
            except OSError as error:
                raise PeerError(f"UDP port {port} is in use ({error.strerror}): another Betaflight?") from error
