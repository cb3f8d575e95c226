"""What every block of the configuration shares: frozen, no unknown keys, numbers as people type them.

YAML 1.1 reads `1e-5` (no dot) as text and `2e6` as text or float: both are taken as the numbers they are meant to be.
"""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

Schedule = Literal["linear", "constant"]


class Block(BaseModel):
    """One mapping of the file."""

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        use_attribute_docstrings=True,
        allow_inf_nan=False,
        coerce_numbers_to_str=True,  # a run may be called 7
    )


def own_key(default: Any, **limits: Any) -> Any:
    """A key that ML-Agents does not have."""
    return Field(default=default, json_schema_extra={"is_own": True}, **limits)


def _number(raw: Any) -> Any:
    if isinstance(raw, bool):
        raise ValueError("must be a number")
    return raw


def _whole(raw: Any) -> Any:
    number = _number(raw)
    try:
        value = float(number)
    except (TypeError, ValueError):
        raise ValueError("must be a whole number") from None
    if not value.is_integer():
        raise ValueError("must be a whole number")
    return int(number) if isinstance(number, int) else int(value)


def _none(raw: Any) -> Any:
    return None if isinstance(raw, str) and raw.lower() == "none" else raw


Whole = Annotated[int, BeforeValidator(_whole)]
Count = Annotated[int, Field(ge=1), BeforeValidator(_whole)]
NotNegativeWhole = Annotated[int, Field(ge=0), BeforeValidator(_whole)]
Real = Annotated[float, BeforeValidator(_number)]
Positive = Annotated[float, Field(gt=0.0), BeforeValidator(_number)]
NotNegative = Annotated[float, Field(ge=0.0), BeforeValidator(_number)]
Fraction = Annotated[float, Field(ge=0.0, le=1.0), BeforeValidator(_number)]
PositiveOrNone = Annotated[Positive | None, BeforeValidator(_none)]
FractionOrNone = Annotated[Fraction | None, BeforeValidator(_none)]
CountOrNone = Annotated[Count | None, BeforeValidator(_none)]
