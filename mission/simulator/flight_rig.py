"""The simulation of a flight: the world it is in, the air over it, and the vehicle's rig in both."""

from collections.abc import Callable

from common.airframe import Airframe
from common.kernels import FRAME_TICKS
from mission.flight_config import FlightConfig
from mission.simulator.rig_choice import rig_with
from sim.bodies.vehicles import class_of
from sim.rig import Rig
from sim.sensors.sensors import SensorModel, sensor_model
from sim.wind import WindModel, wind_model
from sim.world.batch import grown_world
from sim.world.world import WorldMap, build_world

TURBULENCE = 1.0  # MIL-F-8785C's intensity at the wind's speed
GUST_FRACTION = 0.3  # guess: a gust adds up to this fraction of the mean wind


def flight_world(config: FlightConfig) -> WorldMap:
    """The ground of a flight."""
    if config.owner is not None or config.is_forest or config.world.has_boxes:
        return grown_world(config.world, config.world.seed)
    return build_world(config.world)


def flight_wind(speed_m_s: float, from_deg: float) -> WindModel:
    """The air of a flight: the mean, and the turbulence and gusts that go with it."""
    return wind_model(speed_m_s, from_deg, TURBULENCE, GUST_FRACTION * speed_m_s)


def flight_sensors(config: FlightConfig) -> SensorModel:
    """The sensors of a flight."""
    model: SensorModel = sensor_model(config.noise, config.home, config.sensor_roughness)
    return model


def flight_rig(
    config: FlightConfig, airframe: Airframe, world: WorldMap, make_rig: Callable[..., Rig] | None = None
) -> Rig:
    """The vehicle of a flight with its sensors, ready to advance by frames.

    Args:
        config: of the flight.
        airframe: the vehicle.
        world: the ground.
        make_rig: takes the arguments of `Rig`; None: with the engine of the configuration.
    """
    vehicle, body = class_of(airframe)
    rig = (make_rig or rig_with(config.engine, airframe))(
        airframe,
        world,
        flight_sensors(config),
        flight_wind(config.wind_m_s, config.wind_from_deg),
        home=config.home,
        seed=config.seed,
        body=body,
        law=vehicle.law,
        start_ne_m=config.start_ne_m,
        heading_deg=config.start_heading_deg,
    )
    rig.prepare(FRAME_TICKS)
    return rig
