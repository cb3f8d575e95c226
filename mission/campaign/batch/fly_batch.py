"""Flies runs of a campaign in one batch: the kernels advance all vehicles in a launch, each has its flight controller.

In: orders whose scenarios are alike but for their varied values. Out: a record of each, judged by the checks that judge
any flight.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from common.airframe import load_airframe
from common.clock import process_time_s
from common.kernels import FRAME_TICKS, FRAME_US
from mission.campaign.batch.batch_flight import BatchFlight
from mission.campaign.batch.history import BatchHistory
from mission.campaign.batch.script import Steps, fly
from mission.campaign.campaign import Campaign
from mission.campaign.runs import Order, Record, lost, record_of
from mission.campaign.varying import KeyFault, varied
from mission.client import ScriptError
from mission.console.option_checks import UserError
from mission.flight_config import FlightConfig
from mission.scenario.flight.building import flight_configs, set_charge
from mission.scenario.flight.fault_timeline import FaultTimeline
from mission.scenario.flight.run import Run, VehicleRun, Witness
from mission.scenario.judging.judge import judge
from mission.scenario.result import ScenarioResult
from mission.scenario.runner import AFTER_S
from mission.scenario.scenario import Scenario
from mission.simulator.flight_rig import flight_sensors, flight_wind, flight_world
from sim.bodies.vehicles import class_of
from sim.rig import Rig

QUIET_US = 5 * FRAME_US  # while a script waits, its flight controller's Python part looks ten times a second


@dataclass
class _Flown:
    """One run of the batch."""

    order: Order
    run: Run
    faults: FaultTimeline
    steps: Steps
    look_us: int = 0
    """Until then nothing is to be decided."""
    is_done: bool = False
    end_us: int = 0
    """When it is over."""
    error: str = ""

    @property
    def vehicle(self) -> VehicleRun:
        return self.run.vehicles[0]

    @property
    def flight(self) -> Any:
        return self.vehicle.flight

    def frame(self, time_us: int) -> bool:
        """One frame of it, after the kernels'; whether its flight controller's Python part was run."""
        flight = self.flight
        flight.time_us = time_us
        is_seen = time_us >= self.look_us
        if is_seen:
            flight.see()
            until_us = self._go_on(time_us)
            self.look_us = time_us + FRAME_US if until_us == 0 else min(until_us, time_us + QUIET_US)
        if self.run.scenario.faults:
            self.faults.frame(time_us)
        return is_seen

    def _go_on(self, time_us: int) -> int:
        """Lets the script go on; until when it waits [us], 0: it looks each frame."""
        if self.is_done:
            return self.end_us
        try:
            return round(next(self.steps) * 1e6)
        except StopIteration:
            pass
        except ScriptError as error:
            self.error = str(error)
        self.is_done = True
        self.end_us = min(time_us + round(AFTER_S * 1e6), self.end_us - 1)
        return self.end_us


def fly_batch(campaign: Campaign, orders: Sequence[Order]) -> list[Record]:
    """The record of each order."""
    begun_s = process_time_s()
    records: dict[int, Record] = {}
    made: list[tuple[Order, Scenario, FlightConfig]] = []
    for k, order in enumerate(orders):
        try:
            scenario = varied(campaign.flown, order.values)
            made.append((order, scenario, flight_configs(scenario, order.seed)[0]))
        except (UserError, KeyFault) as error:
            records[k] = lost(order, f"cannot be flown: {error}")
    if made:
        flown = _fly(made)
        took_s = (process_time_s() - begun_s) / len(flown)
        left = iter(flown)
        for k in range(len(orders)):
            if k not in records:
                order, result = next(left)
                records[k] = record_of(order, _with_cpu(result, took_s), campaign.margin)
    return [records[k] for k in range(len(orders))]


def _with_cpu(result: ScenarioResult, cpu_s: float) -> ScenarioResult:
    return replace(result, cpu_s=cpu_s)


def _rig(config: FlightConfig, world: Any, count: int) -> Rig:
    airframe = load_airframe(config.airframe)
    vehicle, body = class_of(airframe)
    return Rig(
        airframe, world, flight_sensors(config),
        flight_wind(config.wind_m_s, config.wind_from_deg), home=config.home, vehicle_count=count, body=body,
        law=vehicle.law, start_ne_m=config.start_ne_m, heading_deg=config.start_heading_deg,
    )  # fmt: skip


def _fly(made: list[tuple[Order, Scenario, FlightConfig]]) -> list[tuple[Order, ScenarioResult]]:
    first = made[0][2]
    world = flight_world(first)
    rig = _rig(first, world, len(made))
    flown = [
        _begun(order, scenario, BatchFlight(config, scenario, rig, i, world))
        for i, (order, scenario, config) in enumerate(made)
    ]
    flights = [each.flight for each in flown]
    history = BatchHistory(rig, flights)
    impacts = rig.rows["truth"]["impact_speed"]
    time_us, running = 0, list(enumerate(flown))
    while running:
        rig.advance(FRAME_TICKS)
        time_us += FRAME_US
        seen = [i for i, each in running if each.frame(time_us)]
        if impacts.any():
            for _, each in running:
                each.vehicle.witness.look()
        history.note(time_us, seen)
        if len(seen) > 0:
            running = [(i, each) for i, each in running if time_us < each.end_us]
    return [(each.order, _result(each, history, i)) for i, each in enumerate(flown)]


def _begun(order: Order, scenario: Scenario, flight: BatchFlight) -> _Flown:
    config = scenario.fleet[0]
    set_charge(flight, config.start.battery)
    any_flight: Any = flight
    vehicle = VehicleRun(1, config, any_flight, Witness(any_flight))
    run = Run(scenario, [vehicle])
    end_us = round(scenario.time_max_s * 1e6)
    return _Flown(order, run, FaultTimeline(run, scenario.faults), fly(run, vehicle), end_us=end_us)


def _result(each: _Flown, history: BatchHistory, i_vehicle: int) -> ScenarioResult:
    scenario, end_us = each.run.scenario, each.flight.time_us
    error = each.error if each.is_done else f"the script was not done after {scenario.time_max_s:g} s"
    if scenario.fails_with:
        is_so = scenario.fails_with in error
        error = "" if is_so else f"the script was to fail with '{scenario.fails_with}'"
    elif not error and each.faults.left:
        error = "; ".join(f"a fault never happened: {f.when or f'at {f.at:g} s'}" for f in each.faults.left)
    end_s = round(end_us * 1e-6, 6)
    checks = judge(each.run, [history.of(i_vehicle, end_us)], end_s)
    return ScenarioResult(scenario.name or "scenario", "", each.order.seed, checks, error, end_s)
