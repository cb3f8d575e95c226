"""Telemetry of where the vehicle is going: the position asked for, seen from where it is."""

from math import asin, atan2, degrees, hypot, isfinite

from autopilot.interface.vehicle_state import VehicleState
from autopilot.mavlink.wire.codec import known_type
from autopilot.mavlink.wire.convert import i16, u16

_nav_controller_output = known_type("NAV_CONTROLLER_OUTPUT").pack

_MOVES_M_S = 0.2  # slower than this the way has no direction; guess


def nav_controller_output(state: VehicleState) -> bytes | None:
    """Distance, bearing and height error to the position flown to, and the lean asked for; while there is one."""
    north, east, down = state.goal_ned
    if not state.is_armed or not (isfinite(north) and isfinite(east)):
        return None
    here = state.estimate.pos_ned
    way_north, way_east = north - here[0], east - here[1]
    vel_north, vel_east, _ = state.estimate.vel_ned
    target_bearing = degrees(atan2(way_east, way_north))
    moves = hypot(vel_north, vel_east) > _MOVES_M_S
    x, y, z, w = state.actuators.q_sp_ned_from_frd
    return _nav_controller_output(
        degrees(atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))),
        degrees(asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))),
        i16(degrees(atan2(vel_east, vel_north)) if moves else target_bearing),
        i16(target_bearing),
        u16(hypot(way_north, way_east)),
        here[2] - down if isfinite(down) else 0.0,
        0.0,
        cross_track_m(state),
    )


def cross_track_m(state: VehicleState) -> float:
    """Distance [m] to the right of the straight way that is flown; 0 without one."""
    (start_north, start_east, _), (north, east, _) = state.path_start_ned, state.goal_ned
    leg_north, leg_east = north - start_north, east - start_east
    length = hypot(leg_north, leg_east)
    if not length > 1.0:  # also false for NaN: no straight way
        return 0.0
    here = state.estimate.pos_ned
    return float((leg_north * (here[1] - start_east) - leg_east * (here[0] - start_north)) / length)
