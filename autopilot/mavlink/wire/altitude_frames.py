"""Altitudes above sea level, from the frame they come in."""

from math import isnan, nan

from autopilot.interface.vehicle_state import Reply, VehicleState, Verdict
from autopilot.mavlink.service import Command, denied
from autopilot.mavlink.wire.convert import GLOBAL_FRAMES, LATLON_FRAMES, RELATIVE_FRAMES, TERRAIN_FRAMES
from autopilot.ports import TERRAIN_VALID


def command_alt_amsl_m(state: VehicleState, command: Command) -> tuple[float, Reply | None]:
    """The altitude in parameter 7 above sea level [m] (NaN if free), or why there is none."""
    if isnan(command.z) and command.frame in LATLON_FRAMES:
        return command.z, None
    return alt_amsl_m(state, command.frame, command.z)


def alt_amsl_m(state: VehicleState, frame: int, alt_m: float) -> tuple[float, Reply | None]:
    """An altitude in a MAV_FRAME above sea level [m], or why there is none."""
    if frame in GLOBAL_FRAMES:
        return alt_m, None
    if frame in RELATIVE_FRAMES:
        if state.home is None:
            return nan, Reply(Verdict.TEMPORARILY_REJECTED, "an altitude above home needs a home position")
        return state.home.alt_m + alt_m, None
    if frame in TERRAIN_FRAMES:
        if not state.estimate.flags & TERRAIN_VALID:
            return nan, Reply(Verdict.TEMPORARILY_REJECTED, "the height above ground is not known")
        return state.origin.alt_m - state.estimate.terrain_d + alt_m, None
    return nan, denied(f"frame {frame} is not supported")
