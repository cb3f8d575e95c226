"""Scenario files: found, read, checked; each fault is one sentence with file, line and key. Light to import."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from common.config.refusal import NO_SUCH_KEY, faulty_path, keys_beside, sentence, without_consequences
from common.config.yaml_locations import ConfigError, Located, location_at, note_at, parse_yaml
from mission.console.option_checks import UserError
from mission.scenario.parts.part import Key, KeyRefusal
from mission.scenario.scenario import Scenario

SUFFIX = ".scenario.yaml"
READY = Path(__file__).parent / "ready"
"""The scenarios that ship."""


@dataclass(frozen=True, slots=True)
class ScenarioFile:
    """A scenario and where it came from."""

    path: Path
    scenario: Scenario


def find_files(paths: Iterable[Path]) -> list[Path]:
    """The scenario files of files and folders, in order, each once.

    Raises:
        UserError: there is no such path, or a folder without any.
    """
    found: dict[Path, Path] = {}  # as it is named, by where it is
    for path in paths:
        if path.is_dir():
            inside = sorted(path.rglob(f"*{SUFFIX}"))
            if not inside:
                raise UserError(f"{path}: holds no *{SUFFIX}")
        elif path.is_file():
            inside = [path]
        else:
            raise UserError(f"{path}: no such file or folder")
        for each in inside:
            found.setdefault(each.resolve(), each)
    return list(found.values())


def read_scenario(path: Path | str) -> Scenario:
    """The scenario of a file; paths in it, which are seen from its folder, are made absolute.

    Raises:
        UserError: it cannot be read, or says something that is wrong.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise UserError(f"{path}: is not UTF-8 text") from None
    except OSError as error:
        raise UserError(f"{path}: {(error.strerror or 'cannot be read').lower()}") from None
    return parse_scenario(text, str(path), path.parent)


def parse_scenario(text: str, file: str, folder: Path) -> Scenario:
    """The scenario of a text.

    Args:
        text: YAML.
        file: what faults call it.
        folder: that paths in it are seen from.

    Raises:
        UserError: it says something that is wrong.
    """
    notes: list[str] = []
    try:
        root = parse_yaml(text, file, notes)
    except ConfigError as error:
        raise UserError(str(error)) from error
    if notes:
        raise UserError(notes[0])
    return scenario_of(root, Path(file).name.removesuffix(SUFFIX), folder)


def scenario_of(root: Located, name: str, folder: Path) -> Scenario:
    """The scenario of a mapping, which may be a part of a file.

    Args:
        root: the mapping.
        name: how it is called if it does not say.
        folder: that paths in it are seen from.

    Raises:
        UserError: it says something that is wrong.
    """
    if not root.get("name"):
        root.put("name", name)
    resolve_paths(root, folder.resolve())
    try:
        scenario = Scenario.model_validate(root)
    except ValidationError as error:
        raise UserError(_fault(error, root)) from error
    scenario.keep_source(root)
    return scenario


def _fault(error: ValidationError, root: Located) -> str:
    """The first fault as a sentence with its place."""
    first = min(without_consequences(error.errors()), key=lambda each: location_at(root, _key(each))[0].line)
    location, key = location_at(root, _key(first))
    return note_at(location, key, _sentence(first))


def _key(error: ErrorDetails) -> Key:
    """The path of what is wrong, which may be deeper than what pydantic was looking at."""
    raised = error.get("ctx", {}).get("error")
    return (*faulty_path(error), *(raised.key if isinstance(raised, KeyRefusal) else ()))


def _sentence(error: ErrorDetails) -> str:
    """What is wrong, without the place."""
    raised = error.get("ctx", {}).get("error")
    if isinstance(raised, KeyRefusal):
        return raised.sentence
    text = sentence(error, Scenario)
    return f"{text}; there are {', '.join(keys_beside(Scenario, error['loc']))}" if text == NO_SUCH_KEY else text


def resolve_paths(root: dict[str, Any], folder: Path) -> None:
    """Makes paths absolute, as far as the file has the form that it should."""
    for vehicle in [root.get("vehicle"), *_mappings(root.get("vehicles"))]:
        if isinstance(vehicle, dict):
            for key in ("plan", "python"):
                _absolute(vehicle, key, folder)
            airframe = vehicle.get("airframe")
            if isinstance(airframe, str) and airframe.endswith(".toml"):
                _absolute(vehicle, "airframe", folder)
            for step in _mappings(vehicle.get("script")):
                given = step.get("fly_plan")
                _absolute(
                    given if isinstance(given, dict) else step,
                    "file" if isinstance(given, dict) else "fly_plan",
                    folder,
                )
    if isinstance(root.get("world"), dict):
        _absolute(root["world"], "file", folder)


def _mappings(value: Any) -> list[dict[str, Any]]:
    return [each for each in value if isinstance(each, dict)] if isinstance(value, list) else []


def _absolute(mapping: dict[str, Any], key: str, folder: Path) -> None:
    if isinstance(mapping.get(key), str):
        mapping[key] = str(folder / mapping[key])
