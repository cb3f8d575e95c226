"""A command of the command line made from a model: its fields are the options, and nothing is declared twice."""

from collections.abc import Callable, Iterable
from inspect import Parameter, Signature
from typing import Annotated, Any, Literal, TypeVar, cast, get_origin

import typer
from pydantic import BaseModel, Field, ValidationError
from pydantic.fields import FieldInfo

from mission.console.command_refusal import refuse

Options = TypeVar("Options", bound=BaseModel)


def option(
    default: Any, meaning: str, flag: str = "", *, shown: str = "", ge: float | None = None, le: float | None = None
) -> Any:
    """A field of a model that the command line has as an option.

    Args:
        default: without the option.
        meaning: its sentence of the help.
        flag: as typed; empty: made from the name of the field.
        shown: the default in words, for the help.
        ge: lower bound, if it has one.
        le: upper bound, likewise.
    """
    return Field(default=default, description=meaning, ge=ge, le=le, json_schema_extra={"flag": flag, "shown": shown})


def option_fields(model: type[BaseModel]) -> list[str]:
    """The fields of a model that are options: its own first, then those that it inherits."""
    own = model.__annotations__
    fields = [name for name, field in model.model_fields.items() if field.json_schema_extra is not None]
    return sorted(fields, key=lambda name: name not in own)


def model_command(
    model: type[Options], run: Callable[[Options], int], *, names: Iterable[str] = ()
) -> Callable[..., None]:
    """A function for Typer with an option for each field, which gives the model to `run` and ends with its exit code.

    Args:
        model: whose fields are the options.
        run: what the command does.
        names: the fields that are options, in this order; all of them if empty.
    """
    fields = {_argument(name, model.model_fields[name]): name for name in names or option_fields(model)}

    def command(**given: Any) -> None:
        try:
            options = model(**{fields[name]: value for name, value in given.items() if value is not None})
        except ValidationError as error:
            refuse(first_fault(error))
        raise typer.Exit(run(options))

    parameters = [_parameter(argument, model.model_fields[name]) for argument, name in fields.items()]
    command.__signature__ = Signature(parameters)  # type: ignore[attr-defined]  # what Typer reads
    return command


def first_fault(error: ValidationError) -> str:
    """The sentence about values that a model does not take."""
    first = error.errors()[0]
    return f"{'.'.join(map(str, first['loc']))}: {first['msg']}"


def _argument(name: str, field: FieldInfo) -> str:
    """The name of the argument: that of the flag, as a Python name."""
    flag = cast(dict[str, str], field.json_schema_extra)["flag"].partition("/")[0]
    return flag.removeprefix("--").replace("-", "_") or name


def _parameter(argument: str, field: FieldInfo) -> Parameter:
    """The field as an argument that Typer understands."""
    reported = cast(dict[str, str], field.json_schema_extra)
    flag = reported["flag"] or f"--{argument.replace('_', '-')}"
    bounds = {end: getattr(rule, end) for rule in field.metadata for end in ("ge", "le") if hasattr(rule, end)}
    info = typer.Option(
        flag,
        help=field.description,
        show_default=reported["shown"] or True,
        min=bounds.get("ge"),
        max=bounds.get("le"),
    )
    kind: Any = field.annotation
    default = field.default
    if get_origin(kind) is Literal:
        kind = str
    elif get_origin(kind) is tuple:
        kind, default = list[str] | None, None
    return Parameter(argument, Parameter.KEYWORD_ONLY, annotation=Annotated[kind, info], default=default)
