"""What `honeyguide fly --vehicles` prints: where the vehicles are reached, how they do, and how they did."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from common.clock import wall_time_s
from mission.boards.peers import PEERS
from mission.connections import API_PORT_STEP, GROUND_PORT_STEP, TCP_PORT_STEP, api_port_of
from mission.console.terminal import print_line
from mission.fleet.fleet_flight import FleetFlight
from mission.fleet.fleet_options import Member
from mission.flight_settings import FlightOptions
from mission.log.flight_summary import Summary


def print_start(
    fleet: FleetFlight,
    members: Sequence[Member],
    options: FlightOptions,
    speed: float | None,
    folder: Path,
    console: Console,
) -> None:
    """Which vehicles there are, where they stand, and their ports."""
    table = Table("id", "airframe", "north, east", title="vehicles", title_justify="left")
    has_boards = any(member.board != "own" for member in members)
    if has_boards:
        table.add_column("flown by, at")
    if speed is not None:
        table.add_column("ground station, from")
        table.add_column("offboard API, from")
        if options.tcp_port is not None:
            table.add_column("TCP")
    for i, flight in enumerate(fleet.flights):
        north, east = flight.config.start_ne_m
        row = [str(flight.drone.system_id), flight.airframe.name, f"{north:g}, {east:g} m"]
        if has_boards:
            row.append(_flown_by(members[i], i))
        if speed is not None:
            row.append(f"UDP {options.gcs_port}, {options.gcs_port + GROUND_PORT_STEP + i}")
            row.append(f"UDP {api_port_of(options, i)}, {options.api_port + API_PORT_STEP + i}")
            if options.tcp_port is not None:
                row.append(str(options.tcp_port + TCP_PORT_STEP * i))
        table.add_row(*row)
    console.print(table)
    if speed is None:
        whose = ", our own" if has_boards else ","
        print_line(console, f"flying: lockstep{whose} without network links")
    print_line(console, f"logs: {folder}")


def _flown_by(member: Member, i_vehicle: int) -> str:
    if member.board == "own":
        return "own"
    if member.board == "betaflight":
        return "own by Betaflight"
    peer = PEERS[member.board]
    return f"{peer.name}, {peer.protocol} {peer.port_of(i_vehicle)}"


class FleetProgress:
    """The table shown while flying.

    Args:
        fleet: what flies.
    """

    def __init__(self, fleet: FleetFlight) -> None:
        self._fleet = fleet
        self._frames = 0
        self._shown_wall_s = wall_time_s()
        self._shown_us = 0
        self._reported = [0] * len(fleet.flights)  # texts of each

    def is_due(self, period_s: float) -> bool:
        """Whether so much wall clock time has gone by since it was last shown; asked every frame."""
        self._frames += 1
        return self._frames % 5 == 0 and wall_time_s() - self._shown_wall_s >= period_s

    def new_texts(self) -> list[str]:
        """What vehicles have said since this was last asked, each with its number."""
        lines = []
        for i, flight in enumerate(self._fleet.flights):
            lines += [f"{i + 1:3d} {text}" for text in flight.texts.since(self._reported[i])]
            self._reported[i] = flight.texts.count
        return lines

    def line(self) -> str:
        """Where there is no terminal: one line for all."""
        flights = self._fleet.flights
        armed = sum(flight.controller.state.is_armed for flight in flights)
        modes = [flight.controller.state.mode.name for flight in flights]
        counts = ", ".join(f"{modes.count(mode)} in {mode}" for mode in dict.fromkeys(modes))
        return f"{self._fleet.time_us * 1e-6:7.1f} s  {armed} of {len(flights)} armed, {counts}, {self._pace():.1f} x"

    def table(self) -> Table:
        """A row for each."""
        table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), caption_justify="left")
        table.caption = f"{self._fleet.time_us * 1e-6:.1f} s, {self._pace():.1f} x real time"
        for heading, width in (
            ("id", 3), ("airframe", 8), ("mode", 10), ("armed", 5), ("item", 8), ("north m", 7), ("east m", 7),
            ("height m", 8), ("m/s", 5), ("battery %", 9),
        ):  # fmt: skip
            table.add_column(heading, justify="right", no_wrap=True, min_width=width)
        for flight in self._fleet.flights:
            state = flight.controller.state
            north, east, down = state.estimate.pos_ned
            count = state.mission_count
            table.add_row(
                str(flight.drone.system_id),
                flight.airframe.name,
                "lost" if flight.end_reason else "crashed" if flight.is_crashed else state.mode.name,
                "yes" if state.is_armed else "no",
                f"{min(state.mission_current + 1, count)} of {count}" if count else "none",
                f"{north:.1f}",
                f"{east:.1f}",
                f"{-down:.1f}",
                f"{float(np.hypot(*state.estimate.vel_ned[:2])):.1f}",
                f"{100.0 * state.battery_remaining:.0f}",
            )
        return table

    def _pace(self) -> float:
        """Simulated seconds per second since it was last shown."""
        now_s = wall_time_s()
        rate = (self._fleet.time_us - self._shown_us) * 1e-6 / max(now_s - self._shown_wall_s, 1e-6)
        self._shown_wall_s, self._shown_us = now_s, self._fleet.time_us
        return rate


def print_end(fleet: FleetFlight, summaries: Sequence[Summary], folder: Path, console: Console) -> None:
    """How each did."""
    table = Table("id", "airframe", "result", "armed", "cross-track, 95 %", "battery left", title="flights")
    for flight, summary in zip(fleet.flights, summaries, strict=False):
        table.add_row(
            str(flight.drone.system_id),
            flight.airframe.name,
            summary.result,
            f"{summary.armed_s:.1f} s",
            f"{summary.cross_track_p95_m:.2f} m",
            f"{100.0 * summary.battery_remaining:.0f} %",
        )
    console.print(table)
    print_line(console, f"logs, summaries and pictures: {folder}")
