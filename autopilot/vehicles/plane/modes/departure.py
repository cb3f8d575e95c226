"""Take-off from a runway or out of the hand, then a climb straight on.

PX4's runway take-off (RWTO_*): along the heading that it stands at, until the airspeed carries it. With launch
detection (FW_LAUN_*): the motor stands until the plane feels that it was thrown, and FW_LAUN_MOT_DEL longer. The first
metres of the climb are flown with the wings nearly level: the line leads on.
"""

from enum import IntEnum
from math import cos, inf, isfinite, nan, radians, sin

from autopilot.interface.client_requests import TakeOff
from autopilot.interface.mode_spec import FlightMode
from autopilot.interface.vehicle_state import ACCEPTED, Reply, Verdict
from autopilot.navigator.context import NavContext
from autopilot.navigator.modes.takeoff import takeoff_refusal
from autopilot.navigator.setpoint import Vector
from autopilot.ports import AIRSPEED_VALID
from autopilot.vehicles.plane.modes.launch import LaunchDetector

_FAR_M = 10_000.0  # of the line along the runway
_REACHED_M = 2.0  # below the height asked for, at which a take-off ends; guess


class _Phase(IntEnum):
    STAND = 0
    RUN = 1
    THROWN = 2  # the motor is yet to start
    CLIMB = 3


def airspeed_of(context: NavContext) -> float:
    """[m/s] measured; without a tube the speed over ground."""
    estimate = context.state.estimate
    if estimate.flags & AIRSPEED_VALID:
        return float(estimate.airspeed)
    north, east, _ = estimate.vel_ned
    return float((north * north + east * east) ** 0.5)


class Departure:
    """One take-off; in the air it is a climb straight on."""

    __slots__ = ("_context", "_far", "_launch", "_phase", "_run_us", "_start", "_target_d", "_yaw")

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._launch = LaunchDetector(context)
        self._phase = _Phase.STAND
        self._target_d = 0.0  # [m]
        self._yaw = 0.0  # [rad]
        self._run_us = 0
        self._start: Vector = (0.0, 0.0, 0.0)
        self._far: Vector = (0.0, 0.0, 0.0)

    def start(self, target_d: float) -> None:
        """Prepares a take-off to the down coordinate `target_d` [m]."""
        self._target_d = target_d
        self._phase = _Phase.STAND
        self._launch.start()

    def frame(self) -> bool:
        """Flies on; true once the height is reached."""
        context = self._context
        state = context.state
        if context.is_on_ground:
            if self._phase is not _Phase.STAND:  # back on the ground: another throw, another run
                self._phase = _Phase.STAND
                self._launch.start()
            context.wants_lift = not self._launch.is_used or self._launch.frame()
            state.awaits_launch = not context.wants_lift
            return False
        if self._phase is _Phase.STAND:
            self._begin()
        if (self._phase is _Phase.RUN and not self._runs_fast()) or (
            self._phase is _Phase.THROWN and not self._starts_motor()
        ):
            return False
        if self._phase is not _Phase.CLIMB:
            self._phase = _Phase.CLIMB
            self._climb()
        return bool(state.estimate.pos_ned[2] < self._target_d + _REACHED_M)

    def _runs_fast(self) -> bool:
        """Rolls on; whether the airspeed carries it."""
        context = self._context
        ramp = (context.state.time_us - self._run_us) * 1e-6 / context.number("RWTO_RAMP_TIME")
        context.setpoint.drive(throttle=min(ramp, 1.0) * context.number("RWTO_MAX_THR"), yaw=self._yaw)
        return airspeed_of(context) >= self._rotation_m_s()

    def _starts_motor(self) -> bool:
        """Flies on level, nose up; whether the motor may start by now."""
        context = self._context
        if context.state.time_us - self._run_us >= 1e6 * context.number("FW_LAUN_MOT_DEL"):
            return True
        half = 0.5 * radians(context.number("FW_TKO_PITCH_MIN"))
        context.setpoint.tilt((0.0, sin(half), 0.0, cos(half)), 0.0, 0.0)
        return False

    def _begin(self) -> None:
        state = self._context.state
        north, east, down = state.estimate.pos_ned
        is_low = state.stand_ned is None or down > state.stand_ned[2] - 1.0
        if self._launch.is_thrown:
            self._phase = _Phase.THROWN
        else:
            self._phase = _Phase.RUN if is_low else _Phase.CLIMB
        self._yaw, self._run_us = state.yaw_rad, state.time_us
        self._start = (north, east, nan)
        self._far = (north + _FAR_M * cos(self._yaw), east + _FAR_M * sin(self._yaw), nan)
        if self._phase is _Phase.CLIMB:
            self._climb()

    def _climb(self) -> None:
        """As steeply as it can, as PX4's; straight on."""
        most = self._context.number("FW_T_CLMB_MAX")
        self._context.setpoint.glide(self._far, self._start, -most, airspeed=nan, throttle=nan)

    def _rotation_m_s(self) -> float:
        asked = self._context.number("RWTO_ROT_AIRSPD")
        return asked if asked > 0.0 else self._context.number("FW_AIRSPD_MIN")


class PlaneTakeoff(FlightMode):
    """Mode Takeoff: a take-off to MIS_TAKEOFF_ALT or what was asked for, then Hold."""

    __slots__ = ("_alt_amsl_m", "_context", "_departure")

    finishes_takeoff = is_below_floor = True

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._departure = Departure(context)
        self._alt_amsl_m = nan

    def take(self, request: TakeOff) -> Reply:
        """Sets the height of the next take-off; NaN: MIS_TAKEOFF_ALT above home."""
        refusal = takeoff_refusal(self._context, request.alt_amsl_m)
        if refusal:
            return Reply(Verdict.DENIED, refusal)
        self._alt_amsl_m = request.alt_amsl_m
        return ACCEPTED

    def forget(self) -> None:
        self._alt_amsl_m = nan

    def may_go(self, *, is_taking_off: bool) -> bool:  # noqa: ARG002
        return self._context.state.is_armed

    def start(self) -> None:
        context = self._context
        base_m = (context.state.home or context.state.position).alt_m
        lowest_m = base_m + context.number("MIS_TAKEOFF_ALT")
        asked_m = self._alt_amsl_m if isfinite(self._alt_amsl_m) else -inf
        self._departure.start(context.down_of(max(asked_m, lowest_m)))

    def frame(self) -> None:
        if self._departure.frame():
            context = self._context
            context.hold_next(context.state.estimate.pos_ned, context.state.yaw_rad)
