"""Honeyguide's plugin for pytest: vehicles that tests fly in simulated time, and scenario files as tests.

pytest loads this file in every run where Honeyguide is installed. It imports nothing of Honeyguide before a test asks
for a vehicle, a test has the marker, or a scenario file is collected; what it does then is in `mission/pytest_plugin`.
It lies beside the packages so that a repository with a `mission` of its own has that one.
"""

import inspect
from collections.abc import Generator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from mission.pytest_plugin.tested_flight import TestedFlight
    from mission.script import Drone

MARKER = "honeyguide"
FLIGHT, CHOICE = "_honeyguide_flight", "_honeyguide_choice"  # fixtures behind those that tests ask for
COROUTINE = pytest.StashKey[Any]()
"""The function of a test that flies, as its author wrote it: other plugins may wrap it."""
SHOWN = pytest.StashKey[str]()
"""What is shown of the flight of a test that failed."""


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("honeyguide", "flights of Honeyguide")
    group.addoption(
        "--honeyguide-keep", type=Path, metavar="FOLDER", help="keep logs and results of flights that failed in FOLDER"
    )
    group.addoption("--honeyguide-keep-all", action="store_true", help="of all flights, with --honeyguide-keep")
    group.addoption(
        "--link",
        metavar="ADDRESS",
        help="fly the vehicle at this MAVLink link in place of a simulated one: udpin:127.0.0.1:14550, "
        "udpout:HOST:PORT, tcp:HOST:PORT, serial:/dev/NAME:BAUD",
    )


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line(
        "markers",
        f"{MARKER}(airframe=, wind=, world=, seed=, faults=, …): what a flown test flies; all keys of a scenario "
        "file, and seeds=, airframes=, winds= to fly it with each",
    )
    if config.getoption("honeyguide_keep_all") and config.getoption("honeyguide_keep") is None:
        raise pytest.UsageError("--honeyguide-keep-all: needs --honeyguide-keep FOLDER")


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    if not file_path.name.endswith(".scenario.yaml"):
        return None
    is_kept = (file_path.parent / "result.json").is_file()  # a run that failed: flown when it is asked for
    if is_kept and not parent.session.isinitpath(file_path):
        return None
    from mission.pytest_plugin.scenario_items import ScenarioFileCollector

    return ScenarioFileCollector.from_parent(parent, path=file_path)


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Flies a test with each of the seeds, airframes and winds that its marker names."""
    if metafunc.definition.get_closest_marker(MARKER) is None:
        return
    from mission.pytest_plugin.marker import choices, given_keys
    from mission.pytest_plugin.refusal import refused

    with refused():
        found = choices(given_keys(metafunc.definition))
    if found and FLIGHT in metafunc.fixturenames:
        metafunc.parametrize(CHOICE, list(found.values()), ids=list(found), indirect=True)


def pytest_itemcollected(item: pytest.Item) -> None:
    if isinstance(item, pytest.Function) and FLIGHT in item.fixturenames:
        item.stash[COROUTINE] = item.function


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_fixture_setup(fixturedef: Any, request: pytest.FixtureRequest) -> Generator[None, Any, Any]:
    """Runs an `async def` fixture that asks for a vehicle in the vehicle's time."""
    own = fixturedef.func
    if not (inspect.iscoroutinefunction(own) or inspect.isasyncgenfunction(own)) or not _flies(fixturedef, request):
        return (yield)
    from mission.pytest_plugin.running import flown_fixture

    fixturedef.func = flown_fixture(own, request)
    try:
        return (yield)
    finally:
        fixturedef.func = own


def _flies(fixturedef: Any, request: pytest.FixtureRequest) -> bool:
    """Whether a fixture asks for a vehicle, or for one that does."""
    known = request.node._fixtureinfo.name2fixturedefs if isinstance(request.node, pytest.Function) else {}
    found, left = set(), list(fixturedef.argnames)
    while left:
        name = left.pop()
        if name not in found:
            found.add(name)
            left += [each for definition in known.get(name, ()) for each in definition.argnames]
    return FLIGHT in found


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> bool | None:
    """Flies a test that asks for a vehicle."""
    function = pyfuncitem.stash.get(COROUTINE, None)
    if function is None:
        return None
    from mission.pytest_plugin.running import fly_test

    given = {name: pyfuncitem.funcargs[name] for name in inspect.signature(function).parameters if name != "self"}
    fly_test(pyfuncitem, function if pyfuncitem.instance is None else function.__get__(pyfuncitem.instance), given)
    return True


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Shows the flight of a test that failed."""
    report = yield
    if COROUTINE in item.stash and report.failed and report.when != "teardown" and item.stash.get(SHOWN, ""):
        report.sections.append(("flight", item.stash[SHOWN]))
    return report


@pytest.fixture
def _honeyguide_choice(request: pytest.FixtureRequest) -> Any:
    """Seed, airframe and wind of this run of a test that is flown with several."""
    return getattr(request, "param", {})


@pytest.fixture
def _honeyguide_flight(
    request: pytest.FixtureRequest, _honeyguide_choice: dict[str, Any]
) -> Generator["TestedFlight", None, None]:
    from mission.pytest_plugin.running import prepared_flight

    flight = prepared_flight(request.node, _honeyguide_choice)
    yield flight
    flight.close()


@pytest.fixture
def flight(_honeyguide_flight: "TestedFlight") -> "TestedFlight":
    """The flight of a test: its checks, marks, faults, and the truth."""
    return _honeyguide_flight


@pytest.fixture
def vehicle(_honeyguide_flight: "TestedFlight") -> "Drone":
    """The vehicle that an `async def` test flies in simulated time; the first, of several."""
    return _honeyguide_flight.fleet[0]


@pytest.fixture
def fleet(_honeyguide_flight: "TestedFlight") -> "list[Drone]":
    """All vehicles of an `async def` test."""
    return _honeyguide_flight.fleet


@pytest.fixture
def world(_honeyguide_flight: "TestedFlight") -> Any:
    """The ground that a test flies over: `height(north_m, east_m)`, `obstacle_distance(points_ned)`."""
    return _honeyguide_flight.world
