"""The modes in which a pilot drives by sticks: Manual, Acro, Stabilized, Position, and ArduPilot's Simple.

In: `state.sticks`, each frame: the roll stick steers, the throttle stick drives, its middle stands (PX4's rovers). Out:
steering or a yaw rate, and a throttle or a speed. Nothing is remembered but the heading that is held.
"""

from math import atan2, copysign, hypot, nan, radians

from autopilot.inputs.sticks import without_centre
from autopilot.interface.mode_spec import FlightMode
from autopilot.interface.vehicle_state import Mode
from autopilot.navigator.context import NavContext

_STILL = 0.02  # of the throttle stick's way: the vehicle is not driven


class StickMode(FlightMode):
    """A mode that follows the sticks of this frame."""

    __slots__ = ("_context", "_held_yaw")

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._held_yaw = nan  # [rad]

    def start(self) -> None:
        self._held_yaw = nan

    def leave(self, following: Mode) -> None:  # noqa: ARG002
        self._held_yaw = nan

    @property
    def _steering(self) -> float:
        """-1..1 to the right."""
        return without_centre(self._context.state.sticks.roll, self._context.number("RO_YAW_STICK_DZ"))

    @property
    def _throttle(self) -> float:
        """-1..1, negative backwards."""
        return without_centre(self._context.state.sticks.throttle, self._context.number("MAN_DEADZONE"))

    def _yaw_rate(self, way: float) -> float:
        """[rad/s] By the stick, the way the steering wheel of a car that goes backwards turns it."""
        return copysign(radians(self._context.number("RO_YAW_RATE_LIM")) * self._steering, way * self._steering)

    def _held(self, way: float) -> float:
        """The heading [rad] held while the stick is in the middle and the vehicle drives; NaN: it is steered."""
        if self._steering or abs(way) < _STILL:
            self._held_yaw = nan
        elif self._held_yaw != self._held_yaw:
            self._held_yaw = self._context.state.yaw_rad
        return self._held_yaw


class Manual(StickMode):
    """Mode Manual: the sticks are steering and throttle."""

    __slots__ = ()

    def frame(self) -> None:
        sticks = self._context.state.sticks
        self._context.setpoint.drive(throttle=sticks.throttle, steering=sticks.roll)


class Acro(StickMode):
    """Mode Acro: a yaw rate by the stick, throttle as it is."""

    __slots__ = ()

    def frame(self) -> None:
        throttle = self._throttle
        self._context.setpoint.drive(throttle=throttle, yaw_rate=self._yaw_rate(throttle))


class Stabilized(StickMode):
    """Mode Stabilized: as Acro, and the heading is held while the stick is in the middle."""

    __slots__ = ()

    def frame(self) -> None:
        throttle = self._throttle
        yaw = self._held(throttle)
        if yaw == yaw:
            self._context.setpoint.drive(throttle=throttle, yaw=yaw)
        else:
            self._context.setpoint.drive(throttle=throttle, yaw_rate=self._yaw_rate(throttle))


class Position(StickMode):
    """Mode Position: speed and yaw rate by sticks; the heading is held while the stick is in the middle."""

    __slots__ = ()

    def frame(self) -> None:
        context = self._context
        speed = self._throttle * max(context.number("RO_SPEED_LIM"), 0.0)
        yaw = self._held(speed)
        if yaw == yaw:
            context.setpoint.drive(speed=speed, yaw=yaw)
        else:
            context.setpoint.drive(speed=speed, yaw_rate=self._yaw_rate(speed))


class Simple(StickMode):
    """Mode Simple: the sticks point where to drive, by the heading at which the mode was chosen, or by north."""

    __slots__ = ("_ahead",)

    def __init__(self, context: NavContext) -> None:
        super().__init__(context)
        self._ahead = 0.0  # [rad] of the throttle stick pushed forward

    def start(self) -> None:
        super().start()
        self._ahead = 0.0 if self._context.number("HG_RO_SIMPLE") else self._context.state.yaw_rad

    def frame(self) -> None:
        context = self._context
        forward, right = self._throttle, self._steering
        size = min(hypot(forward, right), 1.0)
        if size < _STILL:
            context.setpoint.drive(speed=0.0, yaw_rate=0.0)
        else:
            speed = size * max(context.number("RO_SPEED_LIM"), 0.0)
            context.setpoint.drive(speed=speed, yaw=self._ahead + atan2(right, forward))
