"""The recipes that ship with the project, by the name of their task or of their file."""

import re
from importlib.resources import files
from pathlib import Path

from policies.learn.config.places import ConfigError


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
    stem = name if name in recipe_names() else re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", name).lower()
    if stem not in recipe_names():
        raise ConfigError(f"{name}: there is no recipe of this name; there are {', '.join(recipe_names())}")
    return _folder() / f"{stem}.yaml"


def _folder() -> Path:
    return Path(str(files("policies.recipes")))
