"""The hovers that episodes start from: flown once per process, from power-on, by the flight controller itself.

Every estimator has converged then and every integrator has settled. A row that starts an episode takes one of them
over, and flies on in a world, with a wind and with noise of its own.
"""

from collections.abc import Callable
from functools import cache

import numpy as np

from autopilot.params import parameter_table
from common.airframe import load_airframe
from common.geodesy import DEFAULT_HOME
from policies.tasks.task import SPLITS, Split
from sim.bodies.vehicles import class_of
from sim.hovering import Hover, fly_to_hover
from sim.rig import Rig, Rows
from sim.sensors.sensors import SensorModel, sensor_model
from sim.wind import wind_model
from sim.world.batch import WorldBatch
from sim.world.world import WorldConfig, WorldMap, build_world

AIRFRAME = "x500"
HOVER_COUNT = 64
LOW_M = (1.5, 2.5)  # heights of hovers
PLAIN = WorldConfig(size_m=64.0, hill_height_m=0.0, trees_per_ha=0.0)
Parameters = tuple[tuple[str, float], ...]  # of the flight controller, that differ from their defaults
_SPREAD_M = 0.5  # of the places they hover at, to the north and to the east


def build_rig(
    world: WorldMap | WorldBatch,
    count: int,
    *,
    has_estimator: bool,
    threads: int,
    device: str,
    airframe_name: str = AIRFRAME,
    sensors: Callable[[float], SensorModel] = sensor_model,
    seed: int = 0,
    parameters: Parameters = (),
) -> Rig:
    """Vehicles with the flight controller of their class, as it ships but for some parameters, powered on at home."""
    airframe = load_airframe(airframe_name)
    vehicle, body = class_of(airframe)
    rig = Rig(
        airframe,
        world,
        sensors(1.0),
        wind_model(0.0),
        home=DEFAULT_HOME,
        vehicle_count=count,
        seed=seed,
        has_estimator=has_estimator,
        threads=threads,
        device=device,
        body=body,
        law=vehicle.law,
    )
    table = parameter_table(airframe, vehicle=vehicle)
    for name, value in parameters:
        table.set_exactly(name, value)
    rig.load_parameters(table)
    return rig


@cache
def hover_bank(
    has_estimator: bool,
    device: str,
    heights_m: tuple[float, float] = LOW_M,
    split: Split = "train",
    airframes: tuple[str, ...] = (AIRFRAME,),
    parameters: Parameters = (),
) -> Rig:
    """Vehicles that hover above home, between two heights, each with a heading of its own; as many of each airframe."""
    if len(airframes) == 1:
        return _hovering(has_estimator, device, heights_m, split, airframes[0], parameters)
    parts = [hover_bank(has_estimator, device, heights_m, split, (name,), parameters) for name in airframes]
    bank = _on_the_ground(has_estimator, device, HOVER_COUNT * len(parts), airframes[0], seed=0)
    bank.restore([_joined(rows) for rows in zip(*(part.snapshot() for part in parts), strict=True)])
    return bank


def _joined(parts: tuple[Rows, ...]) -> Rows:
    """One after the other, laid out as they are: `np.concatenate` packs structs."""
    joined = np.empty((sum(len(part) for part in parts), *parts[0].shape[1:]), parts[0].dtype)
    return np.concatenate(parts, out=joined, casting="unsafe")


def _on_the_ground(
    has_estimator: bool, device: str, count: int, airframe_name: str, seed: int, parameters: Parameters = ()
) -> Rig:
    plain = build_world(PLAIN, device)
    return build_rig(
        plain,
        count,
        has_estimator=has_estimator,
        threads=1,
        device=device,
        airframe_name=airframe_name,
        seed=seed,
        parameters=parameters,
    )


def _hovering(
    has_estimator: bool,
    device: str,
    heights_m: tuple[float, float],
    split: Split,
    airframe_name: str,
    parameters: Parameters,
) -> Rig:
    seed = SPLITS.index(split)
    rig = _on_the_ground(has_estimator, device, HOVER_COUNT, airframe_name, seed, parameters)
    rng = np.random.default_rng(seed)
    low, high = heights_m
    middle, spread = np.array([0.0, 0.0, -0.5 * (low + high)]), np.array([_SPREAD_M, _SPREAD_M, 0.5 * (high - low)])
    hovers: list[Hover] = []
    for _ in range(HOVER_COUNT):
        north, east, down = middle + rng.uniform(-spread, spread)
        hovers.append(((north, east, down), rng.uniform(-np.pi, np.pi)))
    fly_to_hover(rig, hovers)
    return rig
