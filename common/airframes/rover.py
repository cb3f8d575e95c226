"""The sections of a rover's airframe file: a vehicle on four wheels, steered by its front wheels or by its sides."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from common.airframe import SOURCED, Airframe, Fraction, NotNegative, Number, Positive, Section

Layout = Annotated[Literal["ackermann", "skid"], SOURCED]
Driven = Annotated[Literal["rear", "all"], SOURCED]


class Wheels(Section):
    front_x_m: Positive
    """Front axle ahead of the centre of gravity."""
    rear_x_m: Positive
    """Rear axle behind it."""
    track_m: Positive
    """Between the middles of the left and the right treads."""
    radius_m: Positive
    hub_z_m: Number
    """Hubs below the centre of gravity where no load is on the springs."""
    inertia_kg_m2: Positive
    """Of each wheel about its axle, with its share of the motor."""
    spring_n_m: Positive
    """Of each wheel: suspension and tyre."""
    damper_n_s_m: Positive
    rolling_resistance: NotNegative
    """Force over load."""


class Tyres(Section):
    friction: Positive
    """Greatest force over load."""
    sliding_friction: Positive
    """Force over load of a tyre that slides."""
    peak_slip: Annotated[float, Field(gt=0.0, lt=1.0), SOURCED]
    """At which the force is greatest: sliding speed over rolling speed, along the wheel and across it."""
    relaxation_m: Positive
    """Way on which the force builds up."""


class Steering(Section):
    layout: Layout
    """`ackermann`: the front wheels turn; `skid`: the sides turn at different speeds."""
    max_angle_rad: Annotated[float, Field(ge=0.0, lt=1.2), SOURCED]
    """Of a wheel in the middle between the front wheels; 0 for skid steer."""
    rate_rad_s: Positive
    """Greatest rate of the servo."""
    lag_s: Positive
    """Of the servo below that rate."""


class Drive(Section):
    driven: Driven
    """`rear`: one motor and a differential; `all`: a motor for each wheel."""
    max_speed_m_s: Positive
    """Of the treads at full command, without load and with a full battery."""
    stall_force_n: Positive
    """Of all treads together at full command and standstill, if nothing limited the current."""
    max_force_n: Positive
    """Where the speed controller limits the current, driving and braking."""
    lag_s: Positive
    """Of the force behind the command."""


class Brake(Section):
    max_force_n: Positive
    """Of all treads together, by friction."""
    front_fraction: Fraction
    """Of it that the front wheels have."""


class Hull(Section):
    front_m: Positive
    """Of the box round the vehicle, its wheels included, ahead of the centre of gravity."""
    rear_m: Positive
    half_width_m: Positive
    top_m: Positive
    """Above the centre of gravity."""
    bottom_m: Number
    """Below it."""
    crash_speed_m_s: Positive
    """Speed normal to an obstacle above which the vehicle breaks."""


class RoverAirframe(Airframe):
    """The airframe file of a rover."""

    wheels: Wheels
    tyres: Tyres
    steering: Steering
    drive: Drive
    brake: Brake
    hull: Hull

    @property
    def wheel_base_m(self) -> float:
        return self.wheels.front_x_m + self.wheels.rear_x_m

    @property
    def is_skid(self) -> bool:
        return self.steering.layout == "skid"

    @model_validator(mode="after")
    def _steers(self) -> Self:
        if self.is_skid == (self.steering.max_angle_rad > 0.0):
            raise ValueError("steering.max_angle_rad must be 0 for skid steer, and above it for ackermann")
        if self.is_skid and self.drive.driven != "all":
            raise ValueError("drive.driven must be 'all' for skid steer")
        if self.hull.bottom_m >= self.wheels.hub_z_m + self.wheels.radius_m:
            raise ValueError("hull.bottom_m must be above the ground that the wheels stand on")
        if self.tyres.sliding_friction > self.tyres.friction:
            raise ValueError("tyres.sliding_friction must not be above tyres.friction")
        return self


AIRFRAME = RoverAirframe
