"""A script's view of several vehicles, in simulated time.

    async def script() -> None:
        async with Fleet("x500:8,rover:2") as fleet:
            await fleet.each(lambda drone: drone.wait_ready())
            await fleet.each(lambda drone: drone.arm())
            await fleet.each(lambda drone: drone.takeoff(10.0))

    asyncio.run(script())

In lockstep the world is advanced by a frame each time all that wait have had their turn: nothing sleeps, and the same
script gives the same flights. Over UDP the vehicles are another process's, on their own clock.
"""

import asyncio
import sys
from collections.abc import Callable, Coroutine, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from types import TracebackType
from typing import Any, Protocol, Self, TypeVar

from autopilot.mavlink.transport.links import LinkError, LinkRole, UdpLink
from common.clock import Pacer
from mission.boards.board_options import commands_of
from mission.client import ScriptError
from mission.connections import API_PORT_STEP, API_PORTS
from mission.fleet.fleet_boards import board_runs
from mission.fleet.fleet_flight import FleetFlight
from mission.fleet.fleet_options import boards_of, check_members, members_of
from mission.fleet.roster import SPACING_M, fleet_configs
from mission.flight_config import FlightConfig
from mission.over_udp import POLL_US, SILENCE_S, RemoteVehicle
from mission.script import Drone
from mission.simulator.flight_rig import flight_world

T = TypeVar("T")


class Vehicles(Protocol):
    """The vehicles that a fleet is made of, wherever they are."""

    @property
    def drones(self) -> Sequence[Drone]: ...

    def frame(self) -> None:
        """Lets some time pass."""

    def close(self) -> None: ...


class Fleet:
    """Several vehicles, each a `Drone`; an asynchronous context manager, inside which time passes.

    Args:
        vehicles: `AIRFRAME[@BOARD]:NUMBER,...`, or how many there are of the configuration's airframe; simulated in
            lockstep.
        config: what the flights have in common.
        spacing_m: how far apart they boot.
        folder: where their logs are written; None writes nothing.
        has_transponders: they hear each other by ADS-B.
        commands: what starts the program of others that flies some of them, as `--command`; of several kinds by their
            names. None: they are waited for.

    Raises:
        UserError: there are no such vehicles, no room for them, or no program for them.
    """

    def __init__(
        self,
        vehicles: str | int,
        config: FlightConfig | None = None,
        *,
        spacing_m: float = SPACING_M,
        folder: Path | None = None,
        has_transponders: bool = False,
        commands: str | Mapping[str, str] | None = None,
    ) -> None:
        config = config or FlightConfig()
        members = members_of(str(vehicles), config.airframe)
        check_members(config, members)
        started = commands_of(_by_board(commands), boards_of(members))
        with ExitStack() as held:
            run = folder or Path(held.enter_context(TemporaryDirectory()))
            world = flight_world(config)
            flights = FleetFlight(
                fleet_configs(config, members, world, spacing_m),
                world,
                boards=board_runs(members, started, run, _say, shows_consoles=False),
                folder=folder,
                has_transponders=has_transponders,
            )
            self._vehicles: Vehicles = Simulated(flights, held.pop_all())

    @classmethod
    def over_udp(
        cls, count: int, *, api_port: int = 14540, host: str = "127.0.0.1", silence_s: float = SILENCE_S
    ) -> Self:
        """The vehicles of another process, at most ten; 1 sends to the first port, 2 to the next.

        Args:
            count: how many.
            api_port: where the first one sends to.
            host: where they are.
            silence_s: wall clock seconds without a message after which one is given up.

        Raises:
            ScriptError: there are more.
            LinkError: a port is in use.
        """
        if not 0 < count <= API_PORTS:
            raise ScriptError(f"a fleet over UDP has 1 to {API_PORTS} vehicles: the others have no port of their own")
        fleet = cls.__new__(cls)
        fleet._vehicles = Remote(count, api_port, host, silence_s)
        return fleet

    @property
    def flights(self) -> FleetFlight:
        """What is simulated, with its truth; not over UDP."""
        if not isinstance(self._vehicles, Simulated):
            raise ScriptError("the vehicles are another process's")
        return self._vehicles.flights

    def __iter__(self) -> Iterator[Drone]:
        return iter(self._vehicles.drones)

    def __len__(self) -> int:
        return len(self._vehicles.drones)

    def __getitem__(self, index: int) -> Drone:
        return self._vehicles.drones[index]

    async def each(self, action: Callable[[Drone], Coroutine[Any, Any, T]]) -> list[T]:
        """Does something with each vehicle, with all at once, and returns when all are done.

        Raises:
            ScriptError: of some vehicles, which it names; the others have done theirs.
        """
        results = await asyncio.gather(*(action(drone) for drone in self), return_exceptions=True)
        failed = []
        for drone, result in zip(self, results, strict=True):
            if isinstance(result, ScriptError):
                failed.append(f"vehicle {drone.system_id}: {result}")
            elif isinstance(result, BaseException):
                raise result
        if failed:
            raise ScriptError("; ".join(failed))
        return [result for result in results if not isinstance(result, BaseException)]

    async def sleep(self, seconds: float) -> None:
        """Lets simulated time pass."""
        await self[0].sleep(seconds)

    async def __aenter__(self) -> Self:
        self._script = asyncio.current_task()
        self._time = asyncio.create_task(self._pass_time())
        self._time.add_done_callback(self._time_has_ended)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._time.cancel()
        try:
            with suppress(asyncio.CancelledError):
                await self._time
        finally:
            self._vehicles.close()

    async def _pass_time(self) -> None:
        while True:
            self._vehicles.frame()
            await asyncio.sleep(0)

    def _time_has_ended(self, time: "asyncio.Task[None]") -> None:
        """Nothing that is awaited will happen any more: the script gets the error instead of its turn."""
        if not time.cancelled() and self._script is not None:
            self._script.cancel()


def _by_board(commands: str | Mapping[str, str] | None) -> list[str]:
    """As `--command` says it."""
    if isinstance(commands, str):
        return [commands]
    return [f"{board}={command}" for board, command in (commands or {}).items()]


def _say(text: str) -> None:
    """Whom a script waits for; their consoles are in the folder."""
    print(text, file=sys.stderr)


class Simulated:
    """Vehicles in this process.

    Args:
        flights: which.
        held: what is closed after them.
    """

    def __init__(self, flights: FleetFlight, held: ExitStack) -> None:
        self.flights, self._held = flights, held
        self.drones: Sequence[Drone] = [flight.drone for flight in flights.flights]

    def frame(self) -> None:
        """20 ms of simulated time."""
        self.flights.frame()

    def close(self) -> None:
        """Completes their logs."""
        with self._held:
            self.flights.close()


class Remote:
    """Vehicles of another process.

    Args:
        count: how many.
        api_port: where the first one sends to.
        host: where they are.
        silence_s: wall clock seconds without a message after which one is given up.
    """

    def __init__(self, count: int, api_port: int, host: str, silence_s: float) -> None:
        self._vehicles: list[RemoteVehicle] = []
        try:
            for i in range(count):
                port = api_port + i
                link = UdpLink(port + API_PORT_STEP, LinkRole.ONBOARD, host, local_port=port)
                self._vehicles.append(RemoteVehicle(link, f"UDP port {port}", system_id=i + 1, silence_s=silence_s))
        except LinkError:
            self.close()
            raise
        self.drones: Sequence[Drone] = [vehicle.drone for vehicle in self._vehicles]
        self._pacer, self._polled_us = Pacer(1.0), 0

    def frame(self) -> None:
        """What has arrived in the last milliseconds of wall clock time."""
        for vehicle in self._vehicles:
            vehicle.poll()
        self._polled_us += POLL_US
        self._pacer.wait_until(self._polled_us)

    def close(self) -> None:
        """Closes the ports."""
        for vehicle in self._vehicles:
            vehicle.close()
