"""Airframe data: the one file about a vehicle that both its simulated body and its flight controller read.

An airframe is a TOML file in which every number is `{ value = …, source = "…" }`; a number nobody measured says
`guess` in its source.
"""

import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from common.geodesy import GRAVITY_M_S2

AIRFRAME_FOLDER = Path(str(files("common"))) / "airframes"


class AirframeError(ValueError):
    """The airframe does not exist or its file is wrong; the message is one sentence for the user."""


def _value_with_source(raw: Any) -> Any:
    if not isinstance(raw, dict) or set(raw) != {"value", "source"} or not str(raw["source"]).strip():
        raise ValueError('must be { value = …, source = "…" }')
    return raw["value"]


_SOURCED = BeforeValidator(_value_with_source)
Number = Annotated[float, Field(allow_inf_nan=False), _SOURCED]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False), _SOURCED]
NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False), _SOURCED]
Fraction = Annotated[float, Field(ge=0.0, le=1.0), _SOURCED]
Count = Annotated[int, Field(gt=0), _SOURCED]
Spin = Annotated[Literal[-1, 1], _SOURCED]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Body(_Section):
    mass_kg: Positive
    inertia_xx_kg_m2: Positive
    inertia_yy_kg_m2: Positive
    inertia_zz_kg_m2: Positive
    drag_area_x_m2: Positive
    """Drag coefficient times area seen along body x: force = -½ ρ (c_d A) |v| v."""
    drag_area_y_m2: Positive
    drag_area_z_m2: NotNegative
    angular_drag_n_m_s2: NotNegative
    """Torque per squared body rate opposing rotation about each axis, at sea-level density."""


class Rotor(_Section):
    x_m: Number
    """Position of the hub in frd, from the centre of gravity."""
    y_m: Number
    z_m: Number
    spin: Spin
    """+1 turns counter-clockwise seen from above, -1 clockwise.

    The reaction torque on the body is spin * torque about +z (frd down).
    """


class RotorModel(_Section):
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


class Battery(_Section):
    cells: Count
    capacity_mah: Positive
    internal_resistance_ohm: NotNegative
    """Whole pack."""
    full_cell_v: Positive
    empty_cell_v: Positive
    motor_efficiency: Annotated[float, Field(gt=0.0, le=1.0), _SOURCED]
    """Shaft power over electrical power, motor and ESC together."""
    avionics_w: NotNegative

    @model_validator(mode="after")
    def _full_is_above_empty(self) -> Self:
        if self.full_cell_v <= self.empty_cell_v:
            raise ValueError("full_cell_v must be above empty_cell_v")
        return self


class Contact(_Section):
    leg_x_m: Positive
    """Feet at (±leg_x, ±leg_y, leg_z) in frd."""
    leg_y_m: Positive
    leg_z_m: Positive
    hull_radius_m: Positive
    """Sphere round the whole vehicle, for trunks, crowns and walls; the ground is met by feet and rotor tips."""
    crash_speed_m_s: Positive
    """Speed normal to the surface above which the vehicle breaks."""


class Airframe(_Section):
    """One airframe file."""

    name: str
    description: str
    vehicle: str = "multirotor"
    """The class of vehicles that it is of."""
    body: Body
    rotor_model: RotorModel
    rotors: Annotated[list[Rotor], Field(min_length=3, max_length=8)]
    battery: Battery
    contact: Contact

    @property
    def motor_count(self) -> int:
        return len(self.rotors)

    @model_validator(mode="after")
    def _lifts_itself(self) -> Self:
        rotor = self.rotor_model
        thrust_n = len(self.rotors) * rotor.thrust_n_s2 * rotor.max_speed_rad_s**2
        weight_n = self.body.mass_kg * GRAVITY_M_S2
        if thrust_n <= weight_n:
            raise ValueError(f"the rotors lift {thrust_n:.3g} N at most, the vehicle weighs {weight_n:.3g} N")
        return self


def airframe_names() -> list[str]:
    """Names of the airframes that ship with the project."""
    return sorted(path.stem for path in AIRFRAME_FOLDER.glob("*.toml"))


def load_airframe(name_or_path: str) -> Airframe:
    """Reads an airframe by its name or from the path of a TOML file.

    Raises:
        AirframeError: no such airframe, or the file has a wrong or missing entry.
    """
    path = Path(name_or_path) if name_or_path.endswith(".toml") else AIRFRAME_FOLDER / f"{name_or_path}.toml"
    if not path.is_file():
        raise AirframeError(f"unknown airframe '{name_or_path}'; known: {', '.join(airframe_names())}")
    try:
        return Airframe.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise AirframeError(f"{path}: not TOML: {error}") from error
    except RecursionError as error:
        raise AirframeError(f"{path}: not an airframe: nested too deeply") from error
    except OSError as error:
        raise AirframeError(f"{path}: {error.strerror}") from error
    except ValidationError as error:
        first = error.errors()[0]
        position = ".".join(map(str, first["loc"]))
        parts = (str(path), position, first["msg"].removeprefix("Value error, "))
        raise AirframeError(": ".join(part for part in parts if part)) from error
