"""The modes a pilot flies by sticks: Stabilized (and Manual), Acro, Altitude, Position.

In: `state.sticks`, each frame. Out: attitude and thrust, body rates and thrust, attitude and climb rate, or velocity.
On the ground the throttle decides when to leave it; ground contact ends a descent as in every other mode.
"""

from math import cos, hypot, radians, sin, sqrt

from autopilot.inputs.sticks import curved, without_centre
from autopilot.interface.mode_spec import FlightMode
from autopilot.navigator.context import NavContext
from autopilot.navigator.modes.land import slowed_near_ground
from autopilot.navigator.setpoint import Quaternion
from autopilot.navigator.takeoff_intent import LIFT_FRACTION

_TAKEOFF_THROTTLE = 0.3  # of the way from the middle to the top, from which a vehicle on the ground takes off (PX4)
_VOLTAGE_FRACTION_MIN = 0.6  # as the control part
_VOLTAGE_TIME_S = 1.0  # guess
_LEVEL: Quaternion = (0.0, 0.0, 0.0, 1.0)


class Throttle:
    """The throttle stick as thrust.

    Its middle carries the vehicle whatever charge the battery has left (PX4: MPC_USE_HTE): a thrust setpoint is a share
    of what the motors can do at the present voltage.
    """

    __slots__ = ("_context", "_time_us", "_voltage_fraction")

    def __init__(self, context: NavContext) -> None:
        self._context = context
        self._voltage_fraction = 1.0  # of a full battery
        self._time_us = 0

    def thrust(self, least: float) -> float:
        """Thrust [0..1] from `least` at throttle down to MPC_THR_MAX."""
        context = self._context
        throttle = context.state.sticks.throttle
        most = context.number("MPC_THR_MAX")
        if context.number("MPC_THR_CURVE"):
            return least + 0.5 * (throttle + 1.0) * (most - least)
        hover = min(context.number("MPC_THR_HOVER") / self._fraction() ** 2, most)
        return hover + throttle * (most - hover if throttle > 0.0 else hover - least)

    def _fraction(self) -> float:
        """Voltage over that of the full battery, low-passed: the load's own ups and downs do not count."""
        context = self._context
        now_us, voltage_v = context.state.time_us, context.state.samples.battery.voltage_v
        full_v = context.number("BAT1_N_CELLS") * context.number("BAT1_V_CHARGED")
        if voltage_v > 0.0 and full_v > 0.0:
            measured = min(max(voltage_v / full_v, _VOLTAGE_FRACTION_MIN), 1.0)
            dt_s = (now_us - self._time_us) * 1e-6  # long since it was last flown: begins anew
            self._voltage_fraction += (measured - self._voltage_fraction) * min(dt_s / _VOLTAGE_TIME_S, 1.0)
        self._time_us = now_us
        return self._voltage_fraction


class StickMode(FlightMode):
    """A mode that follows the sticks of this frame and remembers nothing between frames."""

    __slots__ = ("_context",)

    def __init__(self, context: NavContext) -> None:
        self._context = context


class ThrustMode(StickMode):
    """A stick mode whose throttle stick is the thrust."""

    __slots__ = ("_throttle",)

    def __init__(self, context: NavContext) -> None:
        super().__init__(context)
        self._throttle = Throttle(context)


class Stabilized(ThrustMode):
    """Modes Stabilized and Manual: roll, pitch and yaw rate by sticks, the throttle stick is the thrust."""

    __slots__ = ()

    def frame(self) -> None:
        context = self._context
        thrust = self._throttle.thrust(context.number("MPC_MANTHR_MIN"))
        if context.is_on_ground:
            context.wants_lift = thrust > LIFT_FRACTION * context.craft.lift_thrust
        else:
            context.setpoint.tilt(lean_of(context), yaw_rate_of(context), thrust)


class Acro(ThrustMode):
    """Mode Acro: body rates by sticks, the throttle stick is the thrust."""

    __slots__ = ()

    def frame(self) -> None:
        context = self._context
        thrust = self._throttle.thrust(0.0)
        if context.is_on_ground:
            context.wants_lift = thrust > LIFT_FRACTION * context.craft.lift_thrust
            return
        sticks, number = context.state.sticks, context.number
        expo, super_expo = number("MC_ACRO_EXPO"), number("MC_ACRO_SUPEXPO")
        roll = curved(sticks.roll, expo, super_expo)
        pitch = curved(sticks.pitch, expo, super_expo)
        yaw = curved(sticks.yaw, number("MC_ACRO_EXPO_Y"), number("MC_ACRO_SUPEXPOY"))
        omega_frd = (
            radians(number("MC_ACRO_R_MAX")) * roll,
            -radians(number("MC_ACRO_P_MAX")) * pitch,
            radians(number("MC_ACRO_Y_MAX")) * yaw,
        )
        context.setpoint.turn(omega_frd, thrust)


class Altitude(StickMode):
    """Mode Altitude: roll, pitch and yaw rate by sticks, the throttle stick is the climb rate. Needs no position."""

    __slots__ = ()

    def frame(self) -> None:
        context = self._context
        if context.is_on_ground:
            context.wants_lift = context.state.sticks.throttle > _TAKEOFF_THROTTLE
        else:
            context.setpoint.lean(lean_of(context), speed_down_of(context), yaw_rate_of(context))


class Position(StickMode):
    """Mode Position: velocity by sticks, forward where the nose points; sticks in the middle hold the position."""

    __slots__ = ()

    def frame(self) -> None:
        context = self._context
        if context.is_on_ground:
            context.wants_lift = context.state.sticks.throttle > _TAKEOFF_THROTTLE
            return
        north, east = velocity_of(context)
        obstacles = context.state.obstacles
        if obstacles is not None and obstacles.is_limiting:
            north, east = obstacles.limited(north, east, context.state.time_us)
        context.setpoint.move((north, east, speed_down_of(context)), yaw_rate_of(context))


def lean_of(context: NavContext) -> Quaternion:
    """Roll and pitch as one rotation about a level axis, up to MPC_MAN_TILT_MAX in every direction."""
    sticks = context.state.sticks
    length = hypot(sticks.roll, sticks.pitch)
    if length == 0.0:
        return _LEVEL
    half = 0.5 * radians(context.number("MPC_MAN_TILT_MAX")) * min(length, 1.0)
    fraction = sin(half) / length
    return (sticks.roll * fraction, -sticks.pitch * fraction, 0.0, cos(half))


def yaw_rate_of(context: NavContext) -> float:
    """[rad/s] Clockwise."""
    number = context.number
    stick = curved(without_centre(context.state.sticks.yaw, number("MAN_DEADZONE")), number("MPC_YAW_EXPO"))
    return radians(number("MPC_MAN_Y_MAX")) * stick


def speed_down_of(context: NavContext) -> float:
    """[m/s] By the throttle stick; slower near the ground, and 0 in the middle, where the height is held."""
    number = context.number
    stick = curved(without_centre(context.state.sticks.throttle, number("MAN_DEADZONE")), number("MPC_Z_MAN_EXPO"))
    if stick >= 0.0:
        return -number("MPC_Z_VEL_MAX_UP") * stick
    return min(-number("MPC_Z_VEL_MAX_DN") * stick, slowed_near_ground(context, number("MPC_Z_VEL_MAX_DN")))


def velocity_of(context: NavContext) -> tuple[float, float]:
    """[m/s] North and east."""
    sticks, number = context.state.sticks, context.number
    dead, expo = number("MAN_DEADZONE"), number("MPC_XY_MAN_EXPO")
    forward = curved(without_centre(sticks.pitch, dead), expo)
    right = curved(without_centre(sticks.roll, dead), expo)
    if forward == 0.0 and right == 0.0:
        return 0.0, 0.0
    ahead = number("MPC_VEL_MANUAL")
    back, aside = number("MPC_VEL_MAN_BACK"), number("MPC_VEL_MAN_SIDE")
    length = max(sqrt(forward * forward + right * right), 1.0)
    forward *= (back if forward < 0.0 <= back else ahead) / length
    right *= (aside if aside >= 0.0 else ahead) / length
    yaw = context.state.actuators.traj_yaw  # of the setpoint: the estimate's noise would wag the velocity
    return cos(yaw) * forward - sin(yaw) * right, sin(yaw) * forward + cos(yaw) * right
