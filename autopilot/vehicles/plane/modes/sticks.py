"""The modes that a pilot flies by sticks: Manual, Stabilized, Acro, Altitude and Position, as PX4's planes have them.

In: `state.sticks`, each frame. On the ground the throttle stick decides: above its lowest quarter the plane rolls. Out:
surfaces, attitudes, rates, a bank and a climb rate, or a line over ground.
"""

from math import cos, nan, radians, sin

from autopilot.inputs.sticks import without_centre
from autopilot.interface.mode_spec import FlightMode
from autopilot.navigator.context import NavContext
from autopilot.navigator.setpoint import Quaternion, Vector

_ROLLS_FROM = 0.25  # of the throttle stick's way up; guess
_FAR_M = 10_000.0


class StickMode(FlightMode):
    """A mode that follows the sticks of this frame."""

    __slots__ = ("_context",)

    def __init__(self, context: NavContext) -> None:
        self._context = context

    def frame(self) -> None:
        context = self._context
        if context.is_on_ground:
            context.wants_lift = self._throttle > _ROLLS_FROM
        else:
            self.fly()

    def fly(self) -> None:
        """Renews the setpoint in the air."""

    @property
    def _throttle(self) -> float:
        """0..1."""
        return 0.5 * (self._context.state.sticks.throttle + 1.0)

    def _centred(self, stick: float) -> float:
        return without_centre(stick, self._context.number("MAN_DEADZONE"))

    def _attitude(self, pitch: float) -> Quaternion:
        """Bank by the roll stick, and a pitch [rad]; heading north."""
        roll = radians(self._context.number("FW_MAN_R_MAX")) * self._context.state.sticks.roll
        cr, sr, cp, sp = cos(0.5 * roll), sin(0.5 * roll), cos(0.5 * pitch), sin(0.5 * pitch)
        return (sr * cp, cr * sp, -sr * sp, cr * cp)

    def _airspeed(self) -> float:
        """[m/s] by the throttle stick: least, trim in the middle, most."""
        number, stick = self._context.number, self._centred(self._context.state.sticks.throttle)
        trim = number("FW_AIRSPD_TRIM")
        return trim + stick * (number("FW_AIRSPD_MAX") - trim if stick > 0.0 else trim - number("FW_AIRSPD_MIN"))

    def _climb(self) -> float:
        """[m/s] up by the pitch stick: pulled is up."""
        stick = -self._centred(self._context.state.sticks.pitch)
        return stick * self._context.number("FW_T_CLMB_R_SP" if stick > 0.0 else "FW_T_SINK_R_SP")


class Manual(StickMode):
    """Mode Manual: the sticks are surfaces and throttle."""

    __slots__ = ()

    def fly(self) -> None:
        sticks = self._context.state.sticks
        self._context.setpoint.move_surfaces(sticks.roll, -sticks.pitch, sticks.yaw, self._throttle)


class Acro(StickMode):
    """Mode Acro: body rates by sticks."""

    __slots__ = ()

    def fly(self) -> None:
        number, sticks = self._context.number, self._context.state.sticks
        rates = (
            radians(number("FW_ACRO_X_MAX")) * sticks.roll,
            -radians(number("FW_ACRO_Y_MAX")) * sticks.pitch,
            radians(number("FW_ACRO_Z_MAX")) * sticks.yaw,
        )
        self._context.setpoint.turn(rates, self._throttle)


class Stabilized(StickMode):
    """Mode Stabilized: bank and pitch by sticks, in the middle level flight; the throttle stick is the throttle."""

    __slots__ = ()

    def fly(self) -> None:
        number, sticks = self._context.number, self._context.state.sticks
        pitch = radians(number("FW_PSP_OFF") - number("FW_MAN_P_MAX") * sticks.pitch)
        yaw_rate = radians(number("FW_Y_RMAX")) * self._centred(sticks.yaw)
        self._context.setpoint.tilt(self._attitude(pitch), yaw_rate, self._throttle)


class Altitude(StickMode):
    """Mode Altitude: bank by the roll stick, climb by the pitch stick, airspeed by the throttle stick."""

    __slots__ = ()

    def fly(self) -> None:
        setpoint = self._context.setpoint
        setpoint.lean(self._attitude(0.0), -self._climb(), nan)
        setpoint.set_speeds(self._airspeed(), nan, nan)


class Position(Altitude):
    """Mode Position: as Altitude, and with the roll stick in the middle the course over ground is held on a line."""

    __slots__ = ("_end", "_start")

    def __init__(self, context: NavContext) -> None:
        super().__init__(context)
        self._start: Vector | None = None
        self._end: Vector = (0.0, 0.0, 0.0)

    def start(self) -> None:
        self._start = None

    def fly(self) -> None:
        context = self._context
        if self._centred(context.state.sticks.roll):
            self._start = None
            super().fly()
            return
        if self._start is None and abs(context.state.roll_rad) > radians(5.0):  # PX4: the course once it flies level
            super().fly()
            return
        if self._start is None:
            self._take_course()
        self._glide()

    def _take_course(self) -> None:
        (north, east, _), (vel_n, vel_e, _) = self._context.state.estimate.pos_ned, self._context.state.estimate.vel_ned
        speed = max((vel_n**2 + vel_e**2) ** 0.5, 1.0)
        self._start = (north, east, nan)
        self._end = (north + _FAR_M * vel_n / speed, east + _FAR_M * vel_e / speed, nan)

    def _glide(self) -> None:
        if self._start is not None:
            self._context.setpoint.glide(
                self._end, self._start, -self._climb(), airspeed=self._airspeed(), throttle=nan
            )
