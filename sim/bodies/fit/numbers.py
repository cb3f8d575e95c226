"""Which numbers of a multirotor's airframe its flights can tell, and an airframe with other values of them.

Not among them are those that no flight tells apart: the mass (only thrust over mass shows), the greatest speed of the
rotors (only thrust at full command shows), and their torque (only torque over inertia shows). They stay as they are.

Thrust and drags are told by velocities, lag and inertias by rates. Both would be told by both, but what is not known of
rates, above all commands that were logged seldom, would be taken for drag.
"""

from dataclasses import dataclass
from math import exp
from typing import Literal

from common.airframe import AirframeError, load_airframe
from common.airframes.multirotor import MultirotorAirframe, command_at, speed_at

Fittable = MultirotorAirframe
"""What can be fitted."""
CURVE_BOUNDS = 0.0, 1.0
MOST_LOG = 2.5  # no number is fitted to more than twelve times what the airframe said, nor to less than a twelfth


@dataclass(frozen=True, slots=True)
class FittedNumber:
    """One unknown: the logarithm of a factor on the airframe's numbers, or what is added to one."""

    section: Literal["body", "rotor_model"]
    fields: tuple[str, ...]  # those that the same factor scales
    meaning: str
    by_rates: bool = False  # told by rates; else by velocities
    is_factor: bool = True
    followed_by: tuple[str, ...] = ()  # fields that change with it

    @property
    def name(self) -> str:
        return self.fields[0]


NUMBERS = (
    FittedNumber("rotor_model", ("thrust_n_s2",), "thrust"),
    FittedNumber("rotor_model", ("command_curve",), "command curve", is_factor=False, followed_by=("idle_command",)),
    FittedNumber("rotor_model", ("inflow_n_s2_m",), "thrust lost to inflow"),
    FittedNumber("rotor_model", ("drag_n_s2_m",), "drag of the rotors"),
    FittedNumber("rotor_model", ("spin_up_time_s", "spin_down_time_s"), "motor lag", by_rates=True),
    FittedNumber("body", ("drag_area_x_m2",), "drag of the hull, ahead"),
    FittedNumber("body", ("drag_area_y_m2",), "drag of the hull, sideways"),
    FittedNumber("body", ("drag_area_z_m2",), "drag of the hull, upward"),
    FittedNumber("body", ("inertia_xx_kg_m2",), "inertia, roll", by_rates=True),
    FittedNumber("body", ("inertia_yy_kg_m2",), "inertia, pitch", by_rates=True),
    FittedNumber("body", ("inertia_zz_kg_m2",), "inertia, yaw", by_rates=True),
)


def fittable(name_or_path: str) -> Fittable:
    """Reads an airframe that can be fitted.

    Raises:
        AirframeError: as `load_airframe`, or it is of another class.
    """
    airframe = load_airframe(name_or_path)
    if not isinstance(airframe, MultirotorAirframe):
        raise AirframeError(f"airframe '{airframe.name}': only multirotors can be fitted to logs")
    return airframe


def motor_count(airframe: Fittable) -> int:
    return len(airframe.rotors)


def value_of(airframe: MultirotorAirframe, number: FittedNumber) -> float:
    """The first of a number's fields."""
    return float(getattr(getattr(airframe, number.section), number.name))


def bounds_of(airframe: MultirotorAirframe, number: FittedNumber) -> tuple[float, float]:
    """The least and the greatest unknown of a number."""
    if number.is_factor:
        return (-MOST_LOG, MOST_LOG)
    start = value_of(airframe, number)
    return CURVE_BOUNDS[0] - start, CURVE_BOUNDS[1] - start


def with_numbers(airframe: MultirotorAirframe, unknowns: dict[FittedNumber, float]) -> MultirotorAirframe:
    """An airframe with other values of some numbers; with another curve its rotors idle as fast as before."""
    changes: dict[str, dict[str, float]] = {"body": {}, "rotor_model": {}}
    for number, unknown in unknowns.items():
        section = getattr(airframe, number.section)
        for field in number.fields:
            value = getattr(section, field)
            changes[number.section][field] = value * exp(unknown) if number.is_factor else value + unknown
    rotor = airframe.rotor_model
    if "command_curve" in changes["rotor_model"]:
        curve = changes["rotor_model"]["command_curve"]
        changes["rotor_model"]["idle_command"] = command_at(speed_at(rotor.idle_command, rotor.command_curve), curve)
    sections = {name: getattr(airframe, name).model_copy(update=change) for name, change in changes.items()}
    return airframe.model_copy(update=sections)
