"""Termination: the motors stand still, and nothing brings them back before the vehicle lies on the ground."""

from autopilot.interface.mode_spec import FlightMode
from autopilot.navigator.context import NavContext


class Termination(FlightMode):
    """Mode Termination."""

    __slots__ = ("_context",)

    def __init__(self, context: NavContext) -> None:
        self._context = context

    def start(self) -> None:
        self._context.setpoint.idle()

    def frame(self) -> None:
        self._context.setpoint.idle()
