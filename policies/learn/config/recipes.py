"""The recipes that ship with the project, by the name of their task or of their file."""

from importlib.resources import files
from pathlib import Path

from common.config.yaml_locations import ConfigError
from policies.tasks.catalogue import file_stem


def recipe_names() -> list[str]:
    """The recipes: names of files without their ending."""
    return sorted(path.stem for path in _folder().glob("*.yaml"))


def recipe(name: str) -> Path:
    """The file of a recipe.

    Args:
        name: of the recipe (`reach-target`), or of the task (`ReachTarget`).

    Raises:
        ConfigError: no such recipe.
    """
    stem = name if name in recipe_names() else file_stem(name)
    if stem not in recipe_names():
        raise ConfigError(
            f"{name}: there is no recipe of this name; there are {', '.join(recipe_names())}; "
            "module:Class is a task of your own"
        )
    return _folder() / f"{stem}.yaml"


def _folder() -> Path:
    return Path(str(files("policies.recipes")))
