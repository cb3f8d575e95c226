"""The flight of a test: what the fixture `flight` is. Here in lockstep, in memory."""

import shutil
from abc import ABC, abstractmethod
from collections.abc import Coroutine
from pathlib import Path
from typing import Any

from common.attitude import Vector
from mission.client import ScriptTimeout
from mission.console.option_checks import UserError
from mission.pytest_plugin.marker import part_of
from mission.scenario.parts.checks import Check
from mission.scenario.parts.faults import Fault
from mission.scenario.result import ScenarioResult
from mission.scenario.runner import UnderWay
from mission.scenario.scenario import Scenario
from mission.script import Drone


class Kept:
    """A coroutine whose end is kept, whatever it was: it must not leave the frame that it ends in."""

    def __init__(self, coroutine: Coroutine[Any, Any, Any]) -> None:
        self._coroutine = coroutine
        self._result: Any = None
        self._error: BaseException | None = None

    async def run(self) -> None:
        try:
            self._result = await self._coroutine
        except GeneratorExit:
            raise
        except BaseException as error:
            self._error = error

    def give_up(self, reason: str) -> None:
        """Ends it where it waits, with an error that says why."""
        self._error = ScriptTimeout(reason)
        try:
            self._coroutine.throw(self._error)
        except BaseException as error:
            self._error = error if error is self._error else ScriptTimeout(reason)

    def outcome(self) -> Any:
        """What it returned; or what it raised is raised."""
        if self._error is not None:
            raise self._error
        return self._result


class TestedFlight(ABC):
    """What tests have of their flight, wherever it takes place."""

    __test__ = False  # of pytest, to whoever imports it

    fleet: list[Drone]
    scenario: Scenario
    world: Any

    @property
    @abstractmethod
    def title(self) -> str:
        """Who flew, where, and how long."""

    @abstractmethod
    def check(self, check: Check | None = None, **keys: Any) -> None:
        """Asks something of this flight, which is judged at its end: `flight.check(tilt={"max": 30}, from_="up")`."""

    @abstractmethod
    def run(self, coroutine: Coroutine[Any, Any, Any]) -> Any:
        """Runs a coroutine to its end, in the vehicle's time; what it returns."""

    @abstractmethod
    def finish_orders(self) -> None:
        """Flies on until the plan or script of the marker is done."""

    @abstractmethod
    def end(self, error: str) -> ScenarioResult:
        """Ends the flight, and judges it.

        Args:
            error: why the test failed; "": it did not.
        """

    @abstractmethod
    def close(self) -> None:
        """Gives back what it holds; without effect on what has been."""


class LockstepFlight(TestedFlight):
    """A flight in memory, as fast as the machine can; the same each time.

    Args:
        scenario: what is flown.
        seed: of noise, turbulence and the owner's path.
        folder: where logs go; None writes none.
        file: of the test.

    Raises:
        UserError: it cannot be flown as it is.
    """

    __test__ = False

    def __init__(self, scenario: Scenario, seed: int, folder: Path | None, file: str) -> None:
        self._folder, self._file, self._is_over = folder, file, False
        try:
            self._under_way = UnderWay(scenario, seed, folder)
        except UserError:
            self._forget_logs()
            raise
        self._run = self._under_way.run
        self.scenario, self.seed = scenario, seed
        self.fleet = self._run.drones
        self.world = self._run.vehicles[0].flight.world
        self._under_way.start()

    @property
    def title(self) -> str:
        scenario, fleet = self.scenario, [vehicle.airframe for vehicle in self.scenario.fleet]
        who = f"{len(fleet)} x {fleet[0]}" if len(fleet) > 1 and len(set(fleet)) == 1 else ", ".join(fleet)
        wind = f", wind {scenario.wind.speed_m_s:g} m/s" if scenario.wind.speed_m_s else ""
        world = scenario.world.file or scenario.world.kind
        return f"{who} in the world {world}{wind}, seed {self.seed}, {self.time_s:.1f} s flown"

    @property
    def time_s(self) -> float:
        """Simulated."""
        return self._run.time_s

    def pos_ned(self, vehicle: int = 1) -> Vector:
        """[m] The true position of a vehicle, from 1."""
        return self._run.pos_ned(vehicle)

    def mark(self, name: str) -> None:
        """Gives this moment a name, which checks may begin or end at."""
        self._run.mark(name)

    def check(self, check: Check | None = None, **keys: Any) -> None:
        asked = part_of(Check, keys if check is None else check, "flight.check")
        scenario = self._run.scenario
        self.scenario = self._run.scenario = scenario.model_copy(update={"checks": (*scenario.checks, asked)})

    def fail(self, **keys: Any) -> None:
        """Makes something go wrong from now on: `flight.fail(sensor={"name": "gnss", "mode": "off"}, for_s=2)`."""
        self._under_way.faults.add(part_of(Fault, {"at": self.time_s, **keys}, "flight.fail"))

    async def orders_done(self) -> None:
        """Returns when the plan or script of the marker has been flown to its end.

        Raises:
            ScriptError: it failed.
        """
        orders = [each for vehicle in self._run.vehicles if (each := vehicle.running) is not None]
        await self.fleet[0].until(
            lambda: all(each.is_done for each in orders), self.scenario.time_max_s, "plan or script done"
        )
        for each in orders:
            if each.error is not None:
                raise each.error

    def run(self, coroutine: Coroutine[Any, Any, Any]) -> Any:
        kept = Kept(coroutine)
        running = self.fleet[0].start(kept.run())
        self._under_way.fly(lambda: running.is_done)
        if not running.is_done:
            lost = self._run.vehicles[0].flight.end_reason
            kept.give_up(lost or f"not done after {self.time_s:g} s of simulated time (time_max_s)")
            running.cancel()
        return kept.outcome()

    def finish_orders(self) -> None:
        if any(vehicle.running is not None for vehicle in self._run.vehicles):
            self._under_way.fly(self._under_way.are_orders_done)

    def end(self, error: str) -> ScenarioResult:
        self._is_over = True
        return self._under_way.end(self._file, error)

    def close(self) -> None:
        if not self._is_over:
            self._is_over = True
            self._under_way.give_up()
            self._forget_logs()

    def _forget_logs(self) -> None:
        if self._folder is not None:
            shutil.rmtree(self._folder)
