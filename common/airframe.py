"""Airframe data: the one file about a vehicle that both its simulated body and its flight controller read.

What every class of vehicles has is here; each class's own sections are in the file of its name in `airframes/`. An
airframe is a TOML file in which every number is `{ value = …, source = "…" }`; a number nobody measured says
`guess` in its source.
"""

import tomllib
from importlib import import_module
from importlib.resources import files
from pathlib import Path
from pkgutil import iter_modules
from typing import Annotated, Any, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

AIRFRAME_FOLDER = Path(str(files("common"))) / "airframes"
DEFAULT_VEHICLE = "multirotor"


class AirframeError(ValueError):
    """The airframe does not exist or its file is wrong; the message is one sentence for the user."""


def _value_with_source(raw: Any) -> Any:
    if not isinstance(raw, dict) or set(raw) != {"value", "source"} or not str(raw["source"]).strip():
        raise ValueError('must be { value = …, source = "…" }')
    return raw["value"]


SOURCED = BeforeValidator(_value_with_source)
Number = Annotated[float, Field(allow_inf_nan=False), SOURCED]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False), SOURCED]
NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False), SOURCED]
Fraction = Annotated[float, Field(ge=0.0, le=1.0), SOURCED]
Count = Annotated[int, Field(gt=0), SOURCED]


class Section(BaseModel):
    """A section of the file, in which nothing else may stand."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Body(Section):
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


class Battery(Section):
    cells: Count
    capacity_mah: Positive
    internal_resistance_ohm: NotNegative
    """Whole pack."""
    full_cell_v: Positive
    empty_cell_v: Positive
    motor_efficiency: Annotated[float, Field(gt=0.0, le=1.0), SOURCED]
    """Shaft power over electrical power, motor and ESC together."""
    avionics_w: NotNegative

    @model_validator(mode="after")
    def _full_is_above_empty(self) -> Self:
        if self.full_cell_v <= self.empty_cell_v:
            raise ValueError("full_cell_v must be above empty_cell_v")
        return self


class Airframe(Section):
    """One airframe file, as far as it has the same sections for all classes of vehicles."""

    name: str
    description: str
    vehicle: str = DEFAULT_VEHICLE
    """The class of vehicles that it is of."""
    body: Body
    battery: Battery


class _OfUnknownClass(Airframe):
    model_config = ConfigDict(extra="ignore", frozen=True)


def airframe_names() -> list[str]:
    """Names of the airframes that ship with the project."""
    return sorted(path.stem for path in AIRFRAME_FOLDER.glob("*.toml"))


def _model_of(vehicle: Any) -> type[Airframe]:
    """What an airframe file has of a class of vehicles: `AIRFRAME` of the file of its name in `common/airframes/`."""
    package = import_module("common.airframes")
    if vehicle not in [module.name for module in iter_modules(package.__path__)]:
        return _OfUnknownClass
    model: type[Airframe] = import_module(f"{package.__name__}.{vehicle}").AIRFRAME
    return model


def load_airframe(name_or_path: str) -> Airframe:
    """Reads an airframe by its name or from the path of a TOML file.

    Raises:
        AirframeError: no such airframe, or the file has a wrong or missing entry.
    """
    path = Path(name_or_path) if name_or_path.endswith(".toml") else AIRFRAME_FOLDER / f"{name_or_path}.toml"
    if not path.is_file():
        raise AirframeError(f"unknown airframe '{name_or_path}'; known: {', '.join(airframe_names())}")
    try:
        entries = tomllib.loads(path.read_text(encoding="utf-8"))
        return _model_of(entries.get("vehicle", DEFAULT_VEHICLE)).model_validate(entries)
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
