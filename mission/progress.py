"""The line of figures that is shown while flying."""

from math import dist

import numpy as np
from rich.table import Table

from autopilot.vehicle import Mode
from common.clock import wall_time_s
from mission.client import Running
from mission.flight import Flight

PROGRESS_PERIOD_S = 0.2
HEADINGS_BEFORE = ("time\ns", "mode\n", "armed\n")
HEADINGS_AFTER = ("north\nm", "east\nm", "height\nm", "speed\nm/s", "battery\n%", "pace\nx")


class Progress:
    """The line of figures shown while flying; at most 80 columns wide."""

    def __init__(self, flight: Flight, running: Running | None) -> None:
        self._flight = flight
        self._running = running
        self._frames = 0
        self._shown_wall_s = wall_time_s()
        self._shown_us = 0

    def is_due(self) -> bool:
        self._frames += 1
        return self._frames % 5 == 0 and wall_time_s() - self._shown_wall_s >= PROGRESS_PERIOD_S

    def table(self) -> Table:
        now_s = wall_time_s()
        state = self._flight.controller.state
        rate = (self._flight.time_us - self._shown_us) * 1e-6 / max(now_s - self._shown_wall_s, 1e-6)
        self._shown_wall_s, self._shown_us = now_s, self._flight.time_us
        north, east, down = state.estimate.pos_ned
        velocity = state.estimate.vel_ned
        table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0))
        for heading in (*HEADINGS_BEFORE, "item\n" if self._flight.owner is None else "owner\nm", *HEADINGS_AFTER):
            table.add_column(heading, justify="right", no_wrap=True)
        table.add_row(
            f"{self._flight.time_us * 1e-6:.1f}",
            Mode(state.mode).name,
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
