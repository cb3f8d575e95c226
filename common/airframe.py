"""Airframe data: the one file about a vehicle that both its simulated body and its flight controller read.

An airframe is a TOML file in which every number is `{ value = …, source = "…" }`; a number nobody measured says
`guess` in its source.
"""

import tomllib
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

AIRFRAME_FOLDER = Path(__file__).resolve().parent.parent / "sim" / "bodies" / "airframes"


class AirframeError(ValueError):
    """The airframe does not exist or its file is wrong; the message is one sentence for the user."""


def _value_with_source(raw: Any) -> Any:
    if not isinstance(raw, dict) or set(raw) != {"value", "source"} or not str(raw["source"]).strip():
        raise ValueError('must be { value = …, source = "…" }')
    return raw["value"]


Sourced = Annotated[float, BeforeValidator(_value_with_source)]
SourcedCount = Annotated[int, BeforeValidator(_value_with_source)]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Body(_Section):
    mass_kg: Sourced
    inertia_xx_kg_m2: Sourced
    inertia_yy_kg_m2: Sourced
    inertia_zz_kg_m2: Sourced
    drag_area_x_m2: Sourced
    """Drag coefficient times area seen along body x: force = -½ ρ (c_d A) |v| v."""
    drag_area_y_m2: Sourced
    drag_area_z_m2: Sourced
    angular_drag_n_m_s2: Sourced
    """Torque per squared body rate opposing rotation about each axis, at sea-level density."""


class Rotor(_Section):
    x_m: Sourced
    """Position of the hub in frd, from the centre of gravity."""
    y_m: Sourced
    z_m: Sourced
    spin: SourcedCount
    """+1 turns counter-clockwise seen from above, -1 clockwise.

    The reaction torque on the body is spin * torque about +z (frd down).
    """


class RotorModel(_Section):
    radius_m: Sourced
    thrust_n_s2: Sourced
    """Static thrust per squared speed: T = thrust_n_s2 * omega² at sea-level density."""
    torque_n_m_s2: Sourced
    """Aerodynamic torque per squared speed."""
    max_speed_rad_s: Sourced
    """Speed at full command and full battery."""
    idle_command: Sourced
    """Command [0..1] at which an armed motor idles."""
    command_curve: Sourced
    """a in omega / omega_max = a * u + (1 - a) * sqrt(u): 1 is a speed-linear ESC, 0 a thrust-linear one."""
    spin_up_time_s: Sourced
    """First-order lag of rising speed."""
    spin_down_time_s: Sourced
    inertia_kg_m2: Sourced
    """Rotor and bell, about the spin axis."""
    drag_n_s2_m: Sourced
    """In-plane rotor drag per rotor: force = -drag_n_s2_m * omega * v_in_plane."""
    inflow_n_s2_m: Sourced
    """Thrust lost per rotor to axial inflow: inflow_n_s2_m * omega * (speed of the hub through the air, up)."""


class Battery(_Section):
    cells: SourcedCount
    capacity_mah: Sourced
    internal_resistance_ohm: Sourced
    """Whole pack."""
    full_cell_v: Sourced
    empty_cell_v: Sourced
    motor_efficiency: Sourced
    """Shaft power over electrical power, motor and ESC together."""
    avionics_w: Sourced


class Contact(_Section):
    leg_x_m: Sourced
    """Feet at (±leg_x, ±leg_y, leg_z) in frd."""
    leg_y_m: Sourced
    leg_z_m: Sourced
    hull_radius_m: Sourced
    """Sphere round the whole vehicle, for trunks, crowns and walls; the ground is met by feet and rotor tips."""
    crash_speed_m_s: Sourced
    """Speed normal to the surface above which the vehicle breaks."""


class Airframe(_Section):
    """One airframe file."""

    name: str
    description: str
    body: Body
    rotor_model: RotorModel
    rotors: Annotated[list[Rotor], Field(min_length=3, max_length=8)]
    battery: Battery
    contact: Contact


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
    except tomllib.TOMLDecodeError as error:
        raise AirframeError(f"{path}: not TOML: {error}") from error
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise AirframeError(f"{path}: {place}: {first['msg']}") from error
