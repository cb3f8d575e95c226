"""The flight of a command, `honeyguide fly` or `follow`: shown, advanced to its end, and its logs closed.

In: a flight that has not begun, and when it is over. Out: the line of progress, the vehicle's texts, the live page, and
what its replay needs in its log. Ctrl-C, SIGTERM and a closed terminal end it as its own end does.
"""

import gc
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from rich.console import Console
from rich.live import Live
from rich.table import Table

from common.files import write_to_nowhere
from mission.client import Running
from mission.console.interrupts import signals_interrupt
from mission.console.progress_line import TABLE_PERIOD_S, Progress
from mission.console.terminal import LINE_PERIOD_S, print_line
from mission.flight_base import FlightBase
from mission.log.flight_recorder import History
from mission.run_folder import OwnFiles
from mission.view.replay_file import keep_for_replay

if TYPE_CHECKING:
    from mission.foxglove.outputs import FoxgloveOutputs
    from mission.view.page import PageServer
    from mission.view.pose_goals import PoseGoals


class FlightSession:
    """One flight, from before its first frame until its logs are complete.

    Args:
        flight: what flies.
        speed: simulated seconds per second; None: as fast as possible.
        page: where it is shown live; None: nowhere.
        folder: of the run.
        console: where progress is shown.
        path_ned: [m] (n, 3) of its plan.
        action: what a policy on board chose last.
        score: lines about it on the live page.
        goals: where the page can send its companion.
        foxglove: what else shows it.
    """

    def __init__(
        self,
        flight: FlightBase,
        speed: float | None,
        page: "PageServer | None",
        folder: Path,
        console: Console,
        *,
        path_ned: Sequence[Any] = (),
        action: Callable[[], Any] = lambda: None,
        score: Callable[[], tuple[str, ...]] = tuple,
        goals: "PoseGoals | None" = None,
        foxglove: "FoxgloveOutputs | None" = None,
    ) -> None:
        self.files = OwnFiles(folder, console)
        self._flight, self._speed, self._folder, self._console = flight, speed, folder, console
        keep_for_replay(flight, path_ned, action)
        self._foxglove = foxglove
        if foxglove is not None:
            foxglove.begin(flight, folder, path_ned, has_camera_thread=speed is not None)
            if foxglove.url:
                print_line(console, f"Foxglove connects to: {foxglove.url}")
        self._view = None
        if page is not None:
            from mission.view.live import LiveView

            self._view = LiveView(flight, page, speed=speed, path_ned=path_ned, action=action, score=score, goals=goals)

    def fly(
        self,
        is_over: Callable[[FlightBase], bool],
        running: Running | None,
        watchers: Sequence[Callable[[], None]] = (),
    ) -> History:
        """Advances the flight to its end and closes its logs.

        Args:
            is_over: asked after each frame.
            running: the script that flies it, for the line of progress.
            watchers: called after each frame.
        """
        shown = [each.frame for each in (self._foxglove, self._view) if each is not None]
        watching = [*watchers, *shown]
        self._advance(is_over, watching, Progress(self._flight, running))
        if self._view is not None:
            self._view.end(f"flight ended: logs in {self._folder}")
        if self._foxglove is not None:
            self._foxglove.close()
        history = self._flight.close()  # before what takes long: who is to stop may be killed soon
        for trouble in self._flight.troubles.take():
            print_line(self._console, trouble)
        return history

    def close(self) -> None:
        """Ends the live page."""
        if self._view is not None:
            self._view.close()

    def _advance(
        self, is_over: Callable[[FlightBase], bool], watchers: Sequence[Callable[[], None]], progress: Progress
    ) -> None:
        """Until the flight is over or the user stops it; shows a line of figures."""
        flight = self._flight
        reported = 0

        def new_texts() -> list[str]:
            nonlocal reported
            texts = [str(text) for text in flight.texts.since(reported)]
            reported = flight.texts.count
            return texts

        def run(on_frame: Callable[[FlightBase], None]) -> None:
            flight.run(is_over, speed=self._speed, on_frame=on_frame)

        run_shown(run, watchers, new_texts, progress, self._console)


class Shown(Protocol):
    """Figures that are shown while flying."""

    def is_due(self, period_s: float) -> bool:
        """Whether so much wall clock time has gone by since they were last shown; asked every frame."""

    def line(self) -> str:
        """Where there is no terminal."""

    def table(self) -> Table: ...


def run_shown(
    run: Callable[[Callable[[Any], None]], None],
    watchers: Sequence[Callable[[], None]],
    new_texts: Callable[[], list[str]],
    progress: Shown,
    console: Console,
) -> None:
    """Runs a flight, or several, to the end or until the user stops it, and shows how it goes.

    Args:
        run: advances to the end; calls what it is given after each frame.
        watchers: called after each frame.
        new_texts: what vehicles have said since it was last asked.
        progress: the figures.
        console: where they are shown.
    """
    gc.freeze()  # what is loaded by now stays: to look through it takes 0.2 s, in the middle of a flight
    try:
        with signals_interrupt(), Live(console=console, transient=True, auto_refresh=False) as live:

            def on_frame(_: object) -> None:
                for watch in watchers:
                    watch()
                for text in new_texts():
                    print_line(console, text)
                if console.is_terminal and progress.is_due(TABLE_PERIOD_S):
                    live.update(progress.table(), refresh=True)
                elif not console.is_terminal and progress.is_due(LINE_PERIOD_S):
                    print_line(console, progress.line())

            run(on_frame)
    except KeyboardInterrupt:
        console.print("stopped by the user")
    except SystemExit:  # rich's: who read what is printed has gone, which is as a terminal that was closed
        write_to_nowhere(1)
