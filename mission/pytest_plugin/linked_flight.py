"""The flight of a test by whatever vehicle is at a MAVLink link: `pytest --link udpin:127.0.0.1:14550`.

In: its telemetry. Out: what the test asks, over the link, on the vehicle's own clock. Checks are judged by what the
vehicle says of itself; what needs the simulation skips the test with a sentence.
"""

import re
from collections.abc import Callable, Coroutine
from dataclasses import replace
from typing import Any, NoReturn

import pytest

from autopilot.mavlink.client_end import AUTOPILOT_COMPONENT, ClientEnd
from autopilot.mavlink.transport.client_links import open_client_link
from autopilot.mavlink.transport.links import Link, LinkError
from autopilot.mavlink.wire.codec import decode
from common.clock import Pacer, wall_time_s
from mission.boards.ardupilot_drone import ArduPilotDrone
from mission.boards.px4_drone import Px4Drone
from mission.client import CLIENT_COMPONENT_ID, CLIENT_SYSTEM_ID, ScriptError
from mission.console.option_checks import UserError
from mission.over_udp import POLL_US, RemoteVehicle
from mission.plan.plan_file import read_plan
from mission.pytest_plugin.heard_telemetry import JUDGED, HeardTelemetry
from mission.pytest_plugin.marker import part_of
from mission.pytest_plugin.tested_flight import Kept, TestedFlight
from mission.scenario.flight.run import Run, VehicleRun
from mission.scenario.judging.judge import judge
from mission.scenario.parts.checks import Check
from mission.scenario.result import ScenarioResult
from mission.scenario.scenario import Scenario
from mission.script import Drone, fly_plan

DRONES: dict[int, type[Drone]] = {3: ArduPilotDrone, 12: Px4Drone}  # MAV_AUTOPILOT
FIRST_S = 30.0  # until a vehicle is heard: some are still loading
_SHORT = re.compile(r"(udpin|udpout|tcp|serial):(?!//)(.+)")  # as pymavlink and MAVProxy write them
_LANDING_S = 300.0  # that a vehicle may take to land after a test that leaves it in the air: guess


class LinkedFlight(TestedFlight):
    """See `TestedFlight`.

    Args:
        address: of the link.
        scenario: what the test would fly in simulation.
        file: of the test.

    Raises:
        UserError: there is no such link.
        pytest.exit.Exception: no vehicle is there: further tests would wait for it, too.
    """

    __test__ = False

    def __init__(self, address: str, scenario: Scenario, file: str) -> None:
        if len(scenario.fleet) > 1:
            _skip("several vehicles")
        for name in ("faults", "owner"):
            if getattr(scenario, name):
                _skip(name)
        if scenario.fleet[0].script or scenario.fleet[0].python or scenario.fleet[0].policy:
            _skip("a script, Python or a policy in the marker")
        self._address, self._file = address, file
        self._link, (system_id, autopilot) = _vehicle_at(address)
        self._vehicle = RemoteVehicle(
            self._link, address, system_id=system_id, make_drone=DRONES.get(autopilot, Px4Drone)
        )
        self.fleet = [self._vehicle.drone]
        self._heard = HeardTelemetry(self.fleet[0], autopilot)
        silence = self._poll(lambda: self._heard.is_known)
        if silence:
            self.close()
            pytest.exit(f"--link {silence}", returncode=1)
        config = scenario.fleet[0]
        self._run = Run(scenario, [VehicleRun(1, config, self._heard, self._heard)])  # type: ignore[arg-type]
        for check in scenario.checks:
            _check_can_be_judged(check)
        self.scenario = scenario
        if config.plan is not None:
            self._run.vehicles[0].plan = plan = read_plan(config.plan)
            self._run.vehicles[0].running = self.fleet[0].start(fly_plan(self.fleet[0], plan))

    @property
    def title(self) -> str:
        return f"the vehicle at {self._address}, {self.time_s:.1f} s on its clock"

    @property
    def time_s(self) -> float:
        return self._heard.time_us * 1e-6

    @property
    def world(self) -> Any:
        return _skip("the world")

    def pos_ned(self, vehicle: int = 1) -> Any:
        return _skip(f"the true position of vehicle {vehicle}")

    def mark(self, name: str) -> None:
        self._run.marks.setdefault(name, self.time_s)

    def check(self, check: Check | None = None, **keys: Any) -> None:
        asked = part_of(Check, keys if check is None else check, "flight.check")
        _check_can_be_judged(asked)
        self.scenario = self._run.scenario = self.scenario.model_copy(update={"checks": (*self.scenario.checks, asked)})

    def fail(self, **keys: Any) -> None:
        _skip(f"a fault ({', '.join(keys)})")

    async def orders_done(self) -> None:
        running = self._run.vehicles[0].running
        if running is not None:
            await self.fleet[0].until(lambda: running.is_done, self.scenario.time_max_s, "plan done")
            if running.error is not None:
                raise running.error

    def run(self, coroutine: Coroutine[Any, Any, Any]) -> Any:
        kept = Kept(coroutine)
        running = self.fleet[0].start(kept.run())
        end_s = self.time_s + self.scenario.time_max_s
        reason = self._poll(lambda: running.is_done or self.time_s > end_s)
        if not running.is_done:
            kept.give_up(reason or f"not done after {self.scenario.time_max_s:g} s of the vehicle's time (time_max_s)")
            running.cancel()
        return kept.outcome()

    def _poll(self, is_over: Callable[[], bool]) -> str:
        """Lets the vehicle's time pass; why it cannot go on."""
        pacer, polled_us = Pacer(1.0), 0
        while not is_over():
            try:
                self._vehicle.poll()
            except ScriptError as silence:
                return str(silence)
            self._heard.frame()
            polled_us += POLL_US
            pacer.wait_until(polled_us)
        return ""

    def finish_orders(self) -> None:
        self.run(self.orders_done())

    def end(self, error: str) -> ScenarioResult:
        """As in simulation, but that a vehicle is landed that the test has left in the air."""
        texts = tuple((at, 1, text) for at, text in self._heard.texts)
        result = ScenarioResult(
            name=self.scenario.name,
            file=self._file,
            seed=0,
            checks=judge(self._run, [self._heard.history()], self.time_s),
            error=error,
            simulated_s=self.time_s,
            texts=texts,
        )
        drone = self.fleet[0]
        if drone.is_armed:
            try:
                self.run(drone.disarm() if drone.drives or drone.is_landed else drone.land(_LANDING_S))
            except ScriptError as trouble:
                result = replace(result, error=error or f"left armed, and could not be landed: {trouble}")
        self.close()
        return result

    def close(self) -> None:
        self._link.close()


def _vehicle_at(address: str) -> tuple[Link, tuple[int, int]]:
    """The link, and system id and MAV_AUTOPILOT of the autopilot whose heartbeat is heard first.

    Raises:
        UserError: there is no such link.
        pytest.exit.Exception: no vehicle is there.
    """
    try:
        link = open_client_link(_SHORT.sub(r"\1://\2", address))
    except LinkError as error:
        raise UserError(f"--link {error}") from error
    end = ClientEnd(link, CLIENT_SYSTEM_ID, CLIENT_COMPONENT_ID)
    pacer, polled_us, end_s = Pacer(1.0), 0, wall_time_s() + FIRST_S
    while wall_time_s() < end_s:
        end.keep_alive(polled_us)
        for arrived in end.arrived():
            message = decode(arrived.frame)  # type: ignore[arg-type]
            if message.name == "HEARTBEAT" and arrived.compid == AUTOPILOT_COMPONENT:
                return link, (arrived.sysid, message.fields.autopilot)
        polled_us += POLL_US
        pacer.wait_until(polled_us)
    link.close()
    pytest.exit(f"--link {address}: no vehicle has been heard for {FIRST_S:g} s", returncode=1)


def _check_can_be_judged(check: Check) -> None:
    name = check.name_chosen
    condition = check.chosen.condition if name in ("always", "once") else ""
    if name not in JUDGED or any(quantity in condition for quantity in _UNKNOWN):
        _skip(f"the check {name} {condition}".rstrip())


_UNKNOWN = ("above_ground", "_error", "clearance", "airspeed", "battery")


def _skip(what: str) -> NoReturn:
    pytest.skip(f"--link: {what}: only in simulation")
