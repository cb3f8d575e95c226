"""A flown test, from its marker to its report: prepared, run, judged, kept.

In: pytest's item of a test. Out: what pytest shows of it, and with `--honeyguide-keep` a folder with its logs.
"""

import inspect
import os
import re
import shlex
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from mission.client import ScriptError
from mission.pytest_plugin.flight_text import flight_text
from mission.pytest_plugin.marker import scenario_of
from mission.pytest_plugin.refusal import refused
from mission.pytest_plugin.tested_flight import LockstepFlight, TestedFlight
from mission.scenario.flight.building import check_scenario
from mission.scenario.keeping import emptied
from mission.scenario.result import ScenarioResult
from mission.scenario.scenario import Scenario
from pytest_honeyguide import SHOWN

_FLIGHT = pytest.StashKey[TestedFlight]()
_NAME_MAX = 150  # of a folder [characters]


def prepared_flight(item: pytest.Function, choice: Mapping[str, Any]) -> TestedFlight:
    """The flight of a test, on the ground."""
    if not inspect.iscoroutinefunction(item.function):
        pytest.fail(
            f"{item.nodeid}: flies in simulated time, so that it must be a coroutine: "
            f"async def {item.originalname}(...)",
            pytrace=False,
        )
    place = f"{item.nodeid}: @pytest.mark.honeyguide"
    with refused(place):
        scenario, seed = scenario_of(item, choice)
        check_scenario(scenario, place, is_whole=False)
        flight = _flight(item, scenario, seed)
    item.stash[_FLIGHT] = flight
    return flight


def _flight(item: pytest.Function, scenario: Scenario, seed: int) -> TestedFlight:
    link = item.config.getoption("link")
    if not link:
        return LockstepFlight(scenario, seed, _folder(item), str(item.path))
    from mission.pytest_plugin.linked_flight import LinkedFlight

    return LinkedFlight(link, scenario, str(item.path))


def flown_fixture(function: Callable[..., Any], request: pytest.FixtureRequest) -> Callable[..., Any]:
    """A fixture's coroutine, as a function that runs it in the vehicle's time."""
    item = request.node
    if inspect.isasyncgenfunction(function):
        pytest.fail(
            f"{item.nodeid}: the fixture {request.fixturename} flies and yields; the flight is over with the test, so "
            "that it can only return",
            pytrace=False,
        )
    owner = getattr(function, "__self__", None)
    if owner is not None and isinstance(request.instance, type(owner)):
        function = function.__func__.__get__(request.instance)  # type: ignore[attr-defined]

    def flown(**given: Any) -> Any:
        __tracebackhide__ = True
        try:
            return item.stash[_FLIGHT].run(function(**given))
        except BaseException as raised:
            _end(item, raised)
            raise _without_ours(raised) from None

    return flown


def fly_test(item: pytest.Function, function: Callable[..., Any], given: Mapping[str, Any]) -> None:
    """Runs a test in its vehicle's time, and judges its flight."""
    __tracebackhide__ = True
    flight = item.stash[_FLIGHT]
    try:
        flight.run(function(**given))
        flight.finish_orders()
    except BaseException as raised:
        _end(item, raised)
        raise _without_ours(raised) from None
    result = _end(item, None)
    if not result.passed:
        pytest.fail("\n".join(result.failures), pytrace=False)


def _end(item: pytest.Function, error: BaseException | None) -> ScenarioResult:
    """Ends the flight, and notes what is shown of it."""
    flight = item.stash[_FLIGHT]
    del item.stash[_FLIGHT]
    result = flight.end(_said(error))
    item.stash[SHOWN] = flight_text(result, flight.title, _again(item))
    is_good = isinstance(error, pytest.skip.Exception) or result.passed
    if result.folder and is_good and not item.config.getoption("honeyguide_keep_all"):
        shutil.rmtree(result.folder)
    return result


def _said(error: BaseException | None) -> str:
    if error is None:
        return ""
    return str(error) if isinstance(error, ScriptError) else f"{type(error).__name__}: {error}"


def _without_ours(error: BaseException) -> BaseException:
    """An error of a script with a traceback that ends where the test, or what it calls, has called us."""
    own = str(Path(__file__).parents[1])
    kept, trace = None, error.__traceback__
    while trace is not None and isinstance(error, ScriptError):
        if not trace.tb_frame.f_code.co_filename.startswith(own):
            kept = trace
        trace = trace.tb_next
    if kept is not None:
        kept.tb_next = None
    return error


def _again(item: pytest.Function) -> str:
    link = item.config.getoption("link")
    options = f"--link {shlex.quote(link)} " if link else ""
    file = os.path.relpath(item.path, item.config.invocation_params.dir)
    return f"pytest {options}{shlex.quote(file + item.nodeid[item.nodeid.index('::') :])}"


def _folder(item: pytest.Function) -> Path | None:
    """Where the logs of a test go; None: nowhere."""
    keep: Path | None = item.config.getoption("honeyguide_keep")
    if keep is None:
        return None
    return emptied(keep / re.sub(r"[^\w.-]+", "-", item.nodeid).strip("-")[-_NAME_MAX:])
