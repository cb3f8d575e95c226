"""What the rigs of flights to goals share."""

from math import nan

from autopilot.mavlink.wire.convert import degrees_e7
from common.geodesy import geodetic_from_ned

_DO_REPOSITION, _CHANGE_MODE = 192, 1.0


def advance(flight, seconds, is_enough=lambda: False):
    """Flies on for a time, or until it is enough."""
    end_us = flight.time_us + round(seconds * 1e6)
    flight.run(lambda _: is_enough() or flight.time_us >= end_us)


def goto_fields(flight, goal_ned, component, yaw=nan):
    """Of a COMMAND_INT that asks for a place [m] and a heading [rad]."""
    lat_deg, lon_deg, alt_amsl_m = geodetic_from_ned(*goal_ned, flight.config.home)
    return {
        "target_system": 1,
        "target_component": component,
        "command": _DO_REPOSITION,
        "frame": 0,
        "param1": -1.0,
        "param2": _CHANGE_MODE,
        "param4": yaw,
        "x": degrees_e7(lat_deg),
        "y": degrees_e7(lon_deg),
        "z": alt_amsl_m,
    }
