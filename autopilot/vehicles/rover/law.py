"""The rover's control law: from places, speeds and headings to steering, throttle and brake."""

from autopilot.control.law import ControlLaw
from autopilot.vehicles.rover.cascade import RoverControlState, rover_control_tick
from autopilot.vehicles.rover.control_airframe import RoverControlAirframe, rover_control_airframe
from autopilot.vehicles.rover.params import ROVER_PARAMETERS, RoverParams, rover_params

ROVER_LAW = ControlLaw(
    RoverParams,
    RoverControlAirframe,
    RoverControlState,
    rover_control_tick,
    rover_params,
    rover_control_airframe,
    tuple(ROVER_PARAMETERS),
)
