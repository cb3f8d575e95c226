"""Precision landing: down onto a target that something on board sees (a beacon, a marker).

In: places of the target in ned, as often as it is seen. Out: setpoints: over the target, down with it in the middle,
and the last bit without looking, or along with a target that moves. While it is not seen the vehicle searches from
PLD_SRCH_ALT; what is not found within PLD_SRCH_TOUT or PLD_MAX_SRCH searches ends in a normal landing.
"""

from enum import IntEnum
from math import hypot, nan

from autopilot.interface.client_requests import LandingTargetReport
from autopilot.interface.mode_spec import FlightMode
from autopilot.interface.vehicle_state import ACCEPTED, Reply, Severity
from autopilot.navigator.context import NavContext
from autopilot.navigator.modes.goto import ground_d
from autopilot.navigator.modes.land import Landing
from autopilot.navigator.target_filter import TargetFilter

FRESH_US = 1_000_000  # older sightings say nothing about now
_ACCEL_STD_M_S2 = 0.3  # of a platform that stands or moves steadily; guess
_SIGHT_STD_M = 0.1  # of one sighting; guess
_LOWEST_M = 1.0  # height above the ground of the approach, at least: nobody flies sideways below that; guess
_MOVES_M_S = 0.2  # a target that is faster is on something that drives; slower may be noise; guess
_CENTRED_FRACTION = 3.0  # times PLD_HACC_RAD: further off the descent stops until it is centred again; guess


class _Phase(IntEnum):
    APPROACH = 0  # level, to over the target
    DESCEND = 1
    SEARCH = 2
    LAND = 3  # the last bit, or a normal landing


class PrecisionLand(FlightMode):
    """Mode Precision land."""

    __slots__ = (
        "_approach_d",
        "_context",
        "_is_moving",
        "_landing",
        "_phase",
        "_searches",
        "_until_us",
        "_yaw",
        "target",
    )

    is_below_floor = True

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._landing = Landing(context)
        self.target = TargetFilter(_ACCEL_STD_M_S2)
        self._phase = _Phase.APPROACH
        self._is_moving = False  # the target, on the last bit
        self._searches = 0
        self._until_us = 0
        self._approach_d = 0.0  # [m]
        self._yaw = 0.0  # [rad]

    def take(self, request: LandingTargetReport) -> Reply:
        """The target has been seen."""
        self.target.report(self._context.state.time_us, request.pos_ned, None, _SIGHT_STD_M)
        return ACCEPTED

    @property
    def sees_target(self) -> bool:
        return self.target.time_us is not None and self._context.state.time_us - self.target.heard_us < FRESH_US

    def start(self) -> None:
        self._searches = 0
        if self.sees_target:
            self._approach()
        else:
            self._search()

    def frame(self) -> None:
        context = self._context
        if context.is_on_ground:
            return
        if self._phase is _Phase.LAND:
            if self._is_moving:
                north, east, _ = self.target.at(context.state.time_us)
                self._landing.move(north, east, self.target.vel_ned)
            self._landing.frame()
            return
        if not context.has_position:
            self._land("position lost")
            return
        if self._phase is _Phase.SEARCH:
            if self.sees_target:
                self._approach()
            elif context.state.time_us > self._until_us:
                self._land("target not found")
            return
        self._over_target()

    def _over_target(self) -> None:
        """Approach and descent: keeps over the target, and sinks while it is in the middle."""
        context, target = self._context, self.target
        now_us = context.state.time_us
        if now_us - target.heard_us > context.number("PLD_BTOUT") * 1e6:
            self._search()
            return
        position = target.at(now_us)
        here = context.state.estimate.pos_ned
        off_m = hypot(here[0] - position[0], here[1] - position[1])
        height_m, _ = context.height_above_ground()
        reach_m = max(context.number("PLD_HACC_RAD"), 0.05)
        if self._phase is _Phase.APPROACH and off_m < reach_m:
            self._phase = _Phase.DESCEND
        elif self._phase is _Phase.DESCEND and off_m > _CENTRED_FRACTION * reach_m and self.sees_target:
            self._approach()
        if self._phase is _Phase.DESCEND:
            if height_m < context.craft.standing_height_m + context.number("PLD_FAPPR_ALT"):
                self._phase = _Phase.LAND
                self._is_moving = target.speed_xy > _MOVES_M_S
                self._landing.start(position[0], position[1], self._yaw)
                self._landing.frame()
                return
            context.is_landing = True
            speed = context.number(context.ground.land_speed)
            context.setpoint.track_down((position[0], position[1]), target.vel_ned, speed, self._yaw)
        else:
            context.setpoint.track((position[0], position[1], self._approach_d), target.vel_ned, self._yaw)

    def _approach(self) -> None:
        context = self._context
        self._phase = _Phase.APPROACH
        self._approach_d = min(context.stop_point()[2], ground_d(context) - _LOWEST_M)
        self._yaw = context.state.yaw_rad

    def _search(self) -> None:
        """Holds at the height for searching."""
        context = self._context
        if self._searches > context.number("PLD_MAX_SRCH"):
            self._land("target lost")
            return
        self._searches += 1
        self._phase = _Phase.SEARCH
        self._until_us = context.state.time_us + int(context.number("PLD_SRCH_TOUT") * 1e6)
        north, east, down = context.stop_point()
        height_m, _ = context.height_above_ground()
        ground_d = context.state.estimate.pos_ned[2] + height_m
        context.fly_to((north, east, min(down, ground_d - context.number("PLD_SRCH_ALT"))), context.state.yaw_rad)
        context.announcer.statustext(Severity.INFO, "Precision landing: searching for the target")

    def _land(self, reason: str) -> None:
        context = self._context
        self._phase, self._is_moving = _Phase.LAND, False
        north, east, _ = context.stop_point()
        self._landing.start(north, east, nan)
        self._landing.frame()
        context.announcer.statustext(Severity.WARNING, f"Precision landing: {reason}, landing here")
