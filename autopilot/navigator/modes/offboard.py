"""Offboard: setpoints of an external client, passed on to the control part as they come."""

from math import nan

from autopilot.interface.client_requests import OffboardSetpoint
from autopilot.interface.mode_spec import FlightMode
from autopilot.interface.vehicle_state import ACCEPTED, Reply
from autopilot.navigator.context import NavContext
from autopilot.navigator.takeoff_intent import Ask, vertical_ask
from autopilot.ports import SETPOINT_TRAJECTORY

STREAM_PERIOD_US = 500_000  # setpoints must come faster than 2 Hz before the mode may be entered (PX4)


class Offboard(FlightMode):
    """Mode Offboard and the latest setpoint, which comes in whatever the mode."""

    __slots__ = ("_context", "_flown", "_received_us", "latest")

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self.latest: OffboardSetpoint | None = None
        self._received_us = 0
        self._flown: OffboardSetpoint | None = None

    def take(self, request: OffboardSetpoint) -> Reply:
        self.latest = request
        self._received_us = self._context.state.time_us
        return ACCEPTED

    def stream_age_us(self) -> int:
        """Time since the latest setpoint; very large without one."""
        return self._context.state.time_us - self._received_us if self.latest is not None else 1 << 62

    def needs_position(self) -> bool:
        return self.latest is None or self.latest.kind == SETPOINT_TRAJECTORY

    def refusal(self) -> str:
        is_stream = self.stream_age_us() <= STREAM_PERIOD_US
        return "" if is_stream else "needs setpoints faster than 2 Hz before the switch"

    def start(self) -> None:
        self._flown = None

    def frame(self) -> None:
        latest = self.latest
        if latest is None:
            return
        context = self._context
        if context.is_on_ground:
            ask = vertical_ask(latest, context.state.estimate, nan, context.craft.lift_thrust)
            context.wants_lift = ask is Ask.UP
            self._flown = None
        elif latest is not self._flown:
            self._flown = latest
            context.setpoint.follow(latest, context.cruise_speed)
