"""Landing: straight down over one position, slower near the ground; blind if the position is lost."""

from math import hypot, isfinite, nan

from autopilot.interface.client_requests import LandAt
from autopilot.interface.mode_spec import FlightMode
from autopilot.interface.vehicle_state import ACCEPTED, Reply, Verdict
from autopilot.navigator.context import NavContext
from autopilot.navigator.setpoint import Vector
from autopilot.navigator.takeoff_intent import is_near_start

_BLIND_THRUST_FRACTION = 0.92  # of the hover thrust: sinks at a few m/s against inflow and drag; guess
_BLIND_STEADY_S = 20.0  # after that the thrust falls further, so that a vehicle that already stands notices it; guess
_BLIND_FALL_1_S = 0.02  # fraction of the hover thrust per second; guess
_TOUCHING_US = 700_000  # longer than it takes to begin a descent; guess
_SLOW_BELOW_M = 30.0  # height above home below which ground may be anywhere, far from home; guess


class Landing:
    """The last descent, until the landing detector ends it."""

    __slots__ = ("_blind_since_us", "_context", "_east", "_is_blind", "_moving_us", "_north", "_vel_ned", "_yaw")

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._north = self._east = self._yaw = 0.0
        self._is_blind = False
        self._moving_us = 0  # when it last really descended
        self._blind_since_us = 0
        self._vel_ned: Vector | None = None  # of a place that moves

    def start(self, north: float, east: float, yaw: float) -> None:
        """Descends over a position [m] with a heading [rad], NaN: the present one."""
        self._north, self._east, self._vel_ned = north, east, None
        self._yaw = yaw if isfinite(yaw) else self._context.state.yaw_rad
        self._is_blind = False
        self._moving_us = self._context.state.time_us

    def move(self, north: float, east: float, vel_ned: Vector) -> None:
        """The position has become another [m], and goes on at a velocity [m/s]: renewed each frame."""
        self._north, self._east, self._vel_ned = north, east, vel_ned

    def frame(self) -> None:
        context = self._context
        if context.is_on_ground:
            return
        context.is_landing = True
        if context.has_position:
            if self._is_blind:  # the position is back: land here
                self._is_blind = False
                self._north, self._east, _ = context.stop_point()
                self._vel_ned = None
            speed = self._pushed(self._speed())
            if self._vel_ned is not None:
                context.setpoint.track_down((self._north, self._east), self._vel_ned, speed, self._yaw)
                return
            context.setpoint.descend_at(self._north, self._east, speed, self._yaw, context.cruise_speed)
            return
        if not self._is_blind:
            self._is_blind = True
            self._blind_since_us = context.state.time_us
        if context.has_height and context.state.estimate.vel_std < context.number("COM_VEL_FS_EVH"):
            context.setpoint.descend_braking(self._pushed(self._speed()), self._yaw)
        elif context.has_height:
            context.setpoint.descend_level(self._pushed(self._speed()), self._yaw)
        else:
            context.setpoint.hover_level(context.craft.lift_thrust * self._blind_thrust_fraction(), self._yaw)

    def _blind_thrust_fraction(self) -> float:
        """Fraction of the hover thrust for sinking without knowing the height."""
        blind_s = (self._context.state.time_us - self._blind_since_us) * 1e-6
        return max(_BLIND_THRUST_FRACTION - _BLIND_FALL_1_S * max(blind_s - _BLIND_STEADY_S, 0.0), 0.0)

    def _pushed(self, speed: float) -> float:
        """The speed, or more of it once the vehicle no longer sinks: on the ground the thrust falls at once then."""
        context = self._context
        if context.state.estimate.vel_ned[2] > 0.5 * speed:
            self._moving_us = context.state.time_us
        is_touching = context.state.time_us - self._moving_us > _TOUCHING_US
        return max(speed, context.number(context.vertical.descend_speed)) if is_touching else speed

    def _speed(self) -> float:
        """Descent speed [m/s]: the usual one high up, the landing's low, the crawl speed just above the ground."""
        context = self._context
        slow = context.number(context.ground.land_speed)
        fast = context.number(context.vertical.descend_speed)
        height, is_measured = context.height_above_ground()
        if not is_measured:
            is_known_ground = is_near_start(context.state, self._north, self._east)
            return slow if height < _SLOW_BELOW_M and not is_known_ground else _blend(context, height, slow, fast)
        if height < context.number(context.ground.crawl_height):
            return min(slow, context.number(context.ground.crawl_speed))
        return _blend(context, height, slow, fast)


def _blend(context: NavContext, height: float, slow: float, fast: float) -> float:
    """Speed between the heights where a descent is slow and where it begins to slow down, in steps of 0.05 m/s."""
    high = context.number(context.ground.slowing_height)
    low = context.number(context.ground.slow_height)
    if height >= high:
        return max(slow, fast)
    if not height > low or fast <= slow:  # also where the height is not a number
        return slow
    return round((slow + (fast - slow) * (height - low) / (high - low)) * 20.0) / 20.0


def slowed_near_ground(context: NavContext, fast: float) -> float:
    """[m/s] The greatest descent speed here, as in a landing; `fast` high up, and where the ground is not known."""
    height, is_measured = context.height_above_ground()
    here = context.state.estimate.pos_ned
    if not is_measured and not is_near_start(context.state, here[0], here[1]):
        return fast
    return _blend(context, height, min(context.number(context.ground.land_speed), fast), fast)


class Land(FlightMode):
    """Mode Land: at a given position if one was asked for, otherwise here."""

    __slots__ = ("_context", "_landing", "_position", "_yaw")

    is_below_floor = True

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._landing = Landing(context)
        self._position: Vector | None = None  # still to be reached
        self._yaw = nan

    def take(self, request: LandAt) -> Reply:
        """Sets place and heading of the next landing; without a position it is where the vehicle can stop."""
        lat_deg, lon_deg = request.lat_deg, request.lon_deg
        if isfinite(lat_deg) != isfinite(lon_deg) or abs(lat_deg) > 90.0 or abs(lon_deg) > 180.0:
            return Reply(Verdict.DENIED, "there is no such latitude and longitude")
        context, position = self._context, None
        if isfinite(lat_deg) and not (lat_deg == 0.0 and lon_deg == 0.0):
            position = context.pos_ned_of(lat_deg, lon_deg, context.state.position.alt_m)
            refusal = context.fence_refusal(position)
            if refusal:
                return Reply(Verdict.DENIED, f"landing place is {refusal}")
        self._position = position
        self._yaw = request.yaw_rad
        return ACCEPTED

    def forget(self) -> None:
        self._position, self._yaw = None, nan

    def start(self) -> None:
        context = self._context
        position, yaw = self._position, self._yaw
        if position is not None and context.has_position:
            start = context.stop_point()
            self._position = (position[0], position[1], start[2])
            context.fly_to(self._position, context.heading_to(start, self._position, yaw), start)
            return
        self._position = None
        self._yaw = nan
        if context.has_position:
            north, east, _ = context.stop_point()
        else:
            north, east, _ = context.state.estimate.pos_ned
        self._landing.start(north, east, yaw)

    def frame(self) -> None:
        position = self._position
        if position is None:
            self._landing.frame()
            return
        here = self._context.state.estimate.pos_ned
        is_there = hypot(here[0] - position[0], here[1] - position[1]) < 0.5 * self._context.number("NAV_ACC_RAD")
        if is_there or not self._context.has_position:
            self._position = None
            self._landing.start(position[0], position[1], self._yaw)
            self._yaw = nan
            self._landing.frame()
