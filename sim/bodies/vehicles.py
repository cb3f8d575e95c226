"""The classes of vehicles that can be simulated: who flies or drives them, and what body moves them.

This list is the one position outside of its own folders where a class is named; an airframe file says of which it is.
"""

from typing import NamedTuple

from autopilot.vehicles.multirotor.vehicle import MULTIROTOR
from autopilot.vehicles.plane.vehicle import PLANE
from autopilot.vehicles.rover.vehicle import ROVER
from autopilot.vehicles.vehicle_class import VehicleClass
from common.airframe import Airframe, AirframeError
from sim.bodies.body import MULTIROTOR_BODY, Body
from sim.bodies.plane import PLANE_BODY
from sim.bodies.rover import ROVER_BODY


class SimulatedClass(NamedTuple):
    """A class of vehicles, and its body in the native engine."""

    vehicle: VehicleClass
    body: Body

    @property
    def drives(self) -> bool:
        """Its vehicles stay on the ground."""
        return self.vehicle.ground is None

    @property
    def needs_runway(self) -> bool:
        """Its vehicles leave the ground and come back to it on wheels."""
        return self.vehicle.ground is not None and not self.vehicle.ground.settles


VEHICLES = [
    SimulatedClass(MULTIROTOR, MULTIROTOR_BODY),
    SimulatedClass(ROVER, ROVER_BODY),
    SimulatedClass(PLANE, PLANE_BODY),
]


def class_of(airframe: Airframe) -> SimulatedClass:
    """The class of an airframe.

    Raises:
        AirframeError: there is no such class.
    """
    for each in VEHICLES:
        if each.vehicle.name == airframe.vehicle:
            return each
    names = ", ".join(each.vehicle.name for each in VEHICLES)
    raise AirframeError(f"airframe '{airframe.name}': unknown class of vehicles '{airframe.vehicle}'; known: {names}")
