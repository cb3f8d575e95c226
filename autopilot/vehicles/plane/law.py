"""The plane's control law: from lines, circles, heights and airspeeds to surfaces and throttle."""

from autopilot.control.law import ControlLaw
from autopilot.vehicles.plane.cascade import PlaneControlState, plane_control_tick
from autopilot.vehicles.plane.control_airframe import PlaneControlAirframe, plane_control_airframe
from autopilot.vehicles.plane.params import LOITER_RADIUS, PLANE_PARAMETERS, PlaneParams, plane_params

PLANE_LAW = ControlLaw(
    PlaneParams,
    PlaneControlAirframe,
    PlaneControlState,
    plane_control_tick,
    plane_params,
    plane_control_airframe,
    (*PLANE_PARAMETERS, LOITER_RADIUS),
)
