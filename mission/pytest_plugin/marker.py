"""The marker `@pytest.mark.honeyguide(...)`, as a scenario: keys of a scenario file, its vehicle's beside them.

Markers of a module, a class, a test and its parameters go together, and the nearest of a key holds.
"""

from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import Any, TypeVar

import pytest
from pydantic import BaseModel, ValidationError

from common.config.refusal import meant_or_known, sentence
from mission.console.option_checks import UserError
from mission.scenario.parts.checks import Check
from mission.scenario.scenario import Scenario, Vehicle
from mission.scenario.scenario_file import resolve_paths

NAME = "honeyguide"
SEVERAL = {"airframes": "airframe", "winds": "wind", "seeds": "seed"}
"""Keys that a test is flown with one by one, and what each of their values is."""
KEYS = {*SEVERAL, "seed", *Vehicle.model_fields, *Scenario.model_fields} - {"name", "about"}
SEED_MAX = 2**31 - 1

Keys = Mapping[str, Any]
Entry = TypeVar("Entry", bound=BaseModel)


class MarkerError(UserError):
    """A marker says something that is wrong; the message is a sentence."""


def given_keys(item: pytest.Item) -> Keys:
    """What the markers of a test say.

    Raises:
        MarkerError: one has a key that there is not, or values without a key.
    """
    found: dict[str, Any] = {}
    of_parameters = [] if (spec := getattr(item, "callspec", None)) is None else spec.marks
    markers = list(item.iter_markers(NAME))[::-1]
    markers.sort(key=lambda marker: any(marker is each for each in of_parameters))  # the nearest of all
    for marker in markers:
        if marker.args:
            raise MarkerError(f"{_at(item)}: takes keys only, as wind=5, not {marker.args[0]!r}")
        for key, value in marker.kwargs.items():
            if key not in KEYS:
                raise MarkerError(f"{_at(item)}: unknown key {key}; {meant_or_known(key, sorted(KEYS))}")
            for many, one in SEVERAL.items():  # the nearest holds, in either form
                if key in (many, one):
                    found.pop(many, None)
                    found.pop(one, None)
            found[key] = value
    return found


def _at(item: pytest.Item) -> str:
    return f"{item.nodeid}: @pytest.mark.{NAME}"


def choices(given: Keys) -> dict[str, dict[str, Any]]:
    """What a test is flown with one after the other, by the name of each; empty: it is flown once.

    Raises:
        MarkerError: what should be a list is none.
    """
    lists = []
    for many, one in SEVERAL.items():
        if many in given:
            values = given[many]
            if not isinstance(values, list | tuple | range) or not values:
                raise MarkerError(f"@pytest.mark.{NAME}: {many}: must be a list of at least one, not {values!r}")
            lists.append([(one, value) for value in values])
    if not lists:
        return {}
    return {"-".join(_id(*each) for each in chosen): dict(chosen) for chosen in product(*lists)}


def _id(key: str, value: Any) -> str:
    if key == "airframe":
        return Path(str(value)).stem
    if isinstance(value, dict):
        value = "_".join(f"{each:g}" if isinstance(each, float | int) else str(each) for each in value.values())
    return f"{key}{value}"


def scenario_of(item: pytest.Item, choice: Keys) -> tuple[Scenario, int]:
    """The scenario of a test, and the seed of this run.

    Args:
        item: the test; paths in its markers are seen from its folder.
        choice: one of `choices`.

    Raises:
        MarkerError: it says something that is wrong.
    """
    given = {key: _plain(value) for key, value in given_keys(item).items() if key not in SEVERAL}
    given |= {key: _plain(value) for key, value in choice.items()}
    seed = given.pop("seed", 1)
    if not isinstance(seed, int) or not 0 <= seed <= SEED_MAX:
        raise MarkerError(f"{_at(item)}: seed: must be a whole number from 0, not {seed!r}")
    own = {key: given.pop(key) for key in list(given) if key in Vehicle.model_fields}
    if own and given.keys() & {"vehicle", "vehicles"}:
        raise MarkerError(f"{_at(item)}: {', '.join(own)}: is of a vehicle, write it there")
    root = {**given, **({"vehicle": own} if own else {})}
    if isinstance(root.get("wind"), int | float):
        root["wind"] = {"speed_m_s": root["wind"]}
    if isinstance(root.get("world"), str):
        root["world"] = {"kind": root["world"]}
    checks = root.pop("checks", ())
    try:
        resolve_paths(root, item.path.parent)
        scenario = Scenario.model_validate(root)
    except ValidationError as error:
        raise MarkerError(f"{_at(item)}: {_fault(error, Scenario, is_flat=bool(own))}") from error
    return scenario.model_copy(
        update={
            "name": item.name,
            "checks": tuple(part_of(Check, check, f"checks[{i}]") for i, check in enumerate(checks)),
        }
    ), seed


def _plain(value: Any) -> Any:
    """A value as a file would have it; a copy."""
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, Mapping):
        return {key: _plain(each) for key, each in value.items()}
    return [_plain(each) for each in value] if isinstance(value, list | tuple) else value


def part_of(model: type[Entry], given: Any, name: str) -> Entry:
    """A check or a fault, from one or from the entry of a scenario file.

    Raises:
        MarkerError: it is none.
    """
    try:
        return model.model_validate(given)
    except ValidationError as error:
        raise MarkerError(f"{name}: {_fault(error, model)}") from error


def _fault(error: ValidationError, model: type[BaseModel], *, is_flat: bool = False) -> str:
    first = error.errors()[0]
    place = [str(step) for step in first["loc"]]
    if is_flat and place[:1] == ["vehicle"]:
        place = place[1:]
    text = sentence(first, model)
    return f"{'.'.join(place)}: {text}" if place else text
