"""The column left of the scene: status, onboard image and plots.

In: moments. Out: viser's GUI elements, each renewed at its own slow rate: text at 4 Hz, plots at 2 Hz.
"""

import re
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray
from viser import uplot

from autopilot.interface.vehicle_state import Severity
from mission.console.status_texts import Text
from mission.log.replay_topic import ACTIONS
from mission.view.flight_snapshot import Moment

PLOT_PERIOD_S = 0.5  # simulated time between two points that are plotted
PLOT_POINTS = 600
_COLOURS = ("#2868dc", "#e87820", "#3aa655", "#8a4fbf")
TEXTS_SHOWN = 8
ACTION_NAMES = ("ahead", "right", "down", "yaw rate")

Read = Callable[[Moment], tuple[float, ...]]
PLOTS: dict[str, tuple[tuple[str, ...], Read]] = {
    "distance to owner [m]": (("distance",), lambda moment: (moment.distance_m,)),
    "height above ground [m]": (("height",), lambda moment: (float(moment.row["height_m"]),)),
    "speed [m/s]": (("speed",), lambda moment: (moment.speed_m_s,)),
    "battery [%]": (("battery",), lambda moment: (100.0 * float(moment.row["battery"]),)),
    "policy's action": (ACTION_NAMES, lambda moment: tuple(float(value) for value in moment.row["action"])),
}
"""What is plotted over time: title, names of the lines, values."""


class Panel:
    """Status, image and plots of one flight.

    Args:
        server: of the page.
        has_owner: whether somebody is followed; without, there is no distance and no action to plot.
        drives: the vehicle stays on the ground; its height is not told.
    """

    def __init__(self, server: viser.ViserServer, *, has_owner: bool, drives: bool = False) -> None:
        self._gui, self._drives = server.gui, drives
        self._image: viser.GuiImageHandle | None = None
        panel = self._gui.add_panel()
        with panel.add_tab("Flight"):
            self._status = self._gui.add_markdown("waiting for the flight")
            self._texts_folder = self._gui.add_folder("What the vehicle says", visible=False)
            with self._texts_folder:
                self._texts = self._gui.add_markdown("")
            self._image_folder = self._gui.add_folder("Onboard camera", visible=False)
            self._plots = [
                Plot(self._gui, title, names, read)
                for title, (names, read) in PLOTS.items()
                if (has_owner or not (title.startswith("distance") or len(names) == ACTIONS))
                and not (drives and title.startswith("height"))
            ]
        panel.dock_left()
        panel.expand()  # on a phone it would be closed
        self._gui.main_panel.dock_right()

    def show_status(self, moment: Moment, lines: tuple[str, ...]) -> None:
        """Renews the text."""
        armed = "armed" if moment.row["is_armed"] else "disarmed"
        rows = [
            f"**{moment.mode_name}**, {armed}, {moment.time_s:.1f} s",
            ("" if self._drives else f"height {moment.row['height_m']:.1f} m, ") + f"speed {moment.speed_m_s:.1f} m/s, "
            f"battery {100.0 * moment.row['battery']:.0f} %",
        ]
        if moment.has_owner:
            rows.append(f"distance to owner {moment.distance_m:.1f} m")
        self._status.content = "  \n".join((*rows, *map(plain, lines)))

    def show_texts(self, texts: Sequence[Text]) -> None:
        """Renews what the vehicle has said: the newest first, what is urgent in bold."""
        self._texts_folder.visible = True
        self._texts.content = "  \n".join(_text_line(text) for text in reversed(texts[-TEXTS_SHOWN:]))

    def show_image(self, rgb: NDArray[np.uint8]) -> None:
        """Renews the onboard image; any thread may do so."""
        if self._image is None:
            with self._image_folder:
                self._image = self._gui.add_image(rgb, format="jpeg", jpeg_quality=80)
            self._image_folder.visible = True
        else:
            self._image.image = rgb

    def note(self, moment: Moment) -> None:
        """Adds a point to each plot."""
        for plot in self._plots:
            plot.note(moment)

    def note_row(self, row: Any) -> None:
        """Adds a point to each plot, from a row of a recording."""
        self.note(Moment(row))

    def draw_plots(self) -> None:
        """Sends the plots."""
        for plot in self._plots:
            plot.draw()


def _text_line(text: Text) -> str:
    shown = plain(str(text).strip())
    return f"**{shown}**" if text.severity <= Severity.ERROR else shown


def plain(text: str) -> str:
    """Text as Markdown that shows it letter by letter: clients choose it, and viser would run scripts in it."""
    return re.sub(r"([!-/:-@\[-`{-~])", r"\\\1", " ".join(text.split()))


class Plot:
    """One chart over time."""

    def __init__(self, gui: viser.GuiApi, title: str, names: tuple[str, ...], read: Read) -> None:
        self._read = read
        self._rows: deque[tuple[float, ...]] = deque(maxlen=PLOT_POINTS)
        series = [
            uplot.Series(label="s"),
            *(
                uplot.Series(label=name, stroke=colour, width=1.5)
                for name, colour in zip(names, _COLOURS, strict=False)
            ),
        ]
        empty = tuple(np.zeros(1) for _ in series)
        self._handle = gui.add_uplot(
            empty,
            tuple(series),
            title=title,
            scales={"x": uplot.Scale(time=False)},
            axes=(uplot.Axis(label="s", labelSize=14, labelFont="11px sans-serif", size=28), uplot.Axis(size=44)),
            legend=uplot.Legend(show=len(names) > 1),
            height=150,
        )

    def note(self, moment: Moment) -> None:
        self._rows.append((moment.time_s, *self._read(moment)))

    def draw(self) -> None:
        if self._rows:
            self._handle.data = tuple(np.array(column) for column in zip(*self._rows, strict=True))
