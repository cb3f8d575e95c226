"""The sections of a plane's airframe file: wing, tail, one propeller in front or behind, three wheels or a belly."""

from math import sqrt
from typing import Annotated, Self

from pydantic import Field, model_validator

from common.airframe import SOURCED, Airframe, Fraction, NotNegative, Number, Positive, Section

Angle = Annotated[float, Field(gt=0.0, lt=1.2), SOURCED]


class Wing(Section):
    area_m2: Positive
    span_m: Positive
    chord_m: Positive
    inertia_xz_kg_m2: Number
    """Product of inertia: of x times z over the mass."""
    stall_angle_rad: Angle
    """Angle of attack about which the flow separates."""
    stall_sharpness: Positive
    """Of the blend there: Beard and McLain's M."""
    efficiency: Fraction
    """Oswald's, of the lift's drag."""


class Lift(Section):
    """Coefficients along the stream axes, and of pitch; surfaces deflected by a radian, trailing edge down."""

    c_l_0: Number
    c_l_alpha: Positive
    c_l_q: Number
    c_l_elevator: Number
    c_d_p: Positive
    """Parasitic drag."""
    c_d_elevator: NotNegative
    """Of the size of the deflection."""
    c_m_0: Number
    c_m_alpha: Number
    c_m_q: Number
    c_m_elevator: Number


class Side(Section):
    """Coefficients of side force, roll and yaw."""

    c_y_beta: Number
    c_y_p: Number
    c_y_r: Number
    c_y_aileron: Number
    c_y_rudder: Number
    c_roll_beta: Number
    c_roll_p: Number
    c_roll_r: Number
    c_roll_aileron: Number
    c_roll_rudder: Number
    c_yaw_beta: Number
    c_yaw_p: Number
    c_yaw_r: Number
    c_yaw_aileron: Number
    c_yaw_rudder: Number


class Surfaces(Section):
    """Ailerons, elevator and rudder: the same servos."""

    aileron_max_rad: Angle
    elevator_max_rad: Angle
    rudder_max_rad: Angle
    lag_s: Positive
    rate_rad_s: Positive


class Propeller(Section):
    """C_T = c_t_2 J² + c_t_1 J + c_t_0 of the advance ratio J, and C_Q alike; a brushless motor turns it."""

    diameter_m: Positive
    x_m: Number
    """Ahead of the centre of gravity."""
    c_t_2: Number
    c_t_1: Number
    c_t_0: Positive
    c_q_2: Annotated[float, Field(lt=0.0), SOURCED]
    c_q_1: Number
    c_q_0: Positive
    motor_constant_v_s: Positive
    """Voltage per speed [V s/rad], and torque per current [N m/A]."""
    motor_resistance_ohm: Positive
    idle_current_a: NotNegative
    lag_s: Positive
    """Of the speed behind the voltage."""

    @property
    def free_advance(self) -> float:
        """Advance ratio at which it turns without a torque: it windmills, the motor off."""
        root = sqrt(max(self.c_q_1**2 - 4.0 * self.c_q_2 * self.c_q_0, 0.0))
        return (-self.c_q_1 - root) / (2.0 * self.c_q_2)


class Gear(Section):
    """A wheel in front, which the rudder turns, and two behind with brakes."""

    nose_x_m: Positive
    """Ahead of the centre of gravity."""
    main_x_m: Positive
    """Behind it."""
    track_m: Positive
    height_m: Positive
    """Of the centre of gravity over the wheels' lowest points, without load."""
    steering_max_rad: Angle
    """Of the nose wheel at full rudder."""
    rolling_resistance: NotNegative
    """Force over load."""
    brake_friction: NotNegative
    """Force over load of the main wheels, brakes on."""
    side_friction: Positive
    """Force over load, at most, across a wheel."""


class Belly(Section):
    """What a plane without wheels stands and lands on: two points of its keel."""

    front_x_m: Positive
    """Ahead of the centre of gravity."""
    rear_x_m: Positive
    """Behind it."""
    depth_m: Positive
    """Of the keel below the centre of gravity."""


class Throw(Section):
    """How it is thrown out of the hand, or by a catapult: accelerated evenly along its nose and a little upwards."""

    speed_m_s: Positive
    """At which it leaves the hand."""
    elevation_rad: Annotated[float, Field(ge=0.0, lt=1.2), SOURCED]
    stroke_s: Positive
    """Time over which the hand accelerates it."""
    height_m: Positive
    """Of the hand over the ground."""

    @property
    def acceleration_m_s2(self) -> float:
        return self.speed_m_s / self.stroke_s


class Hull(Section):
    """What scrapes over the ground besides the wheels: wing tips, nose and tail."""

    tip_z_m: Number
    """Of the wing tips, frd."""
    nose_x_m: Positive
    tail_x_m: Positive
    """Behind the centre of gravity."""
    tail_z_m: Number
    radius_m: Positive
    """Sphere round the vehicle, for trunks, crowns and walls."""
    crash_speed_m_s: Positive
    """Speed normal to a surface above which the vehicle breaks."""


class PlaneAirframe(Airframe):
    """The airframe file of a plane."""

    wing: Wing
    lift: Lift
    side: Side
    surfaces: Surfaces
    propeller: Propeller
    gear: Gear | None = None
    belly: Belly | None = None
    """Of one without gear."""
    throw: Throw | None = None
    """None: it rolls on a runway."""
    hull: Hull
    jsbsim_aircraft: str = ""
    """The aircraft of JSBSim that this is, which `--engine jsbsim` moves; "": of none."""

    @property
    def aspect_ratio(self) -> float:
        return self.wing.span_m**2 / self.wing.area_m2

    @property
    def standing_height_m(self) -> float:
        """Of the centre of gravity over level ground, without load."""
        return self.gear.height_m if self.gear is not None else self.belly.depth_m if self.belly is not None else 0.0

    @model_validator(mode="after")
    def _stands_on_something(self) -> Self:
        if (self.gear is None) is (self.belly is None):
            raise ValueError("a plane has either a [gear] or a [belly]")
        if self.gear is None and self.throw is None:
            raise ValueError("a plane without [gear] needs a [throw]: it leaves no runway")
        return self

    @model_validator(mode="after")
    def _is_stable(self) -> Self:
        if self.lift.c_m_alpha >= 0.0:
            raise ValueError("lift.c_m_alpha must be below 0: the plane would turn away from the wind")
        if self.lift.c_m_elevator >= 0.0 or self.side.c_roll_aileron <= 0.0:
            raise ValueError("lift.c_m_elevator must be below 0 and side.c_roll_aileron above it")
        return self


AIRFRAME = PlaneAirframe
