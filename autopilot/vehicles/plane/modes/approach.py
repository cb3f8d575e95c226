"""Landing: down a circle to the height of the approach, down the glide slope, flare, and a stop on wheels or belly.

In: where to touch down and, perhaps, from where. Out: setpoints until the plane stands. Without a direction it lands
against the wind as it is felt at the beginning, in a calm along the heading of the take-off. The slope is PX4's
FW_LND_ANG, the flare FW_LND_FL_*.

A client may give it up (go round): it climbs to MIS_LND_ABRT_ALT and circles the touchdown until something else is
asked for. By itself it gives up what is hopeless, and tries again.
"""

from enum import IntEnum
from math import atan2, cos, hypot, isfinite, nan, pi, radians, sin, sqrt, tan

from autopilot.interface.client_requests import LandAt
from autopilot.interface.mode_spec import FlightMode
from autopilot.interface.vehicle_state import ACCEPTED, BatteryLevel, Reply, Severity, Verdict
from autopilot.navigator.context import NavContext
from autopilot.navigator.modes.goto import target_refusal
from autopilot.navigator.setpoint import Vector
from autopilot.ports import AIRSPEED_VALID, TERRAIN_VALID
from autopilot.vehicles.plane.modes.departure import airspeed_of
from common.kernels import FRAME_US

_ENTRY_M = 30.0  # height over the touchdown of the beginning of the slope; guess: over trees
_LEAD_S = 5.0  # of level flight before the slope; guess
_CALM_M_S = 1.5  # a weaker wind has no direction; guess
_ALIGNED_RAD = radians(20.0)
_NEAR_PART = 0.5  # of the circle's radius, from the entry at which it may be left
_PATH_LAG_S = 0.7  # of the sink behind what a flare asks for; guess: a rounded-out flare was that much late
_FAR_M = 10_000.0
_REACHED_M = 2.0  # below the height to which it goes round; guess
_MISSED_M = 40.0  # beyond the touchdown, where no flare begins any more; guess
_RETRIES = 2  # then it takes what it gets; guess
_CLIMB_US, _CLIMBS_M = 8_000_000, 2.0  # what it must have risen by then to go on climbing; guess
_FRAME_S = FRAME_US * 1e-6
_THROTTLE_TAU_S = 3.0  # over which the throttle of the slope is averaged; guess: longer than a gust
_LONG_FLARE_US = 8_000_000  # guess
_DOWN_M_S = 0.2  # sinks no faster once it stands on its wheels
_TOUCH_M = 0.4  # height of the wheels, as measured, below which that is a touchdown; guess
_GROUND_SEEN_M = 150.0  # way from the touchdown on which the ground below is more and more believed; guess
_ROUGH_M = 3.0  # ground farther from where the touchdown was said to be is not believed to be that; guess


class _Phase(IntEnum):
    CIRCLE = 0
    SLOPE = 1
    FLARE = 2
    ROLL = 3
    CLIMB = 4  # it goes round
    WAIT = 5  # round the touchdown


class Approach:
    """One landing."""

    __slots__ = (
        "_along",
        "_begin",
        "_centre",
        "_climb_us",
        "_context",
        "_entry",
        "_far",
        "_flare_us",
        "_has_seen_ground",
        "_low_d",
        "_phase",
        "_retries",
        "_target",
        "_throttle",
        "_tries_again",
        "_up_d",
        "_yaw",
    )

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._phase = _Phase.CIRCLE
        self._target: Vector = (0.0, 0.0, 0.0)  # [m] where the wheels shall touch; down of the ground
        self._yaw = 0.0  # [rad] of the approach
        self._along = (1.0, 0.0)
        self._entry: Vector = (0.0, 0.0, 0.0)
        self._centre: Vector = (0.0, 0.0, 0.0)
        self._flare_us = 0
        self._begin = (1.0, 0.0, 0.0)  # of the flare: height [m], sink [m/s], throttle
        self._up_d = 0.0  # [m] to which it climbs where it goes round
        self._climb_us = 0  # when the climb began
        self._low_d = 0.0  # [m] where
        self._far: Vector = (0.0, 0.0, 0.0)
        self._throttle = nan  # on the slope, without what single gusts ask for
        self._retries = 0  # left, where it gives up by itself
        self._tries_again = False
        self._has_seen_ground = False

    def start(self, target: Vector, yaw: float = nan, *, is_lined_up: bool = False) -> None:
        """Begins a landing.

        Args:
            target: [m] the touchdown, its down coordinate that of a plane that stands there.
            yaw: [rad] direction of the approach; NaN: against the wind.
            is_lined_up: it comes along that direction, low and far enough for the slope.
        """
        self._retries = _RETRIES
        self._target = target
        self._yaw = yaw if isfinite(yaw) else self._upwind()
        self._along = (cos(self._yaw), sin(self._yaw))
        number = self._context.number
        away_m = _ENTRY_M / tan(radians(number("FW_LND_ANG"))) + _LEAD_S * number("FW_AIRSPD_TRIM")
        north, east = self._along
        self._entry = (target[0] - north * away_m, target[1] - east * away_m, target[2] - _ENTRY_M)
        radius = self._radius()
        self._centre = (self._entry[0] - east * radius, self._entry[1] + north * radius, self._entry[2])
        self._phase = _Phase.SLOPE if is_lined_up else _Phase.CIRCLE
        self._has_seen_ground = False
        self._throttle = nan
        if self._phase is _Phase.CIRCLE:
            self._circle(self._centre)

    def frame(self) -> None:
        """Flies on, until the landing detector ends it."""
        context = self._context
        if context.is_on_ground:
            return
        if self._phase is _Phase.CIRCLE:
            if self._may_leave():
                self._phase = _Phase.SLOPE
            return
        if self._phase in (_Phase.CLIMB, _Phase.WAIT):
            self._go_round()
            return
        context.is_landing = True
        if self._phase is _Phase.SLOPE:
            self._slide()
        elif self._phase is _Phase.FLARE:
            self._flare()
        else:
            context.setpoint.drive(throttle=-1.0, yaw=self._yaw)

    def _may_leave(self) -> bool:
        """Whether it passes the entry, low and in the direction of the slope."""
        context = self._context
        (north, east, down), (vel_n, vel_e, _) = context.state.estimate.pos_ned, context.state.estimate.vel_ned
        off = hypot(north - self._entry[0], east - self._entry[1])
        turn = abs((atan2(vel_e, vel_n) - self._yaw + pi) % (2.0 * pi) - pi)
        is_low = abs(down - self._entry[2]) < context.number("NAV_FW_ALTL_RAD")
        return is_low and turn < _ALIGNED_RAD and off < _NEAR_PART * self._radius()

    def _slide(self) -> None:
        context = self._context
        north, east, _ = context.state.estimate.pos_ned
        vel_n, vel_e, sink = context.state.estimate.vel_ned
        slope = tan(radians(context.number("FW_LND_ANG")))
        left_m = self._left_m(north, east)
        speed = max(vel_n * self._along[0] + vel_e * self._along[1], 0.0)
        aim_m = left_m - self._flare_gain_m(speed, slope)
        down = self._ground_d(left_m) - max(aim_m, 0.0) * slope
        is_above = down < self._entry[2]
        self._glide(max(down, self._entry[2]), 0.0 if is_above else slope * speed, nan)
        if context.state.estimate.flags & TERRAIN_VALID:
            self._has_seen_ground = True
        throttle = context.state.actuators.thrust_sp
        before = self._throttle if isfinite(self._throttle) else throttle
        self._throttle = before + (throttle - before) * _FRAME_S / _THROTTLE_TAU_S
        is_low = self._height() < self._flare_begin_m(sink)
        reason = self._hopeless(left_m) if is_low or left_m < -_MISSED_M else ""
        if reason and self._retries:
            self._try_again(reason)
        elif is_low:
            self._phase = _Phase.FLARE
            self._flare_us = context.state.time_us
            kept = max(throttle, self._throttle) if self._is_slow() else self._throttle
            self._begin = (max(self._height(), 0.1), slope * speed, kept)

    def _flare(self) -> None:
        """Down a parabola that touches the ground with FW_LND_FL_SINK, at the touchdown if that is not nearer.

        The throttle is closed on the way, as the height falls, and no later than in the time that the parabola takes:
        what is left of the speed carries it that far.
        """
        context = self._context
        north, east, _ = context.state.estimate.pos_ned
        vel_n, vel_e, _ = context.state.estimate.vel_ned
        speed = vel_n * self._along[0] + vel_e * self._along[1]
        least, idle = context.number("FW_LND_FL_SINK"), context.number("FW_THR_IDLE")
        begin_m, begin_sink, throttle = self._begin
        part = min(max(self._height(), 0.0) / begin_m, 1.0)
        left_s = max(self._left_m(north, east) / max(speed, 1.0), 0.1)
        most = least + max(begin_sink - least, 0.0) * sqrt(part)
        sink = min(max(2.0 * part * begin_m / left_s - least, least), most)
        flared_us = context.state.time_us - self._flare_us
        due_us = 2e6 * begin_m / max(begin_sink + least, 0.1)
        is_open = min(part, max(1.0 - flared_us / due_us, 0.0))
        self._glide(nan, sink, idle + max(throttle - idle, 0.0) * is_open)
        is_down = context.state.estimate.vel_ned[2] < _DOWN_M_S and self._height() < _TOUCH_M
        is_long = flared_us > (_LONG_FLARE_US if self._height() < begin_m else 2 * _LONG_FLARE_US)
        if flared_us > due_us and self._height() > 2.0 * begin_m and self._retries and self._has_charge():
            self._try_again("too high")
        elif (is_down and flared_us > 1_000_000) or is_long:
            self._phase = _Phase.ROLL

    def _is_slow(self) -> bool:
        """Whether it nears the stall, and needs the throttle that it has now."""
        context = self._context
        is_known = bool(context.state.estimate.flags & AIRSPEED_VALID)
        return is_known and 2.0 * airspeed_of(context) < context.number("FW_AIRSPD_MIN") + context.number(
            "FW_AIRSPD_STALL"
        )

    def _has_charge(self) -> bool:
        return self._context.state.battery_level is not BatteryLevel.EMERGENCY

    def _left_m(self, north: float, east: float) -> float:
        """[m] To go to the touchdown, along the approach."""
        return (self._target[0] - north) * self._along[0] + (self._target[1] - east) * self._along[1]

    def _flare_begin_m(self, sink: float) -> float:
        number = self._context.number
        return max(number("FW_LND_FLALT"), number("FW_LND_FL_TIME") * sink)

    def _flare_gain_m(self, speed: float, slope: float) -> float:
        """[m] By which the parabola of the flare leads farther than the slope that it ends, until it is followed."""
        sink = slope * speed
        begin_m = max(self._flare_begin_m(sink) - _PATH_LAG_S * sink, 0.0)
        both = sink + self._context.number("FW_LND_FL_SINK")
        return begin_m * (2.0 * speed / both - 1.0 / slope) if both > 0.0 else 0.0  # it stands in the wind

    def _ground_d(self, left_m: float) -> float:
        """[m] Of a plane that stands at the touchdown: as was said, and nearer to it as the ground is measured."""
        estimate, said_d = self._context.state.estimate, self._target[2]
        if not estimate.flags & TERRAIN_VALID:
            return said_d
        off_m = estimate.terrain_d - self._context.craft.standing_height_m - said_d
        return said_d + (off_m * min(max(1.0 - left_m / _GROUND_SEEN_M, 0.0), 1.0) if abs(off_m) < _ROUGH_M else 0.0)

    # ---- going round ----

    def go_around(self, height_m: float) -> Reply:
        """Gives the landing up, for a client: to a height above the touchdown [m], at least MIS_LND_ABRT_ALT."""
        if self._context.is_on_ground or self._phase is _Phase.ROLL:
            return Reply(Verdict.TEMPORARILY_REJECTED, "not landing: it is on the ground")
        if self._phase is _Phase.WAIT:
            return Reply(Verdict.TEMPORARILY_REJECTED, "not landing: it goes round already")
        if self._phase is _Phase.CIRCLE:
            return Reply(Verdict.TEMPORARILY_REJECTED, "not landing: it is not on the slope yet")
        usual_m = self._context.number("MIS_LND_ABRT_ALT")
        up_m = max(height_m, usual_m) if isfinite(height_m) else usual_m
        refusal = target_refusal(self._context, (self._target[0], self._target[1], self._target[2] - up_m))
        if refusal is not ACCEPTED:
            return refusal
        self._tries_again = False
        self._give_up(up_m, "Landing aborted: going round")
        return ACCEPTED

    def _hopeless(self, left_m: float) -> str:
        """Why no flare should begin; empty if it may."""
        context = self._context
        north, east, _ = context.state.estimate.pos_ned
        if not self._has_charge():
            return ""
        across_m = (east - self._target[1]) * self._along[0] - (north - self._target[0]) * self._along[1]
        most_m, bits = context.number("HG_FW_LND_OFF"), int(context.number("FW_LND_ABORT"))
        if most_m and abs(across_m) > most_m:
            return f"{abs(across_m):.0f} m beside it"
        if left_m < -_MISSED_M:
            return "too far"
        if not context.state.estimate.flags & TERRAIN_VALID and bits & (2 if self._has_seen_ground else 1):
            return "no height over ground is measured"
        return ""

    def _try_again(self, reason: str) -> None:
        self._retries -= 1
        self._tries_again = True
        self._give_up(self._context.number("MIS_LND_ABRT_ALT"), f"Landing aborted: {reason}, trying again")

    def _give_up(self, height_m: float, text: str) -> None:
        context = self._context
        context.announcer.statustext(Severity.WARNING, text)
        self._phase = _Phase.CLIMB
        north, east, down = context.state.estimate.pos_ned
        self._up_d = min(self._target[2] - height_m, down)
        self._climb_us, self._low_d = context.state.time_us, down
        self._far = (north + _FAR_M * self._along[0], east + _FAR_M * self._along[1], nan)
        climb = context.number("FW_T_CLMB_MAX")
        context.setpoint.glide(self._far, (north, east, nan), -climb, airspeed=nan, throttle=nan)

    def _go_round(self) -> None:
        """Straight up; then round the touchdown, or down for the next try."""
        state = self._context.state
        down = state.estimate.pos_ned[2]
        if self._phase is _Phase.WAIT:
            return
        if down > self._up_d + _REACHED_M:
            if state.time_us - self._climb_us > _CLIMB_US and down > self._low_d - _CLIMBS_M:
                self._context.announcer.statustext(Severity.CRITICAL, "It does not climb: landing ahead")
                self._phase, self._retries, self._throttle = _Phase.SLOPE, 0, nan
            return
        if self._tries_again:
            left = self._retries
            self.start(self._target, self._yaw)
            self._retries = left
        else:
            self._phase = _Phase.WAIT
            self._circle((self._target[0], self._target[1], self._up_d))

    def _circle(self, centre: Vector) -> None:
        self._context.setpoint.fly_to(centre, nan, pass_radius=self._radius())

    def _glide(self, down: float, sink: float, throttle: float) -> None:
        target = (self._target[0], self._target[1], down)
        start = (self._entry[0], self._entry[1], nan)
        self._context.setpoint.glide(target, start, sink, airspeed=self._landing_m_s(), throttle=throttle)

    def _height(self) -> float:
        """[m] of the wheels over the ground: measured, or by the height of the touchdown."""
        context = self._context
        height, is_measured = context.height_above_ground()
        if is_measured:
            return height - context.craft.standing_height_m
        return self._target[2] - context.state.estimate.pos_ned[2]

    def _landing_m_s(self) -> float:
        asked = self._context.number("FW_LND_AIRSPD")
        return asked if asked > 0.0 else self._context.number("FW_AIRSPD_MIN")

    def _radius(self) -> float:
        return self._context.number("NAV_LOITER_RAD")

    def _upwind(self) -> float:
        """[rad] Where the wind comes from, felt as the difference of the speeds; in a calm as it took off."""
        state = self._context.state
        vel_n, vel_e, _ = state.estimate.vel_ned
        if not state.estimate.flags & AIRSPEED_VALID:
            return state.home_yaw_rad
        speed = airspeed_of(self._context) * cos(state.pitch_rad)
        north, east = vel_n - speed * cos(state.yaw_rad), vel_e - speed * sin(state.yaw_rad)
        return atan2(-east, -north) if hypot(north, east) > _CALM_M_S else state.home_yaw_rad


class PlaneLand(FlightMode):
    """Mode Land: at a place if one was asked for, else where it last stood; against the wind."""

    __slots__ = ("_approach", "_context", "_place", "_yaw")

    is_below_floor = True

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._approach = Approach(context)
        self._place: Vector | None = None
        self._yaw = nan

    def take(self, request: LandAt) -> Reply:
        """Sets place and direction of the next landing."""
        lat_deg, lon_deg = request.lat_deg, request.lon_deg
        if isfinite(lat_deg) != isfinite(lon_deg) or abs(lat_deg) > 90.0 or abs(lon_deg) > 180.0:
            return Reply(Verdict.DENIED, "there is no such latitude and longitude")
        self._place = None
        if isfinite(lat_deg) and not (lat_deg == 0.0 and lon_deg == 0.0):
            place = self._context.pos_ned_of(lat_deg, lon_deg, self._context.state.position.alt_m)
            refusal = self._context.fence_refusal(place)
            if refusal:
                return Reply(Verdict.DENIED, f"landing place is {refusal}")
            self._place = place
        self._yaw = request.yaw_rad
        return ACCEPTED

    def go_around(self, height_m: float) -> Reply:
        return self._approach.go_around(height_m)

    def forget(self) -> None:
        self._place, self._yaw = None, nan

    def start(self) -> None:
        ground = self._context.state.stand_ned or self._context.state.home_ned
        place = self._place or ground
        self._approach.start((place[0], place[1], ground[2]), self._yaw)

    def frame(self) -> None:
        self._approach.frame()
