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
from sim.bodies.vehicles import class_of
from sim.hovering import Hover, fly_to_hover
from sim.rig import Rig
from sim.sensors.sensors import SensorModel, sensor_model
from sim.wind import wind_model
from sim.world.batch import WorldBatch
from sim.world.world import WorldConfig, WorldMap, build_world

AIRFRAME = "x500"
HOVER_COUNT = 64
LOW_M = (1.5, 2.5)  # heights of hovers
PLAIN = WorldConfig(size_m=64.0, hill_height_m=0.0, trees_per_ha=0.0)
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
) -> Rig:
    """Vehicles with the default flight controller of their class, powered on at home."""
    airframe = load_airframe(airframe_name)
    vehicle, body = class_of(airframe)
    rig = Rig(
        airframe,
        world,
        sensors(1.0),
        wind_model(0.0),
        home=DEFAULT_HOME,
        vehicle_count=count,
        has_estimator=has_estimator,
        threads=threads,
        device=device,
        body=body,
        law=vehicle.law,
    )
    rig.load_parameters(parameter_table(airframe, vehicle=vehicle))
    return rig


@cache
def hover_bank(has_estimator: bool, device: str, heights_m: tuple[float, float] = LOW_M) -> Rig:
    """Vehicles that hover above home, between two heights, each with a heading of its own."""
    rig = build_rig(build_world(PLAIN, device), HOVER_COUNT, has_estimator=has_estimator, threads=1, device=device)
    rng = np.random.default_rng(0)
    low, high = heights_m
    middle, spread = np.array([0.0, 0.0, -0.5 * (low + high)]), np.array([_SPREAD_M, _SPREAD_M, 0.5 * (high - low)])
    hovers: list[Hover] = []
    for _ in range(HOVER_COUNT):
        north, east, down = middle + rng.uniform(-spread, spread)
        hovers.append(((north, east, down), rng.uniform(-np.pi, np.pi)))
    fly_to_hover(rig, hovers)
    return rig
