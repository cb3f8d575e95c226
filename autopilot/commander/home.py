"""Home: where the vehicle returns to. It is where it was armed, unless a client names a position."""

from collections.abc import Callable
from math import hypot, isfinite, nan

from autopilot.interface.vehicle_interface import Announcer
from autopilot.interface.vehicle_state import ACCEPTED, LandedState, Reply, VehicleState, Verdict
from common.geodesy import GeoPoint, geodetic_from_ned, ned_from_geodetic

_FAR_M = 50_000.0  # from where the vehicle was switched on (ArduPilot)
_HIGH_M = 10_000.0


class Home:
    """The home of one vehicle.

    Args:
        state: written here: home.
        announcer: hears of changes.
    """

    __slots__ = ("_announcer", "_state", "is_given", "on_given")

    def __init__(self, state: VehicleState, announcer: Announcer) -> None:
        self._state = state
        self._announcer = announcer
        self.is_given = False  # by a client: arming does not move it
        self.on_given: Callable[[GeoPoint], None] = lambda _: None

    def set(self, lat_deg: float, lon_deg: float, alt_amsl_m: float, *, has_position: bool) -> Reply:
        """As a client asks; all NaN: here."""
        state = self._state
        if not (isfinite(lat_deg) and isfinite(lon_deg)):
            if isfinite(lat_deg) or isfinite(lon_deg):
                return Reply(Verdict.DENIED, "needs both latitude and longitude")
            if not has_position:
                return Reply(Verdict.TEMPORARILY_REJECTED, "no valid position")
            self.set_here()
        else:
            if abs(lat_deg) > 90.0 or abs(lon_deg) > 180.0:
                return Reply(Verdict.DENIED, "there is no such latitude and longitude")
            alt_m = alt_amsl_m if isfinite(alt_amsl_m) else (state.home or state.position).alt_m
            home_ned = ned_from_geodetic(lat_deg, lon_deg, alt_m, state.origin)
            if hypot(home_ned[0], home_ned[1]) > _FAR_M or abs(alt_m - state.origin.alt_m) > _HIGH_M:
                return Reply(Verdict.DENIED, "home would be too far away to return to")
            state.home, state.home_ned = GeoPoint(lat_deg, lon_deg, alt_m), home_ned
            state.home_yaw_rad = state.yaw_rad  # of the vehicle: a position has none
            self._announcer.home_changed()
        self.is_given = True
        if state.home is not None:
            self.on_given(state.home)
        return ACCEPTED

    def set_here(self, down: float = nan) -> None:
        """The vehicle's own position; in the air `down` [m] is the height of the ground that it left, if known."""
        state = self._state
        north, east, own_down = state.estimate.pos_ned
        state.home_ned = (north, east, down if isfinite(down) else own_down)
        if state.landed_state is LandedState.ON_GROUND:
            state.stand_ned = state.home_ned
        state.home = GeoPoint(*geodetic_from_ned(*state.home_ned, state.origin))
        state.home_yaw_rad = state.yaw_rad
        self._announcer.home_changed()
