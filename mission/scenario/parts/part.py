"""What the parts of a scenario have in common: strict, frozen, and short to write.

In YAML `takeoff: 10` means `takeoff: {height_m: 10}`, and a step or check that needs nothing is its name alone. The
published schema says the same. Light to import.
"""

from typing import Annotated, Any, ClassVar, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from common.config.refusal import meant_or_known, shown
from mission.console.option_checks import UserError

Key = tuple[str | int, ...]
"""The path of a key of a scenario: `("checks", 0, "from")`."""
Finite = Annotated[float, Field(allow_inf_nan=False)]
Metres = Annotated[float, Field(ge=0.0, le=100_000.0)]
Seconds = Annotated[float, Field(ge=0.0, le=36_000.0)]
Point = tuple[Finite, Finite, Finite]
"""North, east, down of home [m]."""
Place = tuple[Finite, Finite]
"""North, east of home [m]."""


def _file_name(name: str) -> str:
    """The name, if a file or folder can be called so and is then nowhere else."""
    if name in (".", "..") or not name.isprintable() or not {"/", "\\"}.isdisjoint(name):
        raise ValueError(f"is the name of files and folders: no path, not {shown(name)}")
    return name


FileName = Annotated[
    str, Field(max_length=240, json_schema_extra={"pattern": r"^[^/\\]*$"}), AfterValidator(_file_name)
]
"""What files and folders are called after; empty, where it may be left out."""


class KeyRefusal(UserError):
    """A key of a scenario says something that is wrong.

    Args:
        key: which, from the part on that refuses it.
        sentence: what is wrong, without the key.
    """

    def __init__(self, key: Key, sentence: str) -> None:
        super().__init__(key, sentence)
        self.key, self.sentence = key, sentence

    def __str__(self) -> str:
        return f"{key_text(self.key)}: {self.sentence}"


def key_text(key: Key) -> str:
    """A key as people write it: checks[0].from."""
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in key).removeprefix(".")


def check_order(low: float | None, high: float | None, names: tuple[str, str] = ("min", "max")) -> None:
    """Refuses bounds between which nothing is."""
    if low is not None and high is not None and low > high:
        raise ValueError(f"{names[0]} {low:g} is above {names[1]} {high:g}")


def check_asked(part: BaseModel, *names: str) -> None:
    """Refuses a check that passes whatever happens: it gives none of these."""
    if all(getattr(part, name) is None for name in names):
        raise ValueError(f"asks for nothing: needs {', '.join(names[:-1])} or {names[-1]}")


class Part(BaseModel):
    """A mapping of a scenario."""

    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)


class Short(Part):
    """One that may be written as the value of its key `short` alone."""

    short: ClassVar[str]

    @model_validator(mode="before")
    @classmethod
    def _from_short(cls, given: Any) -> Any:
        return given if isinstance(given, dict | BaseModel) else {cls.short: given}

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        reference = handler(core)
        whole = handler.resolve_ref_schema(reference)
        copy = dict(whole)
        alone = {k: v for k, v in copy["properties"][cls.short].items() if k not in {"title", "default"}}
        whole.clear()
        whole.update(anyOf=[alone, copy], description=copy.get("description", ""))
        return reference


class OneOf(Part):
    """A mapping in which one key says what it is, besides those of `besides`."""

    what: ClassVar[str]
    besides: ClassVar[frozenset[str]] = frozenset()

    @model_validator(mode="before")
    @classmethod
    def _from_name(cls, given: Any) -> Any:
        if isinstance(given, str):
            if given not in cls.model_fields:
                raise ValueError(f"unknown {cls.what} {shown(given)}; {meant_or_known(given, cls.names())}")
            return {given: {}}
        if isinstance(given, dict):
            return {key: {} if value is None and key in cls.model_fields else value for key, value in given.items()}
        return given

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        chosen = self.model_fields_set - self.besides
        if len(chosen) != 1:
            found = f"names {' and '.join(sorted(chosen))}: put each in an entry of its own" if chosen else "names none"
            hint = "" if chosen else f"; there are {', '.join(self.names())}"
            raise ValueError(f"an entry names one {self.what}, this one {found}{hint}")
        return self

    @classmethod
    def names(cls) -> list[str]:
        """What it may be."""
        return [name for name in cls.model_fields if name not in cls.besides]

    @property
    def name_chosen(self) -> str:
        """The key that says what it is."""
        return next(iter(self.model_fields_set - self.besides))

    @property
    def chosen(self) -> Any:
        """Its value."""
        return getattr(self, self.name_chosen)

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        reference = handler(core)
        whole = handler.resolve_ref_schema(reference)
        copy = dict(whole)
        for key in cls.names():
            copy["properties"][key] = without_none(copy["properties"][key])
        copy["oneOf"] = [{"required": [name]} for name in cls.names()]
        whole.clear()
        whole.update(anyOf=[{"enum": cls.names()}, copy], description=copy.get("description", ""))
        return reference


def without_none(schema: JsonSchemaValue) -> JsonSchemaValue:
    """The schema of an optional value that is there; a key without a value stands for an empty mapping."""
    rest = {key: value for key, value in schema.items() if key not in {"default", "anyOf", "title"}}
    return {**rest, "anyOf": schema["anyOf"]} if "anyOf" in schema else rest
