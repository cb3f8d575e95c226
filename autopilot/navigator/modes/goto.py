"""Goto: a client sends the vehicle to a position, a height or a heading, where it holds."""

from math import hypot, isfinite

from autopilot.interface.client_requests import GoTo
from autopilot.interface.vehicle_state import ACCEPTED, Reply, Verdict
from autopilot.navigator.context import NavContext
from autopilot.navigator.setpoint import Vector
from autopilot.ports import TERRAIN_VALID

_BELOW_GROUND_M = 1.0  # below home and below the ground under the vehicle: more is a mistake, less an inaccuracy; guess


def reposition_target(context: NavContext, base: Vector, request: GoTo) -> tuple[Vector, float] | Reply:
    """Place and heading that are asked for, or why not.

    What is NaN stays as it is at `base` [m]: the position being held, or the position where the vehicle can stop.
    """
    state = context.state
    lat_deg, lon_deg, alt_amsl_m = request.lat_deg, request.lon_deg, request.alt_amsl_m
    if isfinite(lat_deg) != isfinite(lon_deg):
        return Reply(Verdict.DENIED, "needs both latitude and longitude")
    if isfinite(lat_deg):
        if abs(lat_deg) > 90.0 or abs(lon_deg) > 180.0:
            return Reply(Verdict.DENIED, "there is no such latitude and longitude")
        alt_m = alt_amsl_m if isfinite(alt_amsl_m) else state.position.alt_m
        target = context.pos_ned_of(lat_deg, lon_deg, alt_m)
        if not isfinite(alt_amsl_m):
            target = (target[0], target[1], base[2])
    elif isfinite(alt_amsl_m):
        target = (base[0], base[1], context.down_of(alt_amsl_m))
    else:
        target = base
    refusal = target_refusal(context, target)
    if refusal is not ACCEPTED:
        return refusal
    return target, context.heading_to(state.estimate.pos_ned, target, request.yaw_rad)


def ground_d(context: NavContext) -> float:
    """Down coordinate [m] of the ground: below the vehicle or where it stood last, whichever is lower."""
    stand_ned = context.state.stand_ned or context.state.home_ned
    stood_d = stand_ned[2] + context.craft.standing_height_m
    return max(stood_d, context.state.estimate.terrain_d) if context.state.estimate.flags & TERRAIN_VALID else stood_d


def target_refusal(context: NavContext, target: Vector) -> Reply:
    """Why the vehicle may not be sent to a position [m]; ACCEPTED if it may."""
    here = context.state.estimate.pos_ned
    way_m = hypot(target[0] - here[0], target[1] - here[1])
    longest_m = context.number("MIS_DIST_1WP")
    if 0.0 <= longest_m < way_m:
        return Reply(Verdict.DENIED, f"target is {way_m / 1000.0:.1f} km away, {longest_m / 1000.0:.1f} km allowed")
    if context.craft.ground is not None:  # what stays on the ground takes its height
        if abs(target[2]) > 10_000.0:
            return Reply(Verdict.DENIED, "altitude is out of range")
        lowest_d = ground_d(context)
        if target[2] > lowest_d + _BELOW_GROUND_M:
            return Reply(Verdict.DENIED, f"target is {target[2] - lowest_d:.0f} m below the ground")
    reason = context.position_refusal(target)
    if reason:
        return Reply(Verdict.DENIED, f"target is {reason}")
    return ACCEPTED
