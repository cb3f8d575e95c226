"""Parameters: each declared once, with type, default, unit, bounds, meaning and source.

The MAVLink parameter list, the documentation table and the kernel parameter structs are all made from these
declarations. `field` names the kernel struct's field a parameter fills, in SI.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from math import isfinite, radians

SCALE_TO_SI = {"deg": radians(1.0), "deg/s": radians(1.0), "deg/s^2": radians(1.0), "ms": 1.0e-3, "%": 1.0e-2}


class ParameterError(ValueError):
    """A parameter that does not exist or a value it cannot have; the message is one sentence for the user."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """The declaration of one parameter; an int default makes it an INT32, a float default a REAL32."""

    name: str  # at most 16 characters, PX4's name where the meaning is PX4's
    default: int | float
    minimum: float
    maximum: float
    unit: str
    meaning: str
    source: str  # where the default comes from: datasheet, paper, design script, measured, or guess
    field: str = ""  # field of the owning kernel struct, empty if only Python reads it

    @property
    def is_integer(self) -> bool:
        return isinstance(self.default, int)

    def clamped(self, value: float) -> int | float:
        """The value that is stored when `value` is asked for."""
        bounded = min(max(value, self.minimum), self.maximum)
        return int(round(bounded)) if self.is_integer else float(bounded)


class ParameterTable:
    """The values of one vehicle's parameters, in a fixed, dense, alphabetical order."""

    def __init__(self, declarations: Iterable[Parameter]) -> None:
        self.declarations: dict[str, Parameter] = {}
        for declaration in sorted(declarations, key=lambda parameter: parameter.name):
            if declaration.name in self.declarations:
                raise ValueError(f"parameter {declaration.name} is declared twice")
            if len(declaration.name) > 16:
                raise ValueError(f"parameter name {declaration.name} is longer than 16 characters")
            if not declaration.minimum <= declaration.default <= declaration.maximum:
                raise ValueError(f"parameter {declaration.name}: default {declaration.default} is out of bounds")
            self.declarations[declaration.name] = declaration
        self._values: dict[str, int | float] = {name: item.default for name, item in self.declarations.items()}
        self.names = list(self.declarations)
        self._listeners: list[Callable[[Parameter], None]] = []

    def __getitem__(self, name: str) -> int | float:
        return self._values[name]

    def __contains__(self, name: object) -> bool:
        return name in self._values

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)

    def set(self, name: str, value: float) -> int | float:
        """Stores the clamped value, tells the listeners and returns what was stored; NaN and infinity change nothing.

        Raises:
            KeyError: no such parameter.
        """
        declaration = self.declarations[name]
        if isfinite(value):
            stored = declaration.clamped(value)
            if stored != self._values[name]:
                self._values[name] = stored
                for listener in self._listeners:
                    listener(declaration)
        return self._values[name]

    def set_exactly(self, name: str, value: float) -> None:
        """Stores a value as it is.

        Raises:
            ParameterError: no such parameter, or the value is out of its bounds or not whole.
        """
        declaration = self.declarations.get(name)
        if declaration is None:
            raise ParameterError(f"parameter {name}: there is none of that name")
        if not declaration.minimum <= value <= declaration.maximum:
            raise ParameterError(
                f"parameter {name}: {value:g} is not between {declaration.minimum:g} and {declaration.maximum:g}"
            )
        if declaration.is_integer and value != int(value):
            raise ParameterError(f"parameter {name}: {value:g} is not a whole number")
        self.set(name, value)

    def on_change(self, listener: Callable[[Parameter], None]) -> None:
        """Calls `listener(declaration)` after each change."""
        self._listeners.append(listener)

    def si(self, name: str) -> float:
        """The value in SI: degrees as radians, milliseconds as seconds, per cent as a fraction."""
        scale = SCALE_TO_SI.get(self.declarations[name].unit)
        return self._values[name] if scale is None else self._values[name] * scale

    def fields(self, declarations: Iterable[Parameter]) -> dict[str, float]:
        """Kernel struct fields and their SI values, for those of `declarations` that name a field."""
        return {item.field: self.si(item.name) for item in declarations if item.field}
