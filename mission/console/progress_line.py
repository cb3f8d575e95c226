"""The line of figures that is shown while flying."""

from math import dist

import numpy as np
from rich.table import Table

from common.clock import wall_time_s
from mission.client import Running
from mission.flight_base import FlightBase

TABLE_PERIOD_S = 0.2
# Heading and least width of each column: none moves when a mode's name or a sign changes.
COLUMNS_BEFORE = (("time\ns", 7), ("mode\n", 10), ("armed\n", 5))
ITEM, OWNER = ("item\n", 8), ("to owner\nm", 8)
COLUMNS_AFTER = (
    ("north\nm", 6),
    ("east\nm", 6),
    ("height\nm", 6),
    ("speed\nm/s", 5),
    ("battery\n%", 7),
    ("pace\nx", 6),
)


class Progress:
    """The line of figures shown while flying; at most 80 columns wide."""

    def __init__(self, flight: FlightBase, running: Running | None) -> None:
        self._flight = flight
        self._running = running
        self._frames = 0
        self._shown_wall_s = wall_time_s()
        self._shown_us = 0

    def is_due(self, period_s: float) -> bool:
        """Whether so much wall clock time has gone by since it was last shown; asked every frame."""
        self._frames += 1
        return self._frames % 5 == 0 and wall_time_s() - self._shown_wall_s >= period_s

    def line(self) -> str:
        """The same figures in words, for where there is no terminal."""
        state, rate = self._flight.controller.state, self._pace()
        north, east, down = state.estimate.pos_ned
        velocity = state.estimate.vel_ned
        aim = f"item {self._aim()}" if self._flight.owner is None else f"{self._aim()} m to the owner"
        return (
            f"{self._flight.time_us * 1e-6:7.1f} s  {state.mode.name}, "
            f"{'armed' if state.is_armed else 'disarmed'}, {aim}, {north:.1f} m north, {east:.1f} m east, "
            f"{-down:.1f} m up, {float(np.hypot(velocity[0], velocity[1])):.1f} m/s, "
            f"battery {100.0 * state.battery_remaining:.0f} %, {rate:.1f} x"
        )

    def _pace(self) -> float:
        """Simulated seconds per second since it was last shown."""
        now_s = wall_time_s()
        rate = (self._flight.time_us - self._shown_us) * 1e-6 / max(now_s - self._shown_wall_s, 1e-6)
        self._shown_wall_s, self._shown_us = now_s, self._flight.time_us
        return rate

    def table(self) -> Table:
        state, rate = self._flight.controller.state, self._pace()
        north, east, down = state.estimate.pos_ned
        velocity = state.estimate.vel_ned
        table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0))
        for heading, width in (*COLUMNS_BEFORE, ITEM if self._flight.owner is None else OWNER, *COLUMNS_AFTER):
            table.add_column(heading, justify="right", no_wrap=True, min_width=width)
        table.add_row(
            f"{self._flight.time_us * 1e-6:.1f}",
            state.mode.name,
            "yes" if state.is_armed else "no",
            self._aim(),
            f"{north:.1f}",
            f"{east:.1f}",
            f"{-down:.1f}",
            f"{float(np.hypot(velocity[0], velocity[1])):.1f}",
            f"{100.0 * state.battery_remaining:.0f}",
            f"{rate:.1f}",
        )
        return table

    def _aim(self) -> str:
        """The mission's item, or how far away the owner is who is followed."""
        state, owner = self._flight.controller.state, self._flight.owner
        if owner is not None:
            return f"{dist(state.estimate.pos_ned, owner.chest_ned):.1f}"
        count = state.mission_count
        return f"{min(state.mission_current + 1, count)} of {count}" if count else "none"
