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

TOLD = pytest.StashKey[str]()
"""What is shown of the flight of a test that failed."""
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
        check_scenario(scenario, place)
        flight = LockstepFlight(scenario, seed, _folder(item), str(item.path))
    item.stash[_FLIGHT] = flight
    return flight


def fly_test(item: pytest.Function, function: Callable[..., Any], given: Mapping[str, Any]) -> None:
    """Runs a test in its vehicle's time, and judges its flight."""
    __tracebackhide__ = True
    flight = item.stash[_FLIGHT]
    del item.stash[_FLIGHT]
    error: BaseException | None = None
    try:
        flight.run(function(**given))
        flight.finish_orders()
    except BaseException as raised:
        error = raised
    result = flight.end(_said(error))
    item.stash[TOLD] = flight_text(result, flight.scenario, _again(item))
    has_failed = not result.passed and not isinstance(error, pytest.skip.Exception)
    if result.folder and not (has_failed or item.config.getoption("honeyguide_keep_all")):
        shutil.rmtree(result.folder)
    if error is not None:
        raise _without_ours(error) if isinstance(error, ScriptError) else error
    if has_failed:
        pytest.fail("\n".join(result.failures), pytrace=False)


def _said(error: BaseException | None) -> str:
    if error is None:
        return ""
    return str(error) if isinstance(error, ScriptError) else f"{type(error).__name__}: {error}"


def _without_ours(error: ScriptError) -> ScriptError:
    """With a traceback that ends where the test, or what it calls, has called us."""
    own = str(Path(__file__).parents[1])
    kept, trace = None, error.__traceback__
    while trace is not None:
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
