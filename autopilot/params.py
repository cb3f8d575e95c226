"""The whole parameter table: what the parts declare, and what a ground station looks for.

Ground stations that speak PX4 ask for certain names when they connect and open their setup pages for what they miss.
Those without a meaning here are constants (minimum = maximum): they can be read, and setting them changes nothing.
"""

from collections.abc import Sequence
from dataclasses import replace

from autopilot.commander.params import COMMANDER_PARAMETERS
from autopilot.estimator.params import ESTIMATOR_PARAMETERS
from autopilot.inputs.external_position import EXTERNAL_PARAMETERS
from autopilot.inputs.obstacles import OBSTACLE_PARAMETERS
from autopilot.inputs.stick_params import STICK_PARAMETERS
from autopilot.inputs.traffic import TRAFFIC_PARAMETERS
from autopilot.navigator.params import NAVIGATOR_PARAMETERS
from autopilot.vehicles.default_class import DEFAULT_CLASS
from autopilot.vehicles.vehicle_class import VehicleClass
from common.airframe import Airframe
from common.params import Parameter, ParameterTable

_CLIENTS = "what ground stations expect of a PX4 vehicle"


def _constant(name: str, value: int | float, meaning: str) -> Parameter:
    return Parameter(name, value, value, value, "", f"{meaning}; constant", _CLIENTS)


SYSTEM_PARAMETERS: list[Parameter] = [
    Parameter("MAV_SYS_ID", 1, 1, 250, "", "MAVLink system id, read at power-on", "PX4 default"),
    Parameter(
        "SDLOG_MODE",
        0,
        -1,
        2,
        "",
        "when a log of its own begins in the state folder: 0 armed to disarmed, 1 power-on to disarmed, 2 power-on to "
        "the end, -1 never",
        "PX4 default",
    ),
    _constant("SYS_AUTOSTART", 4001, "airframe: PX4's generic one with as many motors"),
    Parameter(
        "MAV_EVENTS",
        0,
        0,
        1,
        "",
        "1: mode, arming, its checks and failsafes are told by the events protocol, too; their texts come in any case",
        "off: a station would show texts and events",
    ),
    _constant("SYS_AUTOCONFIG", 0, "do not reset parameters"),
    Parameter("SYS_FAILURE_EN", 0, 0, 1, "", "1: clients may inject failures into an armed vehicle", "PX4 default"),
    _constant("RC_MAP_AUX1", 0, "no function of the radio control"),
    _constant("RC_MAP_AUX2", 0, "no function of the radio control"),
    _constant("RC_MAP_FLAPS", 0, "no function of the radio control"),
    _constant("CAL_GYRO0_ID", 1, "a gyroscope, calibrated"),
    _constant("CAL_ACC0_ID", 1, "an accelerometer, calibrated"),
    _constant("CAL_MAG0_ID", 1, "a magnetometer, calibrated"),
    _constant("CAL_MAG1_ID", 0, "no second magnetometer"),
    _constant("CAL_MAG2_ID", 0, "no third magnetometer"),
    _constant("BAT1_SOURCE", 0, "battery measured by the power module"),
    _constant("BAT1_N_CELLS", 4, "cells of the battery"),
    _constant("BAT1_V_CHARGED", 4.2, "voltage of a full cell"),
    _constant("BAT1_V_EMPTY", 3.6, "voltage of an empty cell"),
    _constant("BAT1_CAPACITY", -1.0, "capacity of the battery [mAh], negative: not known"),
]


def parameter_sections(vehicle: VehicleClass = DEFAULT_CLASS) -> dict[str, Sequence[Parameter]]:
    """Every declaration of the flight controller of a class of vehicles, by the headings of the page of parameters."""
    return {
        "Estimator": ESTIMATOR_PARAMETERS,
        f"{vehicle.name.capitalize()}: control, flight modes, detectors": vehicle.parameters,
        "Arming, failsafes": COMMANDER_PARAMETERS,
        "Take-off, missions, return, landing": NAVIGATOR_PARAMETERS,
        "The pilot's sticks": STICK_PARAMETERS,
        "Other aircraft": TRAFFIC_PARAMETERS,
        "Obstacles": OBSTACLE_PARAMETERS,
        "Positions from outside": EXTERNAL_PARAMETERS,
        "System, and what ground stations ask for": SYSTEM_PARAMETERS,
    }


def all_parameters(vehicle: VehicleClass = DEFAULT_CLASS) -> list[Parameter]:
    """Every declaration of the flight controller of a class of vehicles."""
    return [item for section in parameter_sections(vehicle).values() for item in section]


def _of_airframe(item: Parameter, value: int | float) -> Parameter:
    """The declaration with the airframe's default; a constant becomes another constant."""
    if item.minimum == item.maximum:
        return replace(item, default=value, minimum=value, maximum=value, source="airframe file")
    return replace(item, default=item.clamped(value), source="airframe file")


def parameter_table(
    airframe: Airframe | None = None, more: Sequence[Parameter] = (), vehicle: VehicleClass = DEFAULT_CLASS
) -> ParameterTable:
    """A vehicle's table, at the defaults of its airframe; `more` are those that only its dialect has."""
    own = {} if airframe is None else vehicle.defaults(airframe)
    declared = (*all_parameters(vehicle), *more)
    return ParameterTable(_of_airframe(item, own[item.name]) if item.name in own else item for item in declared)
