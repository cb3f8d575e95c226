"""Flies a scenario in lockstep and judges it: `run_scenario(scenario)`. Start here.

In: a `Scenario`, a seed, and where logs go. Out: a `ScenarioResult`, the same at each run of the same
scenario and seed, and with a folder a ULog and a tlog of the same bytes.
"""

import inspect
import json
import sys
import traceback
from collections.abc import Callable
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

from common.clock import process_time_s
from common.files import write_whole
from mission.client import ScriptError
from mission.console.option_checks import UserError
from mission.log.flight_summary import planned_path
from mission.plan.plan_file import PlanError, read_plan
from mission.scenario.flight.building import Built
from mission.scenario.flight.fault_timeline import FaultTimeline
from mission.scenario.flight.flying import fly_steps
from mission.scenario.flight.run import Run, VehicleRun, Witness
from mission.scenario.judging.judge import judge
from mission.scenario.result import ScenarioResult
from mission.scenario.scenario import Scenario, Vehicle
from mission.script import fly_plan
from mission.view.replay_file import keep_for_replay

AFTER_S = 1.0  # that the flight goes on when all scripts are done, so that what they ended with is seen
RESULT_FILE = "result.json"


def run_scenario(
    scenario: Scenario, seed: int | None = None, *, folder: Path | None = None, file: str = ""
) -> ScenarioResult:
    """Flies a scenario once, and judges it.

    Args:
        scenario: what is flown; paths in it are as they are, `scenario_file.read_scenario` makes them absolute.
        seed: None: the first of the scenario's.
        folder: where `flight.ulg`, `flight.tlog` and `result.json` are written; None writes nothing.
        file: where the scenario came from, for the result.

    Raises:
        UserError: it cannot be flown as it is: no such airframe, parameter, policy, plan or function.
    """
    flown = UnderWay(scenario, scenario.seeds[0] if seed is None else seed, folder)
    try:
        flown.start()
        flown.fly(flown.are_orders_done)
    except BaseException:
        flown.give_up()
        raise
    return flown.end(file)


class UnderWay:
    """A scenario that is being flown: built, told what to do, advanced, ended and judged.

    Args:
        scenario: what is flown.
        seed: of noise, turbulence and the owner's path.
        folder: where logs and the result go; None writes nothing.

    Raises:
        UserError: it cannot be flown as it is.
    """

    def __init__(self, scenario: Scenario, seed: int, folder: Path | None) -> None:
        self._begun_s = process_time_s()
        self.seed, self._folder = seed, folder
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
        self._built = Built(scenario, seed, folder)
        try:
            self.run = _run_of(scenario, self._built)
            self.faults = FaultTimeline(self.run, scenario.faults)
        except BaseException:
            self._built.close()
            raise
        self._over_us = self._end_us = round(scenario.time_max_s * 1e6)

    def start(self) -> None:
        """Starts what each vehicle was told to do.

        Raises:
            UserError: a plan or a function is not there.
        """
        _start(self.run)
        if self._folder is not None:
            for vehicle in self.run.vehicles:
                keep_for_replay(vehicle.flight, _path(vehicle))

    def fly(self, is_over: Callable[[], bool]) -> None:
        """Until `is_over()`, asked after each frame, or until the scenario's time is up."""
        witnesses = [vehicle.witness for vehicle in self.run.vehicles]
        run, faults, end_us = self.run, self.faults, self._end_us

        def is_enough(flight: Any) -> bool:
            time_us = flight.time_us
            faults.frame(time_us)
            if run.watch is not None:
                run.watch.frame()
            for witness in witnesses:
                witness.look()
            return is_over() or bool(time_us >= end_us)

        flown: Any = self._built.flights[0] if self._built.fleet is None else self._built.fleet
        flown.run(is_enough)

    def are_orders_done(self) -> bool:
        """Whether all scripts are done, and a little more."""
        running = [vehicle.running for vehicle in self.run.vehicles if vehicle.running is not None]
        time_us = self.run.vehicles[0].flight.time_us
        if self._over_us == self._end_us and running and all(each.is_done for each in running):
            self._over_us = min(time_us + round(AFTER_S * 1e6), self._end_us - 1)
        return bool(time_us >= self._over_us)

    def give_up(self) -> None:
        """Ends it without a result."""
        for vehicle in self.run.vehicles:
            if vehicle.running is not None:
                vehicle.running.cancel()
        self._built.close()

    def end(self, file: str = "", error: str = "") -> ScenarioResult:
        """Ends it, and judges it.

        Args:
            file: where the scenario came from.
            error: why it did not come to its end, besides what its scripts say.
        """
        run, folder = self.run, self._folder
        error = error or _error(run, self.faults)
        simulated_s = run.time_s
        checks = judge(run, self._built.close(), simulated_s)
        texts = [(time_s, vehicle.number, text) for vehicle in run.vehicles for time_s, text in vehicle.witness.texts]
        result = ScenarioResult(
            name=run.scenario.name or "scenario",
            file=file,
            seed=self.seed,
            checks=checks,
            error=error,
            simulated_s=simulated_s,
            cpu_s=process_time_s() - self._begun_s,
            texts=tuple(sorted(texts)),
            events=tuple(run.events),
            folder="" if folder is None else str(folder),
            ulogs=() if folder is None else tuple(str(path) for path in sorted(folder.rglob("flight*.ulg"))),
            tlogs=() if folder is None else tuple(str(path) for path in sorted(folder.rglob("flight.tlog"))),
            figures=dict(run.figures),
        )
        if folder is not None:
            write_result(folder, result)
        return result


def write_result(folder: Path, result: ScenarioResult) -> None:
    """Writes the result of a run beside its logs."""
    write_whole(folder / RESULT_FILE, (json.dumps(result.as_json(), indent=1) + "\n").encode())


def _run_of(scenario: Scenario, built: Built) -> Run:
    vehicles = [
        VehicleRun(number, vehicle, flight, Witness(flight))
        for number, (vehicle, flight) in enumerate(zip(scenario.fleet, built.flights, strict=True), 1)
    ]
    return Run(scenario, vehicles, built.companion, built.stations)


def _start(run: Run) -> None:
    """Starts what each vehicle was told to do.

    Raises:
        UserError: a plan or a function is not there.
    """
    for vehicle in run.vehicles:
        order = _order(run, vehicle, vehicle.config)
        if order is not None:
            vehicle.running = vehicle.drone.start(order)


def _order(run: Run, vehicle: VehicleRun, config: Vehicle) -> Any:
    if config.plan is not None:
        try:
            vehicle.plan = read_plan(config.plan)
        except PlanError as error:
            raise UserError(str(error)) from error
        return fly_plan(vehicle.drone, vehicle.plan)
    if config.python is not None:
        return _python(config.python, run, vehicle)
    return fly_steps(run, vehicle, config.script) if config.script else None


def _python(text: str, run: Run, vehicle: VehicleRun) -> Any:
    """The coroutine of somebody's own; what it raises is its error, not ours."""
    function = function_of(text)
    has_run = len(inspect.signature(function).parameters) > 1

    async def flown() -> None:
        try:
            await (function(vehicle.drone, run) if has_run else function(vehicle.drone))
        except ScriptError:
            raise
        except (Exception, SystemExit) as error:
            own = [frame for frame in traceback.extract_tb(error.__traceback__) if frame.filename in text]
            raise ScriptError(
                f"{text}, line {own[-1].lineno if own else 0}: {type(error).__name__}: {error}"
            ) from error

    return flown()


def function_of(text: str) -> Callable[..., Any]:
    """The coroutine that FILE.py:FUNCTION names; the file's own folder is where it finds what it imports.

    Raises:
        UserError: there is no such file or function.
    """
    file, _, name = text.rpartition(":")
    path = Path(file)
    if not path.is_file():
        raise UserError(f"{file}: no such file")
    spec = spec_from_file_location(f"scenario_script_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise UserError(f"{file}: is no Python")
    module = module_from_spec(spec)
    sys.path.insert(0, str(path.parent))
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        raise UserError(f"{file}: cannot be imported: {type(error).__name__}: {error}") from error
    finally:
        sys.path.remove(str(path.parent))
    function: Any = getattr(module, name, None)
    if not inspect.iscoroutinefunction(function):
        raise UserError(f"{file}: has no coroutine '{name}' (async def {name}(drone): ...)")
    return function  # type: ignore[no-any-return]


def _path(vehicle: VehicleRun) -> list[Any]:
    """The plan's line, for the replay."""
    if vehicle.plan is None:
        return []
    config = vehicle.flight.config
    return [point for _, point in planned_path(vehicle.plan, config.home, config.start_ne_m)]


def _error(run: Run, faults: FaultTimeline) -> str:
    """Why it was not flown to its end, or a fault that was to happen did not; "": it was."""
    found = []
    several = len(run.vehicles) > 1
    for vehicle in run.vehicles:
        who = f"vehicle {vehicle.number}: " if several else ""
        if vehicle.flight.end_reason:
            found.append(f"{who}{vehicle.flight.end_reason}")
        elif vehicle.running is not None and vehicle.running.error is not None:
            found.append(f"{who}{vehicle.running.error}")
        elif vehicle.running is not None and not vehicle.running.is_done:
            vehicle.running.cancel()
            found.append(f"{who}the script was not done after {run.scenario.time_max_s:g} s")
    asked = run.scenario.fails_with
    if asked:
        return (
            ""
            if any(asked in text for text in found)
            else f"the script was to fail with '{asked}'" + "".join(f", but: {text}" for text in found[:1])
        )
    found += [f"a fault never happened: {fault.when or f'at {fault.at:g} s'}" for fault in faults.left]
    return "; ".join(found)


__all__ = ["RESULT_FILE", "ScriptError", "function_of", "run_scenario", "write_result"]
