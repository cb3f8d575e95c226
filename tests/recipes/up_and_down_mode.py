"""A mode added by CONTRIBUTING.md's recipe: the class that flies it, and its row."""

from autopilot.interface.mode_spec import DialectMode, FlightMode, ModeSpec, Px4Main, further_mode, px4_mode
from autopilot.navigator.context import NavContext
from autopilot.navigator.mode_parts import of_context
from autopilot.navigator.setpoint import Vector

SPAN_M = 3.0
NEAR_M = 0.3


class UpAndDown(FlightMode):
    """Goes up by three metres and down again, over the place where it began."""

    __slots__ = ("_context", "_is_up", "_low")

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._low: Vector = (0.0, 0.0, 0.0)  # [m]
        self._is_up = False

    def start(self) -> None:
        self._low = self._context.stop_point()
        self._is_up = False

    def frame(self) -> None:
        context = self._context
        north, east, down = self._low
        goal = (north, east, down if self._is_up else down - SPAN_M)
        context.fly_to(goal, context.state.yaw_rad)
        if abs(context.state.estimate.pos_ned[2] - goal[2]) < NEAR_M:
            self._is_up = not self._is_up


UP_AND_DOWN = ModeSpec(
    mode=further_mode(100, "UP_AND_DOWN"),
    build=of_context(UpAndDown),
    needs_position=True,
    px4=px4_mode(Px4Main.AUTO, 11, "Up and Down"),
    ardupilot=DialectMode(100, "Up and Down"),
    nav_state=23,
    shell_name="ext1",
)
