"""What driven tasks do with a rover's row: vary it at an episode's start. As `flown_vehicle` for what flies."""

from typing import TYPE_CHECKING, Any, TypeAlias

import warp as wp

from autopilot.vehicles.rover.law import ROVER_LAW
from policies.tasks.flight.flight_params import FlightParams
from policies.tasks.flight.flown_vehicle import Makes, sensors_of_episode, wind_of_episode
from sim.advance import rig_arrays, rig_kernels
from sim.bodies.rover import ROVER_BODY
from sim.wind import WindState

wp.set_module_options({"enable_backward": False})

RoverArrays: TypeAlias = Any if TYPE_CHECKING else rig_arrays(ROVER_BODY, ROVER_LAW)
_forget_impacts = rig_kernels(ROVER_BODY, ROVER_LAW).forget_impacts


@wp.func
def vary_rover(
    rig: RoverArrays,
    makes: Makes,
    flight: FlightParams,
    friction_scale: float,
    rolling_scale: float,
    seed: int,
    i: int,
    episode: int,
) -> None:
    """Gives row i the air, the sensors, the mass, the motors and the tyres of its episode.

    Args:
        rig: all rows.
        makes: of its sensors.
        flight: numbers of the episode.
        friction_scale: factor on what the tyres hold.
        rolling_scale: factor on the rolling resistance.
        seed: of the draws.
        i: the row.
        episode: of the draws.
    """
    model = rig.model[i]  # as it stood in its bank
    model.mass_kg = model.mass_kg * flight.mass_scale
    model.mass_inv = model.mass_inv / flight.mass_scale
    model.inertia_frd = model.inertia_frd * flight.mass_scale
    model.inertia_inv_frd = model.inertia_inv_frd / flight.mass_scale
    model.motor_n_s_m = model.motor_n_s_m * flight.motor_scale
    model.motor_max_n = model.motor_max_n * flight.motor_scale
    model.tyre.peak = model.tyre.peak * friction_scale
    model.tyre.tail = model.tyre.tail * friction_scale
    model.rolling_resistance = model.rolling_resistance * rolling_scale
    rig.model[i] = model
    rig.sensor_model[i] = sensors_of_episode(makes, flight)
    rig.wind_model[i] = wind_of_episode(rig.wind_model[i], flight, seed, i, episode)
    rig.wind[i] = WindState()
    _forget_impacts(rig, i)
