"""The sections of a multirotor's airframe file."""

from math import sqrt
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from common.airframe import SOURCED, Airframe, Fraction, NotNegative, Number, Positive, Section
from common.geodesy import GRAVITY_M_S2

Spin = Annotated[Literal[-1, 1], SOURCED]


class Rotor(Section):
    x_m: Number
    """Position of the hub in frd, from the centre of gravity."""
    y_m: Number
    z_m: Number
    spin: Spin
    """+1 turns counter-clockwise seen from above, -1 clockwise.

    The reaction torque on the body is spin * torque about +z (frd down).
    """


class RotorModel(Section):
    radius_m: Positive
    thrust_n_s2: Positive
    """Static thrust per squared speed: T = thrust_n_s2 * omega² at sea-level density."""
    torque_n_m_s2: Positive
    """Aerodynamic torque per squared speed."""
    max_speed_rad_s: Positive
    """Speed at full command and full battery."""
    idle_command: Fraction
    """Command [0..1] at which an armed motor idles."""
    command_curve: Fraction
    """a in omega / omega_max = a * u + (1 - a) * sqrt(u): 1 is a speed-linear ESC, 0 a thrust-linear one."""
    spin_up_time_s: Positive
    """First-order lag of rising speed."""
    spin_down_time_s: Positive
    inertia_kg_m2: Positive
    """Rotor and bell, about the spin axis."""
    drag_n_s2_m: NotNegative
    """In-plane rotor drag per rotor: force = -drag_n_s2_m * omega * v_in_plane."""
    inflow_n_s2_m: NotNegative
    """Thrust lost per rotor to axial inflow: inflow_n_s2_m * omega * (speed of the hub through the air, up)."""


class Contact(Section):
    leg_x_m: Positive
    """Feet at (±leg_x, ±leg_y, leg_z) in frd."""
    leg_y_m: Positive
    leg_z_m: Positive
    hull_radius_m: Positive
    """Sphere round the whole vehicle, for trunks, crowns and walls; the ground is met by feet and rotor tips."""
    crash_speed_m_s: Positive
    """Speed normal to the surface above which the vehicle breaks."""


class MultirotorAirframe(Airframe):
    """The airframe file of a multirotor."""

    rotor_model: RotorModel
    rotors: Annotated[list[Rotor], Field(min_length=3, max_length=8)]
    contact: Contact

    @model_validator(mode="after")
    def _lifts_itself(self) -> Self:
        rotor = self.rotor_model
        thrust_n = len(self.rotors) * rotor.thrust_n_s2 * rotor.max_speed_rad_s**2
        weight_n = self.body.mass_kg * GRAVITY_M_S2
        if thrust_n <= weight_n:
            raise ValueError(f"the rotors lift {thrust_n:.3g} N at most, the vehicle weighs {weight_n:.3g} N")
        return self


AIRFRAME = MultirotorAirframe


def speed_at(command: float, curve: float) -> float:
    """Rotor speed over the greatest [0..1] at a motor command [0..1]."""
    return curve * command + (1.0 - curve) * sqrt(command)


def command_at(speed: float, curve: float) -> float:
    """Motor command [0..1] for a rotor speed over the greatest [0..1]: the inverse of `speed_at`."""
    straight = 1.0 - curve
    return (2.0 * speed / (straight + sqrt(straight * straight + 4.0 * curve * speed))) ** 2 if speed else 0.0
