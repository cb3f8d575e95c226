"""Several flights in one world on one clock, advanced frame by frame.

In a frame all vehicles pass their ticks before any flight controller runs its Python part; programs of others that fly
some of them compute at the same time, and all wait for who is late. What one sees of another is
where it was when all were last written: once a frame, and after each tick of vehicles that may touch. So the order in
which they are advanced cannot matter, and a vehicle that is out of reach of all others flies as it would alone.
"""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Self

from autopilot.mavlink.transport.links import Link, LinkSource
from autopilot.mavlink.wire.signing import SigningConfig
from common.clock import Pacer, wall_unix_us
from common.kernels import FRAME_TICKS, FRAME_US
from mission.boards.board_session import BoardRun
from mission.fleet.transponders import Transponders
from mission.flight import Flight
from mission.flight_base import FlightBase, advance_together
from mission.flight_config import FlightConfig
from mission.log.flight_recorder import History
from sim.bodies.vehicles import class_of
from sim.world.neighbours import NeighbourTable
from sim.world.world import WorldMap, shared_world


class FleetFlight:
    """The vehicles of one world.

    Args:
        configs: of each (`mission.fleet.roster`).
        world: the ground of all.
        boards: the program of others that flies each; None: our own flight controller.
        links: of each vehicle, besides its memory link.
        signing: of each vehicle; None: each keeps a key in memory.
        folder: each vehicle has a folder in it where its logs are written, `vehicle-1` first; None writes nothing.
        has_transponders: they hear each other by ADS-B.
        has_camera_threads: photos are rendered while the flight goes on.

    Raises:
        UserError: a program's port is taken, or it cannot be started; nothing is left open.
    """

    def __init__(
        self,
        configs: Sequence[FlightConfig],
        world: WorldMap,
        *,
        boards: Sequence[BoardRun | None] = (),
        links: Sequence[Sequence[Link | LinkSource]] = (),
        signing: Sequence[SigningConfig | None] = (),
        folder: Path | None = None,
        has_transponders: bool = False,
        has_camera_threads: bool = False,
    ) -> None:
        self.world = world
        self.time_us = 0
        self._pacer = Pacer(None)
        self._neighbours = NeighbourTable(len(configs))
        self.flights: list[FlightBase] = []
        boards = boards or [None] * len(configs)
        with ExitStack() as made:
            for i, (config, board) in enumerate(zip(configs, boards, strict=True)):
                own_folder = None if folder is None else folder / f"vehicle-{i + 1}"
                if own_folder is not None:
                    own_folder.mkdir(parents=True, exist_ok=True)
                parts: dict[str, Any] = {
                    "links": links[i] if links else (),
                    "folder": own_folder,
                    "world": shared_world(world, self._neighbours.seen_by(i)),
                }
                if board is None or board.is_ours:
                    parts["signing"] = signing[i] if signing else None
                    parts["has_camera_thread"] = has_camera_threads
                flight: FlightBase = Flight(config, **parts) if board is None else board.make_flight(config, **parts)
                made.callback(flight.close)
                self._join(i, flight)
                self.flights.append(flight)
            for flight, board in zip(self.flights, boards, strict=True):
                if board is not None:
                    board.launch(flight)
            made.pop_all()
        self._transponders = Transponders(self.flights) if has_transponders else None

    def _join(self, i: int, flight: FlightBase) -> None:
        rows: Any = flight.rig.rows
        outline = class_of(flight.airframe).body.outline(rows["model"][0])
        self._neighbours.join(i, rows["truth"], rows["tick"], outline)

    def frame(self) -> None:
        """Advances all vehicles by 20 ms."""
        flights, neighbours = self.flights, self._neighbours
        for flight in flights:
            flight.begin_frame()
        near = neighbours.near()
        advance_together([flight for i, flight in enumerate(flights) if i not in near], range(FRAME_TICKS))
        for tick in range(FRAME_TICKS) if near else ():
            advance_together([flights[i] for i in near], range(tick, tick + 1))
            neighbours.write(near)
        neighbours.write()
        self.time_us += FRAME_US
        if self._transponders is not None:
            self._transponders.frame(self.time_us)
        for flight in flights:
            flight.end_frame()

    def run(
        self,
        is_over: Callable[[Self], bool],
        *,
        speed: float | None = None,
        on_frame: Callable[[Self], None] | None = None,
    ) -> None:
        """Advances until `is_over(self)`, or all are lost; as `Flight.run`."""
        self.change_speed(speed)
        if speed is not None and self.time_us == 0:
            boot_unix_us = wall_unix_us()
            for flight in self.flights:
                if isinstance(flight, Flight):
                    flight.host.boot_unix_us = boot_unix_us
        while not (all(flight.end_reason for flight in self.flights) or is_over(self)):
            self._pacer.wait_until(self.time_us)
            self.frame()
            if on_frame is not None:
                on_frame(self)

    def change_speed(self, speed: float | None) -> None:
        """Simulated seconds per second from the next frame on, while it runs; None: as fast as possible."""
        self._pacer = Pacer(speed)
        for flight in self.flights:
            flight.change_speed(speed)

    def close(self) -> list[History]:
        """Completes the logs, closes the links and returns the history of each."""
        return [flight.close() for flight in self.flights]
