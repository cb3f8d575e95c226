"""What can be seen to be wrong with a scenario before it is flown, each with the key that says it.

In: a scenario whose keys are right by themselves, and the configurations of its vehicles. Out: a `KeyRefusal` of the
first that does not fit.
"""

import ast
from collections.abc import Sequence
from itertools import combinations
from math import dist
from pathlib import Path
from typing import get_args

from autopilot.estimator.sensors import FUSED_SENSORS, sensors_of
from common.airframe import Airframe, AirframeError, load_airframe
from common.airframes.plane import PlaneAirframe
from common.config.refusal import nearest
from common.params import ParameterError, ParameterTable
from mission.console.option_checks import UserError
from mission.flight_config import FlightConfig, flight_parameters
from mission.plan.plan_file import PlanError, read_plan
from mission.scenario.parts.conditions import terms_of
from mission.scenario.parts.faults import SensorName
from mission.scenario.parts.part import Key, KeyRefusal
from mission.scenario.parts.steps import Step
from mission.scenario.scenario import Scenario, Vehicle
from mission.simulator.flight_rig import flight_world
from sim.bodies.vehicles import class_of
from sim.world.custom.world_file import WorldFile

POLICY_STEPS = ("let_policy_fly", "policy_goto", "policy_park")
POLICY_CHECKS = ("following", "scorecard", "interventions", "figures")
START_GAP_M = 1.0  # between the centres of two vehicles; nearer, they stand in each other


def airframe_of(vehicle: Vehicle, key: Key) -> Airframe:
    """The airframe of a vehicle, of a class that there is.

    Raises:
        KeyRefusal: there is none, or its file is wrong.
    """
    name, key = vehicle.airframe, (*key, "airframe")
    if name.endswith(".toml") and not Path(name).is_file():
        raise KeyRefusal(key, f"{name}: no such file")
    try:
        airframe = load_airframe(name)
        class_of(airframe)
    except AirframeError as error:
        raise KeyRefusal(key, str(error)) from error
    return airframe


def check_parameters(config: FlightConfig, airframe: Airframe, key: Key) -> None:
    """Refuses parameters that the flight controller has not, values that they cannot have, and a throw of no plane.

    Raises:
        KeyRefusal: of the first such.
    """
    table = _defaults(config, airframe, key)
    for name, value in config.parameters.items():
        _check_name(name, table, config, (*key, "parameters", name))
        try:
            table.set_exactly(name, value)
        except ParameterError as error:
            said = str(error).removeprefix(f"parameter {name}: ")
            raise KeyRefusal((*key, "parameters", name), said) from error


def _check_name(name: str, table: ParameterTable, config: FlightConfig, key: Key) -> None:
    if name not in table:
        hint = nearest(name, table.names) or f"the flight controller of {config.airframe} has none of that name"
        raise KeyRefusal(key, f"unknown parameter; {hint}")


def _defaults(config: FlightConfig, airframe: Airframe, key: Key) -> ParameterTable:
    """The flight controller's parameters at their defaults."""
    try:
        return flight_parameters(config.model_copy(update={"parameters": {}}), airframe)
    except AirframeError as error:
        raise KeyRefusal((*key, "throw_m_s"), str(error)) from error


def check_orders(scenario: Scenario) -> None:
    """Refuses plans, functions and policies that are not there.

    Raises:
        KeyRefusal: of the first such.
    """
    for key, vehicle in dict(zip(scenario.fleet_keys, scenario.fleet, strict=True)).items():
        if vehicle.plan is not None:
            _check_plan(vehicle.plan, (*key, "plan"))
        for i, step in enumerate(vehicle.script):
            if step.fly_plan is not None:
                _check_plan(step.fly_plan.file, (*key, "script", i, "fly_plan"))
        if vehicle.python is not None:
            _check_function(vehicle.python, (*key, "python"))
        if vehicle.policy is not None:
            _check_policy(vehicle, (*key, "policy"))


def check_steps(scenario: Scenario, configs: Sequence[FlightConfig]) -> None:
    """Refuses steps that the vehicles cannot do, unless the script is to fail.

    Args:
        scenario: whose scripts.
        configs: of its vehicles.

    Raises:
        KeyRefusal: of the first such.
    """
    described = dict(zip(scenario.fleet_keys, zip(scenario.fleet, configs, strict=True), strict=True))
    for key, (vehicle, config) in described.items() if not scenario.fails_with else ():
        for i, step in enumerate(vehicle.script):
            own = (*key, "script", i, step.name_chosen)
            _check_step(step, vehicle, config, own)
            if step.let_policy_fly is not None and scenario.owner is None:
                raise KeyRefusal(own, "there is nobody to follow; add an owner")


def _check_step(step: Step, vehicle: Vehicle, config: FlightConfig, key: Key) -> None:
    airframe = load_airframe(config.airframe)
    if step.name_chosen in POLICY_STEPS and vehicle.policy is None:
        raise KeyRefusal(key, "the vehicle has no policy")
    if step.takeoff is not None and class_of(airframe).drives:
        raise KeyRefusal(key, f"{config.airframe} drives, and takes off never")
    if step.set_param:
        table = _defaults(config, airframe, key)
        for name in step.set_param:
            _check_name(name, table, config, (*key, name))
    if step.wait_until is not None:
        _check_condition(step.wait_until.condition, config, key)


def check_checks(scenario: Scenario, configs: Sequence[FlightConfig]) -> None:
    """Refuses what can never be so: checks, and conditions of faults, of what the vehicles have not.

    Args:
        scenario: whose.
        configs: of its vehicles.

    Raises:
        KeyRefusal: of the first such.
    """
    for i, check in enumerate(scenario.checks):
        key = ("checks", i, check.name_chosen)
        if check.separation is not None and len(configs) < 2:
            raise KeyRefusal(key, "there is one vehicle")
        if check.name_chosen in POLICY_CHECKS and not any(vehicle.policy for vehicle in scenario.fleet):
            raise KeyRefusal(key, "the vehicle has no policy")
        for config in configs if check.vehicle is None else configs[check.vehicle - 1 : check.vehicle]:
            if check.airspeed is not None:
                _check_airspeed(config, key)
            if check.always is not None or check.once is not None:
                _check_condition(check.chosen.condition, config, key)
    for i, fault in enumerate(scenario.faults):
        if fault.when is not None:
            _check_condition(fault.when, configs[fault.vehicle - 1], ("faults", i, "when"))


def _check_condition(condition: str, config: FlightConfig, key: Key) -> None:
    if any(term.quantity == "airspeed" for term in terms_of(condition)):
        _check_airspeed(config, key)


def _check_airspeed(config: FlightConfig, key: Key) -> None:
    if not isinstance(load_airframe(config.airframe), PlaneAirframe):
        raise KeyRefusal(key, f"{config.airframe} measures no airspeed, which planes do")


def check_purpose(scenario: Scenario) -> None:
    """Refuses what would pass whatever happens.

    Raises:
        KeyRefusal: nothing is to be flown, and nothing is checked.
    """
    if not (scenario.checks or scenario.faults or any(_has_orders(vehicle) for vehicle in scenario.fleet)):
        raise KeyRefusal(
            scenario.fleet_keys[0], "is told nothing and nothing is checked: give it a script, or add checks"
        )


def _has_orders(vehicle: Vehicle) -> bool:
    return bool(vehicle.script or vehicle.plan or vehicle.python or vehicle.policy)


def _check_plan(file: Path, key: Key) -> None:
    if not file.is_file():
        raise KeyRefusal(key, f"{file}: no such file")
    try:
        read_plan(file)
    except PlanError as error:
        raise KeyRefusal(key, str(error)) from error


def _check_policy(vehicle: Vehicle, key: Key) -> None:
    from mission.scenario.flight.companions import check_policy

    try:
        if vehicle.policy is not None:
            check_policy(vehicle.policy)
    except UserError as error:
        raise KeyRefusal(key, str(error)) from error


def _check_function(text: str, key: Key) -> None:
    """Refuses FILE.py:FUNCTION if the file defines no such coroutine; it is read and not run."""
    file, _, name = text.rpartition(":")
    if not Path(file).is_file():
        raise KeyRefusal(key, f"{file}: no such file")
    try:
        module = ast.parse(Path(file).read_bytes())
    except (SyntaxError, ValueError) as error:
        raise KeyRefusal(key, f"{file}: is no Python: {error}") from error
    if not _may_be_coroutine(module, name):
        coroutines = [node.name for node in module.body if isinstance(node, ast.AsyncFunctionDef)]
        meant = nearest(name, coroutines)
        hint = f"; {meant}" if meant else ""
        raise KeyRefusal(key, f"{file}: has no coroutine '{name}' (async def {name}(drone): ...){hint}")


def _may_be_coroutine(module: ast.Module, name: str) -> bool:
    """Whether the module defines such a coroutine, or gives something else the name of which only running it tells."""
    for node in module.body[::-1]:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            if node.name == name:
                return isinstance(node, ast.AsyncFunctionDef) or bool(node.decorator_list)
        elif not _names(node).isdisjoint((name, "*")):
            return True
    return False


def _names(node: ast.stmt) -> set[str]:
    """What an import, an assignment or a condition may define; the star of an import may be anything."""
    found: set[str] = set()
    for each in ast.walk(node):
        if isinstance(each, ast.FunctionDef | ast.AsyncFunctionDef):
            found.add(each.name)
        elif isinstance(each, ast.alias):
            found.add(each.asname or each.name)
        elif isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store):
            found.add(each.id)
    return found


def check_faults(scenario: Scenario, configs: Sequence[FlightConfig]) -> None:
    """Refuses faults of parts that the vehicles have not.

    Args:
        scenario: whose faults.
        configs: of its vehicles.

    Raises:
        KeyRefusal: of the first such.
    """
    for i, fault in enumerate(scenario.faults):
        key, config = ("faults", i), configs[fault.vehicle - 1]
        if fault.motor is not None:
            _check_motor(fault.motor.number, config, (*key, "motor", "number"))
        if fault.sensor is not None:
            _check_sensor(fault.sensor.name, config, (*key, "sensor", "name"))
        link = None if fault.link is None else fault.link.name
        if link == "ground_station" and not scenario.has_ground_station:
            raise KeyRefusal((*key, "link"), "ground_station: there is none; add has_ground_station: true")
        if link == "companion" and scenario.fleet[fault.vehicle - 1].policy is None:
            raise KeyRefusal((*key, "link"), "companion: there is none, the vehicle has no policy")


def _check_motor(number: int, config: FlightConfig, key: Key) -> None:
    airframe = load_airframe(config.airframe)
    count = len(class_of(airframe).vehicle.motors(airframe))
    if number > count:
        there = f"motors 1 to {count}" if count > 1 else "motor 1 only"
        raise KeyRefusal(key, f"{config.airframe} has {there}, not {number}")


def _check_sensor(name: str, config: FlightConfig, key: Key) -> None:
    airframe = load_airframe(config.airframe)
    fused = {sensor.name for sensor in FUSED_SENSORS}
    absent = fused - {sensor.name for sensor in sensors_of(flight_parameters(config, airframe))}
    if not isinstance(airframe, PlaneAirframe):
        absent.add("airspeed")
    if name in absent:
        there = ", ".join(each for each in get_args(SensorName) if each not in absent)
        raise KeyRefusal(key, f"{config.airframe} has no sensor {name}; it has {there}")


def check_starts(scenario: Scenario, configs: Sequence[FlightConfig]) -> None:
    """Refuses vehicles that start beyond the edges of the world, or in each other.

    Args:
        scenario: where they are described.
        configs: where they start.

    Raises:
        KeyRefusal: of the first such.
    """
    keys = [_start_key(scenario, i) for i in range(len(configs))]
    half_m = 0.5 * _size_m(configs[0])
    for config, key in zip(configs, keys, strict=True):
        if max(map(abs, config.start_ne_m)) > half_m:
            raise KeyRefusal(key, f"is outside of the world, which ends {half_m:g} m to each side of home")
    for (i, one), (k, other) in combinations(enumerate(configs), 2):
        gap_m = dist(one.start_ne_m, other.start_ne_m)
        if gap_m < START_GAP_M:
            said = f"vehicles {i + 1} and {k + 1} start {gap_m:.2g} m apart, at least {START_GAP_M:g} m are needed"
            raise KeyRefusal(keys[k], said)


def _start_key(scenario: Scenario, i_vehicle: int) -> Key:
    """Where it is said where a vehicle starts, or else what the vehicle is."""
    key, start = scenario.fleet_keys[i_vehicle], scenario.fleet[i_vehicle].start
    return (*key, "start", "ne_m") if "ne_m" in start.model_fields_set else key


def _size_m(config: FlightConfig) -> float:
    """The side of the world's map, whose size is a heightmap's if it has one."""
    if isinstance(config.world, WorldFile) and config.world.heightmap is not None:
        return float(flight_world(config).config.size_m)
    return config.world.size_m
