"""The program of an outside autopilot looked after: its console, its end, its silence; and its command."""

from pathlib import Path

from rich.console import Console

from common.geodesy import GeoPoint
from mission.boards.process import PeerProcess
from mission.console.terminal import print_line
from sim.boards.outside import PeerError

PATIENCE_S = 120.0  # of wall clock time, that an autopilot may be silent
REPORTED_S = 2.0  # of silence, after which it is said what is waited for


class Watch:
    """Looks after the program while the flight goes on, and while it waits.

    Args:
        name: of the autopilot.
        console: where its console is shown.
        hidden: how lines of it begin that are not shown.
    """

    def __init__(self, name: str, console: Console, hidden: tuple[str, ...] = ()) -> None:
        self._name, self._console, self._hidden = name, console, hidden
        self.hint = ""  # what it has to do to be heard
        self.process: PeerProcess | None = None
        self._is_reported = False

    def __call__(self, silent_s: float) -> None:
        if self.process is not None:
            for line in self.process.lines():
                if line.startswith(self._hidden):
                    continue
                print_line(self._console, f"{self._name} | {line}")
            self.process.check()
        if silent_s < REPORTED_S:
            self._is_reported = self._is_reported and silent_s > 0.0
        elif not self._is_reported:
            self._is_reported = True
            print_line(self._console, f"waiting for {self._name}: {self.hint}")
        if silent_s > PATIENCE_S:
            raise PeerError(f"{self._name} has been silent for {PATIENCE_S:g} s: {self.hint}")

    def close(self) -> None:
        if self.process is not None:
            self.process.close()


def filled_in(command: str, folder: Path, home: GeoPoint, instance: int) -> str:
    """A command with its names filled in."""
    values = {
        "folder": str(folder),
        "params": str(folder / "vehicle.parm"),
        "home": f"{home.lat_deg:.7f},{home.lon_deg:.7f},{home.alt_m:.2f},0",
        "instance": str(instance),
    }
    for name, value in values.items():
        command = command.replace(f"{{{name}}}", value)
    return command
