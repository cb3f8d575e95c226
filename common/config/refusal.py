"""What pydantic found wrong with a configuration, as one sentence for the user."""

import difflib
from collections.abc import Iterable, Sequence
from typing import Any, get_args

from pydantic import BaseModel
from pydantic_core import ErrorDetails

_BOUNDS = {
    "greater_than": ("gt", "above"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "below"),
    "less_than_equal": ("le", "at most"),
}
NO_SUCH_KEY = "unknown key"
_KINDS = {
    "float": "a number",
    "finite": "a finite number",
    "int": "a whole number",
    "bool": "true or false",
    "string": "text",
    "model": "a mapping of keys to values",
    "dict": "a mapping of keys to values",
    "tuple": "a list",
    "list": "a list",
    "none": "left out",
}


def sentence(error: ErrorDetails, model: type[BaseModel]) -> str:
    """What is wrong, without the location.

    Args:
        error: as pydantic reports it.
        model: the model that was validated.
    """
    kind, context = error["type"], error.get("ctx", {})
    if kind == "extra_forbidden":
        return unknown_key(str(error["loc"][-1]), keys_beside(model, error["loc"]))
    if kind == "missing":
        return "is required"
    if kind == "literal_error":
        return f"must be {context['expected'].replace(chr(39), '')}, not {shown(error['input'])}"
    if kind in _BOUNDS:
        name, word = _BOUNDS[kind]
        return f"must be {word} {context[name]:g}, not {shown(error['input'])}"
    if kind in {"value_error", "assertion_error"}:
        return str(context.get("error", error["msg"]))
    if kind in {"too_short", "string_too_short"}:
        return "must not be empty"
    wanted = _KINDS.get(kind.split("_", maxsplit=1)[0])
    return f"must be {wanted}, not {shown(error['input'])}" if wanted else error["msg"][0].lower() + error["msg"][1:]


def without_consequences(errors: Sequence[ErrorDetails]) -> list[ErrorDetails]:
    """What pydantic found, without the keys that are missing only because they are spelled wrong."""
    unknown = {each["loc"][:-1] for each in errors if each["type"] == "extra_forbidden"}
    return [each for each in errors if each["type"] != "missing" or each["loc"][:-1] not in unknown]


def faulty_path(error: ErrorDetails) -> tuple[int | str, ...]:
    """The path of the value that is wrong, or of the key that is: pydantic's mark of a key is left out."""
    return tuple(step for step in error["loc"] if step != "[key]")


def unknown_key(key: str, known_keys: Iterable[str]) -> str:
    """The sentence about a key that does not exist."""
    meant = nearest(key, known_keys)
    return f"{NO_SUCH_KEY}; {meant}" if meant else NO_SUCH_KEY


def nearest(name: str, known: Iterable[str]) -> str:
    """The question whether the nearest of the known names was meant; "": none is near."""
    near = difflib.get_close_matches(name, [each for each in known if each != name], n=1)
    return f"did you mean {near[0]}?" if near else ""


def meant_or_known(name: str, known: Iterable[str]) -> str:
    """That question, or else all names there are."""
    names = list(known)
    return nearest(name, names) or f"there are {', '.join(names) or 'none'}"


def keys_beside(model: type[BaseModel], loc: tuple[int | str, ...]) -> list[str]:
    """The keys that the block with the last key of a path may have."""
    models = [model]
    for step in loc[:-1]:
        below = [
            m for at in models if step in at.model_fields for m in _models_in(at.model_fields[str(step)].annotation)
        ]
        models = below or models  # a list's index, or the name of a parameter: no field
    return [field.alias or key for at in models for key, field in at.model_fields.items()]


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for part in get_args(annotation) for model in _models_in(part)]


def shown(value: Any) -> str:
    """A value as people wrote it, short."""
    if value is None:
        return "empty"
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list | tuple):
        return "a list"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, BaseModel):
        return type(value).__name__
    text = repr(value) if isinstance(value, str) else str(value)
    return text if len(text) <= 60 else text[:57] + "..."
