"""Brake: stops as fast as the limits allow and stays there."""

from autopilot.interface.mode_spec import FlightMode
from autopilot.navigator.context import NavContext


class Brake(FlightMode):
    """Mode Brake: at rest, whatever the sticks say."""

    __slots__ = ("_context",)

    def __init__(self, context: NavContext) -> None:
        self._context = context

    def frame(self) -> None:
        if not self._context.is_on_ground:
            self._context.setpoint.move((0.0, 0.0, 0.0), 0.0)
