"""The text of docs/reference/world-file.md, made from the models that read world files."""

from types import NoneType
from typing import Any, get_args

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from sim.world.custom import world_file
from sim.world.custom.world_file import WorldFile

HEADER = """\
# World file

Written by `python -m docs.generate` from the code: do not edit.

Every key of a [world file](../how-to/worlds.md), and every field of `WorldFile` in `sim/world/custom/world_file.py`.
Positions are ned [m] from home; one of two numbers is on the ground there. Paths of files are relative to the folder of
the world file.

"""
LISTS = {
    "heightmap": world_file.Heightmap,
    "boxes: one": world_file.BoxSolid,
    "walls: one": world_file.WallSolid,
    "cylinders: one": world_file.CylinderSolid,
    "meshes: one": world_file.MeshSolid,
    "pads: one": world_file.PadSolid,
}
LEFT_OUT = ("wall_count", "mover_count", "spot_count")  # of worlds that are grown in batches
_SIGNS = {"ge": "from", "le": "to"}


def world_text() -> str:
    """The whole page."""
    own = ("heightmap", "boxes", "walls", "cylinders", "meshes", "pads")
    names = [*own, *(name for name in WorldFile.model_fields if name not in (*own, *LEFT_OUT))]
    parts = [HEADER, _section("The file", WorldFile, names)]
    parts += [_section(title, model, list(model.model_fields)) for title, model in LISTS.items()]
    return "\n".join(parts)


def _section(title: str, model: type[BaseModel], names: list[str]) -> str:
    rows = [f"## {title}\n", "| key | default | meaning |", "|---|---|---|"]
    for name in names:
        field = model.model_fields[name]
        rows.append(f"| `{name}` | {_default(field)} | {' '.join((field.description or '').split())}{_bounds(field)} |")
    return "\n".join(rows) + "\n"


def _default(field: FieldInfo) -> str:
    value: Any = field.default
    if value is PydanticUndefined:
        return "required"
    if value in (None, ()):
        return "none"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return f"[{', '.join(f'{each:g}' for each in value)}]"
    return f"{value:g}" if isinstance(value, int | float) else str(value)


def _bounds(field: FieldInfo) -> str:
    """The range of a number, as its field or its type has it."""
    rules = [*field.metadata]
    for part in get_args(field.annotation):
        rules += [] if part is NoneType else getattr(part, "__metadata__", ())
    for rule in list(rules):
        rules += getattr(rule, "metadata", ())
    words = [
        f"{word} {limits[-1]:.10g}"
        for name, word in _SIGNS.items()
        if (limits := [getattr(rule, name) for rule in rules if getattr(rule, name, None) is not None])
    ]
    return f" ({' '.join(words)})" if words else ""
