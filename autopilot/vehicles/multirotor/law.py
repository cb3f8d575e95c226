"""The multirotor's control law: the cascade from position to motor commands."""

from autopilot.control.law import ControlLaw
from autopilot.vehicles.multirotor.cascade import ControlState, control_tick
from autopilot.vehicles.multirotor.control_airframe import ControlAirframe, control_airframe
from autopilot.vehicles.multirotor.params import CONTROL_PARAMETERS, ControlParams, control_params

MULTIROTOR_LAW = ControlLaw(
    ControlParams,
    ControlAirframe,
    ControlState,
    control_tick,
    control_params,
    control_airframe,
    tuple(CONTROL_PARAMETERS),
)
