"""Take-off: a vertical climb over the position where it began."""

from math import isfinite, nan

from autopilot.interface.client_requests import TakeOff
from autopilot.interface.mode_spec import FlightMode
from autopilot.interface.vehicle_state import ACCEPTED, Reply, Severity, Verdict
from autopilot.navigator.context import NavContext
from autopilot.navigator.setpoint import Vector

REACHED_M = 0.3  # height error at which a climb ends; half of what PX4's tests allow
_SETTLED_M_S = 0.5
_SAFE_M = 5.0  # height over where it stood from which a vehicle may lean as it likes; guess


class Climb:
    """A vertical climb to a height; from the ground it first waits for the commander's release."""

    __slots__ = ("_context", "_is_climbing", "_target_d", "_yaw", "target_ned", "yaw")

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._is_climbing = False
        self._target_d = 0.0
        self._yaw = nan
        self.target_ned: Vector = (0.0, 0.0, 0.0)
        self.yaw = 0.0  # [rad] flown

    def start(self, target_d: float, yaw: float) -> None:
        """Prepares a climb to the down coordinate `target_d` [m]; NaN yaw keeps the heading."""
        self._target_d = target_d
        self._yaw = yaw
        self._is_climbing = False

    def resume(self) -> None:
        """Goes on with the climb after another mode has flown."""
        if self._is_climbing:
            self._fly()

    def frame(self) -> bool:
        """Climbs; true once the height is reached. A vehicle above it stays where it is."""
        context = self._context
        if context.is_on_ground:
            context.wants_lift = True
            return False
        if not self._is_climbing:
            self._is_climbing = True
            north, east, down = context.stop_point()
            self.target_ned = (north, east, min(self._target_d, down))
            self.yaw = self._yaw if isfinite(self._yaw) else context.state.yaw_rad
            self._fly()
            return False
        estimate = context.state.estimate
        is_near: bool = abs(estimate.pos_ned[2] - self.target_ned[2]) < REACHED_M
        return is_near and abs(estimate.vel_ned[2]) < _SETTLED_M_S

    def _fly(self) -> None:
        context = self._context
        context.setpoint.fly_to(self.target_ned, self.yaw, climb_speed=context.number(context.ground.takeoff_speed))


def is_high(context: NavContext) -> bool:
    """Whether a vehicle that takes off is high enough to go elsewhere; below that it would skid over the ground."""
    stand_ned = context.state.stand_ned or context.state.home_ned
    height_m: float = stand_ned[2] - context.state.estimate.pos_ned[2]
    return height_m >= _SAFE_M


def takeoff_refusal(context: NavContext, alt_amsl_m: float) -> str:
    """Why the fence lets no take-off end at an altitude here; empty if it does."""
    if not isfinite(alt_amsl_m):
        return ""
    north, east, _ = context.state.estimate.pos_ned
    refusal = context.fence_refusal((north, east, context.down_of(alt_amsl_m)))
    return f"takeoff would end {refusal}" if refusal else ""


class Takeoff(FlightMode):
    """Mode Takeoff: climbs, then holds."""

    __slots__ = ("_alt_amsl_m", "_context", "_yaw", "climb")

    finishes_takeoff = is_below_floor = takes_heading = True

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self.climb = Climb(context)  # goes on if a client sends the vehicle elsewhere while it is low
        self._alt_amsl_m = nan
        self._yaw = nan

    def take(self, request: TakeOff) -> Reply:
        """Sets the target for the next take-off; NaN: MIS_TAKEOFF_ALT above home."""
        refusal = takeoff_refusal(self._context, request.alt_amsl_m)
        if refusal:
            return Reply(Verdict.DENIED, refusal)
        if request.alt_amsl_m > self._base_alt_m() + 10_000.0:
            return Reply(Verdict.DENIED, f"altitude {request.alt_amsl_m:.0f} m is out of range")
        self._alt_amsl_m = request.alt_amsl_m
        self._yaw = request.yaw_rad
        self._target_alt_m(is_reported=True)
        return ACCEPTED

    def forget(self) -> None:
        self._alt_amsl_m = self._yaw = nan

    def start(self) -> None:
        context = self._context
        self.climb.start(context.down_of(self._target_alt_m(is_reported=False)), self._yaw)

    def frame(self) -> None:
        if self.climb.frame():
            self._context.hold_next(self.climb.target_ned, self.climb.yaw)

    def _base_alt_m(self) -> float:
        state = self._context.state
        return (state.home or state.position).alt_m

    def _target_alt_m(self, *, is_reported: bool) -> float:
        """The altitude to climb to: never less than MIS_TAKEOFF_ALT above home."""
        lowest = self._base_alt_m() + self._context.number("MIS_TAKEOFF_ALT")
        if not isfinite(self._alt_amsl_m):
            return lowest
        if self._alt_amsl_m < lowest - 0.05 and is_reported:
            height = self._context.number("MIS_TAKEOFF_ALT")
            self._context.announcer.statustext(Severity.INFO, f"Takeoff altitude raised to {height:.1f} m above home")
        return max(self._alt_amsl_m, lowest)
