"""A world file read: YAML into a `WorldFile`; what is wrong gets one sentence: file, line, key, what is allowed."""

from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import ValidationError

from common.config.refusal import sentence, without_consequences
from common.config.yaml_locations import ConfigError, Located, location_at, note_at, read_yaml
from mission.console.option_checks import UserError

if TYPE_CHECKING:
    from sim.world.custom.world_file import WorldFile
    from sim.world.world import WorldMap


def read_world(file: Path) -> "WorldFile":
    """The world that a file describes, its meshes and images looked at.

    Raises:
        UserError: there is no such world.
    """
    return read_and_build(file)[0]


def read_and_build(file: Path) -> "tuple[WorldFile, WorldMap]":
    """A file's world, and what is built from it.

    Raises:
        UserError: there is no such world.
    """
    from sim.world.custom.world_file import WorldError, WorldFile
    from sim.world.world import build_world

    try:
        root = read_yaml(file, [])
        world = WorldFile.model_validate(root, context={"folder": file.parent.resolve()})
        return world, build_world(world)
    except ConfigError as error:
        raise UserError(str(error)) from error
    except ValidationError as error:
        first = without_consequences(error.errors())[0]
        said = sentence(first, WorldFile)
        if first["type"] == "extra_forbidden" and said == "unknown key":
            said = f"unknown key; allowed are {', '.join(_keys_at(first['loc']))}"
        raise UserError(_at(root, first["loc"], said)) from error
    except WorldError as error:
        raise UserError(_at(root, error.loc, error.sentence)) from error


def _at(root: Located, loc: tuple[int | str, ...], said: str) -> str:
    location, key = location_at(root, loc)
    return note_at(location, key, said)


def _keys_at(loc: tuple[int | str, ...]) -> list[str]:
    """The keys that are allowed beside an unknown one."""
    from pydantic import BaseModel

    from sim.world.custom.world_file import WorldFile

    model: type[BaseModel] = WorldFile
    for step in loc[:-1]:
        if isinstance(step, str):
            below = model.model_fields[step].annotation
            parts = [below, *getattr(below, "__args__", ())]
            model = next(part for part in parts if isinstance(part, type) and issubclass(part, BaseModel))
    return list(model.model_fields)
