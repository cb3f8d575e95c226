"""Follow me: keeps a distance, a bearing and a height to a moving target, and looks at it.

In: the target's filtered position and velocity (`target_filter`). Out: a moving position setpoint, each frame. The
bearing is counted from the target's course, as PX4's FLW_TGT_FA; while the target stands, and before it has moved, its
last course counts, or the side on which the vehicle happens to be. A pilot's sticks change the distance (pitch), the
bearing (roll) and the height (throttle) until the mode is chosen anew; not in ArduPilot, where a throttle may rest low.
"""

from math import atan2, cos, hypot, isfinite, nan, radians, sin

from autopilot.inputs.sticks import StickInput
from autopilot.interface.client_requests import TargetReport
from autopilot.interface.mode_spec import FlightMode
from autopilot.interface.vehicle_state import ACCEPTED, Reply, Severity
from autopilot.navigator.context import NavContext
from autopilot.navigator.setpoint import Vector
from autopilot.navigator.target_filter import TargetFilter
from common.attitude import wrapped
from common.params import Parameter

LOST_US = 3_000_000  # a target not heard of for longer is waited for (ArduPilot's AP_FOLLOW_TIMEOUT_MS)
_ACCEL_PER_RESPONSE = 2.5  # [m/s²] of the filter per unit of FLW_TGT_RS; guess
_COURSE_TIME_S = 0.5  # in which a course known exactly is followed, and more per radian of its deviation; guess
_COURSE_TIME_PER_RAD_S = 6.0
_COURSE_STD_MAX_RAD = 0.7  # a direction known worse than that is not followed; guess
_COURSE_SPEED_M_S = 0.7  # below that the velocity has no direction worth turning for; guess
_TURN_ACCEL_M_S2 = 1.0  # of the way round the target; guess
_LOWEST_M = 1.0  # height above home never gone below; guess
FLAT, TERRAIN, FULL = 0, 1, 2  # FLW_TGT_ALT_M
# What full sticks change, and how far the wish may run ahead of the vehicle (PX4).
_CLIMB_M_S = 1.5
_RETREAT_M_S = 2.0
_TURN_RAD_S = 1.5
_AHEAD_S = 0.5
_STICK_DEAD = 0.1
_DISTANCE_MIN_M, _DISTANCE_MAX_M, _HEIGHT_MAX_M = 1.0, 100.0, 100.0


class Follow(FlightMode):
    """Mode Follow. Without a target it holds its place and waits."""

    __slots__ = (
        "_angle_rad", "_bearing", "_context", "_course", "_distance_m", "_height_m", "_is_waiting", "_speed_away",
        "_speed_down", "_speed_round", "_time_us", "target",
    )  # fmt: skip

    finishes_takeoff = True

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self.target = TargetFilter(_ACCEL_PER_RESPONSE * context.number("FLW_TGT_RS"))
        self._bearing = nan  # [rad] from the target to where the vehicle shall be
        self._course = nan  # [rad] of the target
        self._distance_m = self._angle_rad = self._height_m = nan  # asked for, by parameters and sticks
        self._speed_round = 0.0  # [m/s] of the setpoint round the target
        self._speed_away = self._speed_down = 0.0  # [m/s] with which sticks move it
        self._is_waiting = True
        self._time_us = 0
        context.params.on_change(self._on_parameter)

    def take(self, request: TargetReport) -> Reply:
        """The target says where it is."""
        report, now_us = request, self._context.state.time_us
        self.target.report(now_us, report.pos_ned, report.vel_ned, report.pos_std, report.vel_std)
        if isfinite(report.course_rad) and self.target.speed_xy < _COURSE_SPEED_M_S:
            self._course = report.course_rad
        return ACCEPTED

    def goes_away(self) -> bool:
        return True

    def start(self) -> None:
        self._is_waiting = False
        self._ask()
        self._bearing = nan
        self._speed_round = 0.0
        self._time_us = self._context.state.time_us

    def frame(self) -> None:
        context = self._context
        if context.is_on_ground:
            return
        now_us = context.state.time_us
        dt_s = (now_us - self._time_us) * 1e-6
        self._time_us = now_us
        target = self.target
        if target.time_us is None or now_us - target.heard_us > LOST_US:
            self._wait()
            return
        if self._is_waiting:
            self._is_waiting = False
            context.announcer.statustext(Severity.INFO, "Follow: target found")
        self._track(target, now_us, dt_s)

    def _wait(self) -> None:
        """Holds the position until the target is heard of."""
        context = self._context
        if self._is_waiting:
            return
        self._is_waiting = True
        self._bearing = nan
        self._speed_round = 0.0
        self._hold_still()
        context.announcer.statustext(Severity.NOTICE, "Follow: no target, waiting")

    def _track(self, target: TargetFilter, now_us: int, dt_s: float) -> None:
        context = self._context
        position = target.at(now_us)
        here = context.state.estimate.pos_ned
        if self._bearing != self._bearing:
            self._bearing = atan2(here[1] - position[1], here[0] - position[0])
        self._follow_course(target, dt_s)
        sticks = context.state.sticks
        self._speed_away = self._speed_down = 0.0
        if now_us <= sticks.heard_until_us and not sticks.is_ardupilot:
            self._adjust(sticks, position, here, dt_s)
        distance_m = self._distance_m
        rate = self._turn(distance_m, dt_s)
        north, east = cos(self._bearing), sin(self._bearing)
        pos_ned = (position[0] + distance_m * north, position[1] + distance_m * east, self._down(position))
        round_m_s, away_m_s = rate * distance_m, self._speed_away
        vel_ned = (
            target.vel_ned[0] - round_m_s * east + away_m_s * north,
            target.vel_ned[1] + round_m_s * north + away_m_s * east,
            self._speed_down,
        )
        offset = (position[0] - here[0], position[1] - here[1])
        yaw = atan2(offset[1], offset[0]) if hypot(*offset) > 0.5 else context.state.yaw_rad
        self._fly(pos_ned, vel_ned, yaw)

    def _fly(self, pos_ned: Vector, vel_ned: Vector, yaw: float) -> None:
        """Keeps to a moving place, the nose to the target."""
        self._context.setpoint.track(pos_ned, vel_ned, yaw)

    def _hold_still(self) -> None:
        context = self._context
        context.fly_to(context.stop_point(), context.state.yaw_rad)

    def _ask(self) -> None:
        """What is asked for is what the parameters say."""
        number = self._context.number
        self._distance_m = max(number("FLW_TGT_DST"), _DISTANCE_MIN_M)
        self._angle_rad = radians(number("FLW_TGT_FA"))
        self._height_m = number("FLW_TGT_HT")

    def _adjust(self, sticks: StickInput, position: Vector, here: Vector, dt_s: float) -> None:
        """Lets the pilot change what is asked for, as fast as the vehicle comes along."""
        north, east = here[0] - position[0], here[1] - position[1]
        if abs(sticks.throttle) > _STICK_DEAD and abs(self._down(position) - here[2]) < _CLIMB_M_S * _AHEAD_S:
            height_m = self._height_m + _CLIMB_M_S * sticks.throttle * dt_s
            self._height_m = min(max(height_m, _LOWEST_M), max(_HEIGHT_MAX_M, self._height_m))
            self._speed_down = -_CLIMB_M_S * sticks.throttle if self._height_m == height_m else 0.0
        if abs(sticks.pitch) > _STICK_DEAD and abs(hypot(north, east) - self._distance_m) < _RETREAT_M_S * _AHEAD_S:
            distance_m = self._distance_m + _RETREAT_M_S * sticks.pitch * dt_s
            self._distance_m = min(max(distance_m, _DISTANCE_MIN_M), max(_DISTANCE_MAX_M, self._distance_m))
            self._speed_away = _RETREAT_M_S * sticks.pitch if self._distance_m == distance_m else 0.0
        if abs(sticks.roll) > _STICK_DEAD:
            if not isfinite(self._course):
                self._course = self._bearing - self._angle_rad
            ahead = wrapped(self._course + self._angle_rad - atan2(east, north))
            if abs(ahead) < _TURN_RAD_S * _AHEAD_S:
                fastest = self._context.number(self._context.craft.limits.speed_max)
                rate = min(_TURN_RAD_S, fastest / self._distance_m)
                self._angle_rad = wrapped(self._angle_rad + rate * sticks.roll * dt_s)

    def _follow_course(self, target: TargetFilter, dt_s: float) -> None:
        """Takes the direction of the target's velocity, the more slowly the less it is known."""
        std = target.course_std
        if target.speed_xy < _COURSE_SPEED_M_S or std > _COURSE_STD_MAX_RAD:
            return
        course = atan2(target.vel_ned[1], target.vel_ned[0])
        if not isfinite(self._course):
            self._course = course
            return
        away = wrapped(course - self._course)
        self._course += away * min(dt_s / (_COURSE_TIME_S + _COURSE_TIME_PER_RAD_S * std), 1.0)

    def _turn(self, distance_m: float, dt_s: float) -> float:
        """Moves the bearing on towards the wanted one; returns its rate [rad/s]."""
        context = self._context
        if not isfinite(self._course):
            return 0.0
        away = wrapped(self._course + self._angle_rad - self._bearing)
        way_m = abs(away) * distance_m
        speed = min(context.number("FLW_TGT_MAX_VEL"), (2.0 * _TURN_ACCEL_M_S2 * way_m) ** 0.5, way_m / max(dt_s, 1e-3))
        speed = speed if away > 0.0 else -speed
        step = _TURN_ACCEL_M_S2 * dt_s
        self._speed_round += min(max(speed - self._speed_round, -step), step)
        rate = self._speed_round / distance_m
        self._bearing += rate * dt_s
        return rate

    def _down(self, position: Vector) -> float:
        """Down coordinate [m] of the height asked for."""
        context = self._context
        home_d = context.state.home_ned[2]
        kind = int(context.number("FLW_TGT_ALT_M"))
        base_d = home_d
        if kind == FULL:
            base_d = position[2]
        elif kind == TERRAIN:
            height_above_m, is_measured = context.height_above_ground()
            if is_measured:
                base_d = context.state.estimate.pos_ned[2] + height_above_m
        return min(base_d - self._height_m, home_d - _LOWEST_M)

    def _on_parameter(self, parameter: Parameter) -> None:
        if parameter.name == "FLW_TGT_RS":
            self.target.accel_std = _ACCEL_PER_RESPONSE * self._context.number("FLW_TGT_RS")
        elif parameter.name in ("FLW_TGT_DST", "FLW_TGT_FA", "FLW_TGT_HT"):
            self._ask()
