"""Orbit: drives round a point until another mode is chosen, or for a number of turns; ArduPilot's Circle.

The course is the circle's at the place where the rover is, and closes in on it by a look-ahead, as on a line.
"""

from math import atan, atan2, cos, hypot, isfinite, nan, pi, radians, sin, sqrt

from autopilot.interface.client_requests import OrbitRequest
from autopilot.interface.mode_spec import FlightMode
from autopilot.interface.vehicle_state import ACCEPTED, Mode, OrbitStatus, Reply, Verdict
from autopilot.navigator.context import NavContext
from autopilot.navigator.paths.orbit_circle import orbit_refusal
from common.attitude import wrapped
from common.geodesy import GeoPoint

_ALONG = 3  # ORBIT_YAW_BEHAVIOUR: the nose shows where it goes
_RADIUS_MAX_M = 1000.0
_ROOM = 1.2  # of the tightest turn: the smallest circle, so that it can be closed in on
_GRIP = 0.8  # of the lateral acceleration allowed


class RoverOrbit(FlightMode):
    """Mode Orbit. Chosen without a request it circles a point ahead of it, as ArduPilot does."""

    __slots__ = (
        "_bearing",
        "_centre",
        "_context",
        "_direction",
        "_radius_m",
        "_request",
        "_speed",
        "_turned",
        "_turns",
    )

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._request: OrbitRequest | None = None
        self._centre = (0.0, 0.0)  # [m]
        self._radius_m = self._speed = 1.0
        self._direction = 1.0  # clockwise seen from above
        self._bearing = nan  # [rad] from the centre, in the frame before
        self._turned = self._turns = 0.0  # [rad]

    def take(self, request: OrbitRequest) -> Reply:
        """Chooses the next circle."""
        radius_m = abs(self._radius_of(request))
        bounds_m = (self._least_radius_m(), _RADIUS_MAX_M)
        refusal = orbit_refusal(request, radius_m, bounds_m, self._fastest(radius_m))
        if refusal:
            return Reply(Verdict.DENIED, refusal)
        self._request = request
        return ACCEPTED

    def refusal(self) -> str:
        return "" if self._fastest(self._least_radius_m()) > 0.0 else "no circle within the limits of speed and turns"

    def forget(self) -> None:
        self._request = None

    def goes_away(self) -> bool:
        return True

    def start(self) -> None:
        context, number = self._context, self._context.number
        request, self._request = self._request or OrbitRequest(), None
        radius_m = self._radius_of(request)
        self._radius_m = max(abs(radius_m), self._least_radius_m())
        speed = request.speed_m_s
        if not isfinite(speed):
            speed = number("HG_RO_CIRC_SPD") or number(context.craft.limits.cruise_speed)
            speed = min(speed, self._fastest(self._radius_m))
        self._direction = 1.0 if (radius_m < 0.0) == (speed < 0.0) else -1.0
        self._speed = abs(speed)
        self._turns = request.turns_rad if isfinite(request.turns_rad) else 0.0
        self._turned, self._bearing = 0.0, nan
        if isfinite(request.lat_deg):
            north, east, _ = context.pos_ned_of(request.lat_deg, request.lon_deg, context.state.position.alt_m)
        else:
            yaw = context.state.yaw_rad
            north, east, _ = context.state.estimate.pos_ned
            north, east = north + self._radius_m * cos(yaw), east + self._radius_m * sin(yaw)
        self._centre = (north, east)
        centre = GeoPoint(*context.geodetic_of((north, east, context.state.estimate.pos_ned[2])))
        context.state.orbit = OrbitStatus(self._direction * self._radius_m, _ALONG, centre)

    def leave(self, following: Mode) -> None:
        if following is not Mode.ORBIT:
            self._context.state.orbit = None

    def frame(self) -> None:
        context = self._context
        north, east, _ = context.state.estimate.pos_ned
        north, east = north - self._centre[0], east - self._centre[1]
        distance_m = hypot(north, east)
        bearing = atan2(east, north) if distance_m > 0.0 else 0.0
        off_m = distance_m - self._radius_m
        reach_m = max(context.number("PP_LOOKAHD_GAIN") * self._speed, context.number("PP_LOOKAHD_MIN"))
        if abs(off_m) < reach_m and isfinite(self._bearing):
            self._turned += self._direction * wrapped(bearing - self._bearing)
        self._bearing = bearing
        if 0.0 < self._turns <= self._turned:
            context.wish = Mode.HOLD
            return
        course = bearing + self._direction * (0.5 * pi + atan(off_m / reach_m))
        rate = self._direction * self._speed / max(distance_m, self._radius_m) if abs(off_m) < reach_m else 0.0
        context.setpoint.drive(speed=self._speed, yaw=wrapped(course), yaw_rate=rate)

    def _radius_of(self, request: OrbitRequest) -> float:
        """[m] positive is clockwise."""
        if isfinite(request.radius_m):
            return request.radius_m
        number = self._context.number
        return -number("HG_RO_CIRC_RAD") if number("HG_RO_CIRC_DIR") else number("HG_RO_CIRC_RAD")

    def _least_radius_m(self) -> float:
        turning = self._context.craft.limits.turning
        return max(_ROOM * turning.radius(self._context.number), 0.5) if turning else 0.5

    def _fastest(self, radius_m: float) -> float:
        """The speed [m/s] with which a circle can be driven."""
        number, limits = self._context.number, self._context.craft.limits
        turning = radians(number(limits.yaw_rate))
        by_grip = sqrt(_GRIP * number(limits.accel_across) * radius_m)
        return float(min(by_grip, number(limits.speed_max), turning * radius_m))
