"""Heading on the way: towards the next position, home or away from it, at a region of interest, or as turned to.

In: what mission items, clients and the yaw mode ask for. Out: the yaw of the setpoint, after the mode has written it.
Whatever has to do with the payload's own aim is not here.
"""

from enum import IntEnum
from math import atan2, hypot, isfinite, nan, pi, radians
from typing import Protocol

from autopilot.interface.mode_spec import FlightMode
from autopilot.interface.vehicle_state import ACCEPTED, Mode, Reply, VehicleState, Verdict
from autopilot.navigator.setpoint import SetpointPort, Vector
from autopilot.ports import SETPOINT_TRAJECTORY
from autopilot.vehicles.vehicle_class import Craft
from common.attitude import wrapped
from common.kernels import FRAME_US

_FRAME_S = FRAME_US * 1e-6
_NEAR_M = 1.0  # nearer than this a direction means nothing; guess
_STEP_RAD = 0.005  # changes smaller than this are not worth a new setpoint
_TURNED_RAD = radians(2.0)  # as ArduPilot judges CONDITION_YAW


class YawMode(IntEnum):
    """Where the nose points on mission legs: the class's `yaw_mode_param`, numbered as PX4's copters do."""

    TOWARDS_WAYPOINT = 0
    TOWARDS_HOME = 1
    AWAY_FROM_HOME = 2
    ALONG_TRAJECTORY = 3


class FlownLeg(Protocol):
    """What the heading depends on (autopilot.navigator.context)."""

    flown: FlightMode
    state: VehicleState
    setpoint: SetpointPort
    is_landing: bool
    leg_yaw: float  # [rad] of the mission leg being flown
    yaw_mode: int  # YawMode

    @property
    def craft(self) -> Craft: ...

    def number(self, name: str) -> float:
        """The value of a parameter in its own unit."""
        ...


class Heading:
    """The heading of one vehicle, beyond what the mode itself asks for."""

    __slots__ = ("_context", "_direction", "_offset", "_rate", "_roi", "_turn", "_turned", "is_active", "is_item_yaw")

    def __init__(self, context: FlownLeg) -> None:
        self._context = context
        self._roi: Vector | None = None
        self._offset = 0.0  # [rad] added to the heading of the mode
        self._turn = nan  # [rad] goal; NaN: not turned
        self._turned = 0.0  # [rad] where the turn has come to
        self._rate = 0.0  # [rad/s]
        self._direction = 0  # 1 clockwise, -1 counter-clockwise, 0 the short way
        self.is_active = False  # something is asked for
        self.is_item_yaw = False  # the mission item names its own heading

    # ---- what is asked for ----

    def look_at(self, pos_ned: Vector) -> None:
        """From now on towards a position [m], whatever the way."""
        self._roi = pos_ned
        self._offset = 0.0
        self.is_active = True

    def look_ahead(self, offset_rad: float = 0.0) -> None:
        """From now on as the mode has it, on mission legs turned by an offset [rad]."""
        self._roi = None
        self._offset = offset_rad
        self._note()
        context = self._context
        if context.state.mode is Mode.MISSION and isfinite(context.leg_yaw):
            context.setpoint.set_yaw(context.leg_yaw)

    def turn(self, angle_deg: float, rate_deg_s: float, direction: float, *, is_relative: bool) -> Reply:
        """Turns to a heading, or by an angle, and keeps it until the next leg, place or mode.

        Args:
            angle_deg: heading, or angle to turn by.
            rate_deg_s: how fast; 0 or NaN: the class's `limits.yaw_rate`.
            direction: 1 clockwise, -1 counter-clockwise, 0 or NaN the short way (relative: clockwise).
            is_relative: whether it is an angle to turn by.
        """
        if not abs(angle_deg) <= 360.0:
            return Reply(Verdict.DENIED, f"heading {angle_deg:.0f} deg is out of range")
        if rate_deg_s < 0.0:
            return Reply(Verdict.DENIED, "a yaw rate cannot be negative")
        context = self._context
        here = context.state.yaw_rad
        way = 0 if not isfinite(direction) else int(direction)
        if is_relative:
            way = way or 1
            goal = here + way * radians(angle_deg)
        else:
            goal = radians(angle_deg)
        fastest = context.number(context.craft.limits.yaw_rate)
        self._turn = wrapped(goal)
        self._turned = here
        self._rate = radians(min(rate_deg_s, fastest) if rate_deg_s > 0.0 else fastest)
        self._direction = way
        self.is_active = True
        return ACCEPTED

    def end_turn(self) -> None:
        """The turn belonged to what was flown before."""
        if isfinite(self._turn):
            self._turn = nan
            self._note()

    def reset(self) -> None:
        """Forgets everything: the flight is over."""
        self._roi = None
        self._offset = 0.0
        self._turn = nan
        self.is_active = self.is_item_yaw = False

    def _note(self) -> None:
        self.is_active = self._roi is not None or self._offset != 0.0 or isfinite(self._turn)

    @property
    def is_turning(self) -> bool:
        """Whether the vehicle is still on its way to the heading it was turned to."""
        return isfinite(self._turn) and abs(wrapped(self._turn - self._context.state.yaw_rad)) > _TURNED_RAD

    # ---- flying ----

    def frame(self) -> None:
        """Puts the heading into the setpoint that the mode has written."""
        context = self._context
        setpoint = context.setpoint
        if setpoint.kind != SETPOINT_TRAJECTORY or context.is_landing or not context.flown.takes_heading:
            return
        yaw = self._wanted()
        if isfinite(yaw) and not abs(wrapped(yaw - setpoint.yaw)) < _STEP_RAD:
            setpoint.set_yaw(yaw)

    def _wanted(self) -> float:
        """The heading [rad]; NaN: as the mode has it."""
        context = self._context
        if isfinite(self._turn):
            return self._step()
        roi = self._roi
        if roi is not None:
            return self._towards(roi)
        state = context.state
        if state.mode is Mode.MISSION and not self.is_item_yaw:
            mode = context.yaw_mode
            if mode == YawMode.TOWARDS_HOME:
                return self._towards(state.home_ned)
            if mode == YawMode.AWAY_FROM_HOME:
                return wrapped(self._towards(state.home_ned) + pi)
            if self._offset:
                return wrapped(context.leg_yaw + self._offset)
        return nan

    def _towards(self, position: Vector) -> float:
        here = self._context.state.estimate.pos_ned
        north, east = position[0] - here[0], position[1] - here[1]
        return atan2(east, north) if hypot(north, east) > _NEAR_M else nan

    def _step(self) -> float:
        """The turn carried on by one frame."""
        left = wrapped(self._turn - self._turned)
        if self._direction > 0 and left < -_STEP_RAD:
            left += 2.0 * pi
        elif self._direction < 0 and left > _STEP_RAD:
            left -= 2.0 * pi
        step = self._rate * _FRAME_S
        if abs(left) <= step:
            self._turned = self._turn
            self._direction = 0
        else:
            self._turned = wrapped(self._turned + (step if left > 0.0 else -step))
        return self._turned
