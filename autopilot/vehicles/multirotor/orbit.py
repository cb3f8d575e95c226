"""Orbit: flies round a point until another mode is chosen, or for a number of turns.

A pilot's sticks change it, as in PX4: forward flies a smaller circle, left flies faster clockwise (right in ArduPilot),
the throttle climbs; with the nose along the circle right flies a smaller one and forward flies faster.
"""

from enum import IntEnum
from math import cos, hypot, isfinite, nan, sin

from autopilot.inputs.sticks import StickInput, curved, without_centre
from autopilot.interface.client_requests import OrbitRequest
from autopilot.interface.mode_spec import FlightMode
from autopilot.interface.vehicle_state import ACCEPTED, Mode, OrbitStatus, Reply, Verdict
from autopilot.navigator.context import NavContext
from autopilot.navigator.modes.goto import ground_d
from autopilot.navigator.paths.orbit_circle import Circle, orbit_refusal, speed_limit
from autopilot.navigator.setpoint import Vector
from autopilot.vehicles.multirotor.stick_modes import speed_down_of, yaw_rate_of
from common.geodesy import GeoPoint

_RADIUS_MIN_M, _RADIUS_MAX_M = 1.0, 1000.0
_LOWEST_M = 1.0  # height above the ground, below which nobody flies sideways; guess
_CLEAR_M = 0.3  # below that height it climbs before it goes round; guess
_NEAR_M = 1.0  # distance from the circle at which the orbit begins
_DEFAULT_SPEED_M_S = 5.0  # unless the circle is too small for it; guess


class OrbitYaw(IntEnum):
    """Numbered as ORBIT_YAW_BEHAVIOUR."""

    TO_CENTRE = 0
    INITIAL = 1
    FREE = 2
    ALONG = 3
    BY_STICKS = 4
    UNCHANGED = 5


class Orbit(FlightMode):
    """Mode Orbit. Chosen without a request it circles a point ahead, at MC_ORBIT_RAD."""

    __slots__ = ("_context", "_is_on_circle", "_request", "_start_yaw", "_time_us", "_turns_rad", "_yaw", "circle")

    finishes_takeoff = True

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._request: OrbitRequest | None = None
        self.circle: Circle | None = None  # being flown
        self._is_on_circle = False
        self._start_yaw = 0.0
        self._yaw = OrbitYaw.TO_CENTRE
        self._turns_rad = 0.0
        self._time_us = 0

    def take(self, request: OrbitRequest) -> Reply:
        """Chooses the next orbit."""
        radius_m = self._radius_of(request)
        refusal = orbit_refusal(request, radius_m, (_RADIUS_MIN_M, _RADIUS_MAX_M), self._fastest(radius_m))
        if refusal:
            return _denied(refusal)
        if isfinite(request.alt_amsl_m) and self._context.down_of(request.alt_amsl_m) > self._lowest_d():
            return _denied(f"an orbit is flown {_LOWEST_M:g} m above the ground or higher")
        self._request = request
        return ACCEPTED

    def forget(self) -> None:
        self._request = None

    def goes_away(self) -> bool:
        return True

    def start(self) -> None:
        context = self._context
        request, self._request = self._request or self._ahead(), None
        radius_m = self._radius_of(request)
        here = context.stop_point()
        centre = self._centre_of(request, here)
        speed = abs(request.speed_m_s)
        if not isfinite(speed):
            speed = min(_DEFAULT_SPEED_M_S, 0.7 * self._fastest(radius_m))
        if request.speed_m_s < 0.0:
            radius_m = -radius_m
        if request.yaw != OrbitYaw.UNCHANGED:
            self._yaw = OrbitYaw(request.yaw)
        elif self.circle is None:
            self._yaw = OrbitYaw(int(context.number("MC_ORBIT_YAW_MOD")))
        self._turns_rad = request.turns_rad if isfinite(request.turns_rad) else 0.0
        self.circle = Circle(centre, radius_m, speed, here)
        self._tell(self.circle)
        self._is_on_circle = False
        self._start_yaw = context.state.yaw_rad
        self._time_us = context.state.time_us
        context.fly_to(self.circle.pos_ned, self._heading(self.circle), context.state.estimate.pos_ned)

    def leave(self, following: Mode) -> None:
        if following is not Mode.ORBIT:
            self.circle = None
            self._context.state.orbit = None

    def frame(self) -> None:
        context, circle = self._context, self.circle
        if context.is_on_ground or circle is None:
            return
        now_us = context.state.time_us
        dt_s = (now_us - self._time_us) * 1e-6
        self._time_us = now_us
        if not self._is_on_circle:
            north, east, down = context.state.estimate.pos_ned
            position = circle.pos_ned
            self._is_on_circle = (
                hypot(north - position[0], east - position[1]) < _NEAR_M
                and abs(down - position[2]) < context.number("NAV_MC_ALT_RAD")
                and down < self._lowest_d() + _CLEAR_M
            )
            return
        sticks = context.state.sticks
        away_m_s, down_m_s = 0.0, 0.0
        if sticks.has_pilot(now_us):
            away_m_s, down_m_s = self._adjust(circle, sticks, dt_s)
        circle.advance(dt_s)
        if 0.0 < self._turns_rad <= circle.turned_rad:
            context.hold_next(context.stop_point(), context.state.yaw_rad)
            return
        north, east, _ = circle.vel_ned
        vel_ned = (north + away_m_s * cos(circle.angle), east + away_m_s * sin(circle.angle), down_m_s)
        context.setpoint.track(circle.pos_ned, vel_ned, self._heading(circle), self._yaw_rate(circle))

    def _adjust(self, circle: Circle, sticks: StickInput, dt_s: float) -> tuple[float, float]:
        """Lets the pilot change the circle; returns the speeds [m/s] outwards and down with which it changes."""
        number, limits = self._context.number, self._context.craft.limits
        dead, expo = number("MAN_DEADZONE"), number("MPC_XY_MAN_EXPO")
        forward = curved(without_centre(sticks.pitch, dead), expo)
        right = curved(without_centre(sticks.roll, dead), expo)
        down_m_s = speed_down_of(self._context)
        if forward == right == down_m_s == 0.0:
            return 0.0, 0.0
        if self._yaw is OrbitYaw.ALONG:
            inwards, faster = circle.direction * right, circle.direction * forward
        else:
            inwards, faster = forward, right if sticks.is_ardupilot else -right
        away_m_s = -inwards * number(limits.cruise_speed)
        radius_m = circle.radius_m + away_m_s * dt_s
        circle.radius_m = min(max(radius_m, _RADIUS_MIN_M), _RADIUS_MAX_M)
        speed = circle.direction * circle.speed_m_s + faster * number(limits.accel_hor) * dt_s  # clockwise
        circle.speed_m_s = min(abs(speed), self._fastest(circle.radius_m))
        if speed != 0.0 and self._yaw is not OrbitYaw.ALONG:
            circle.direction = 1.0 if speed > 0.0 else -1.0
        elif speed * circle.direction < 0.0:
            circle.speed_m_s = 0.0  # it does not fly backwards
        north, east, down = circle.centre_ned
        lowest_d = self._lowest_d()
        if down_m_s > 0.0 and down + down_m_s * dt_s > lowest_d:
            down_m_s = 0.0
        circle.centre_ned = (north, east, down + down_m_s * dt_s)
        self._tell(circle)
        return away_m_s if circle.radius_m == radius_m else 0.0, down_m_s

    def _lowest_d(self) -> float:
        return ground_d(self._context) - _LOWEST_M

    def _tell(self, circle: Circle) -> None:
        centre = GeoPoint(*self._context.geodetic_of(circle.centre_ned))
        self._context.state.orbit = OrbitStatus(circle.direction * circle.radius_m, self._yaw, centre)

    def _yaw_rate(self, circle: Circle) -> float:
        if self._yaw is OrbitYaw.BY_STICKS:
            state = self._context.state
            return yaw_rate_of(self._context) if state.sticks.has_pilot(state.time_us) else 0.0
        return circle.yaw_rate if self._yaw in (OrbitYaw.TO_CENTRE, OrbitYaw.ALONG) else nan

    def _heading(self, circle: Circle) -> float:
        if self._yaw is OrbitYaw.TO_CENTRE:
            return circle.yaw_to_centre
        if self._yaw is OrbitYaw.ALONG:
            return circle.yaw_along
        return nan if self._yaw in (OrbitYaw.FREE, OrbitYaw.BY_STICKS) else self._start_yaw

    def _fastest(self, radius_m: float) -> float:
        """The speed [m/s] with which a circle can be flown."""
        number, limits = self._context.number, self._context.craft.limits
        return min(speed_limit(radius_m, number(limits.accel_hor)), number(limits.speed_max))

    def _radius_of(self, request: OrbitRequest) -> float:
        return request.radius_m if isfinite(request.radius_m) else self._context.number("MC_ORBIT_RAD")

    def _centre_of(self, request: OrbitRequest, here: Vector) -> Vector:
        context = self._context
        is_asked = isfinite(request.alt_amsl_m)
        down = context.down_of(request.alt_amsl_m) if is_asked else min(here[2], self._lowest_d())
        if isfinite(request.lat_deg):
            north, east, _ = context.pos_ned_of(request.lat_deg, request.lon_deg, context.state.position.alt_m)
            return north, east, down
        if self.circle is not None:  # the same centre, another circle
            return self.circle.centre_ned[0], self.circle.centre_ned[1], down
        return here[0], here[1], down

    def _ahead(self) -> OrbitRequest:
        """An orbit round the point ahead of the vehicle, which then is on the circle already."""
        context = self._context
        radius_m = context.number("MC_ORBIT_RAD")
        yaw = context.state.yaw_rad
        north, east, _ = context.stop_point()
        position = context.geodetic_of((north + radius_m * cos(yaw), east + radius_m * sin(yaw), 0.0))
        return OrbitRequest(lat_deg=position[0], lon_deg=position[1])


def _denied(reason: str) -> Reply:
    return Reply(Verdict.DENIED, reason)
