"""The program of an outside autopilot looked after: its console, its end, its silence; and its command."""

from pathlib import Path

from common.airframe import load_airframe
from mission.boards.process import PeerProcess
from mission.console.terminal import Say
from mission.flight_config import FlightConfig, start_of
from sim.boards.outside import PeerError
from sim.bodies.vehicles import class_of

PATIENCE_S = 120.0  # of wall clock time, that an autopilot may be silent
REPORTED_S = 2.0  # of silence, after which it is said what is waited for


class Watch:
    """Looks after the program while the flight goes on, and while it waits.

    Args:
        name: of the autopilot.
        say: shows a line.
        shows_console: what the program says is shown, too.
        hidden: how lines of it begin that are never shown.
    """

    def __init__(self, name: str, say: Say, *, shows_console: bool = True, hidden: tuple[str, ...] = ()) -> None:
        self._name, self._say, self._shows_console, self._hidden = name, say, shows_console, hidden
        self.hint = ""  # what it has to do to be heard
        self.process: PeerProcess | None = None
        self._is_reported = False

    def __call__(self, silent_s: float) -> None:
        if self.process is not None:
            for line in self.process.lines():
                if self._shows_console and not line.startswith(self._hidden):
                    self._say(f"{self._name} | {line}")
            self.process.check()
        if silent_s < REPORTED_S:
            self._is_reported = self._is_reported and silent_s > 0.0
        elif not self._is_reported:
            self._is_reported = True
            self._say(f"waiting for {self._name}: {self.hint}")
        if silent_s > PATIENCE_S:
            raise PeerError(f"{self._name} has been silent for {PATIENCE_S:g} s: {self.hint}")

    def close(self) -> None:
        if self.process is not None:
            self.process.close()


def filled_in(command: str, folder: Path, config: FlightConfig, instance: int) -> str:
    """A command with its names filled in.

    Args:
        command: as given.
        folder: where it runs.
        config: of the vehicle.
        instance: its number.
    """
    start, folder = start_of(config), folder.absolute()  # it runs there
    values = {
        "folder": str(folder),
        "params": str(folder / "vehicle.parm"),
        "home": f"{start.lat_deg:.7f},{start.lon_deg:.7f},{start.alt_m:.2f},0",
        "instance": str(instance),
        "vehicle": class_of(load_airframe(config.airframe)).vehicle.ardupilot.name.lower(),
    }
    for name, value in values.items():
        command = command.replace(f"{{{name}}}", value)
    return command
