"""Scenarios with other values at some keys: `wind.speed_m_s`, `faults.0.at`, `vehicle.parameters.BAT_CAPACITY`.

In: a scenario and values by key. Out: the scenario of one run, checked as one from a file is. Light to import.
"""

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from common.config.refusal import faulty_path, sentence
from mission.campaign.campaign import SEED_KEY
from mission.campaign.distributions import Value
from mission.scenario.scenario import Scenario


class KeyFault(ValueError):
    """A key or a value that the scenario cannot have; the message is a sentence."""


def varied(scenario: Scenario, values: Mapping[str, Value]) -> Scenario:
    """The scenario with these values; `seed` is not one of its keys and is left out.

    Raises:
        KeyFault: it cannot have them.
    """
    given = scenario.model_dump(mode="json", by_alias=True, exclude_unset=True)
    for key, value in values.items():
        if key != SEED_KEY:
            _put(given, key, value)
    try:
        return Scenario.model_validate(given)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in faulty_path(first))
        raise KeyFault(f"the scenario cannot be so: {where}: {sentence(first, Scenario)}") from error


def _put(given: Any, key: str, value: Value) -> None:
    at, parts = given, key.split(".")
    for done, part in enumerate(parts):
        is_last = done == len(parts) - 1
        path = ".".join(parts[:done])
        if isinstance(at, list):
            if not part.isdigit() or int(part) >= len(at):
                there = f"0 to {len(at) - 1}" if at else "none"
                raise KeyFault(f"{path} has no entry {part}; there are {there}")
            if is_last:
                at[int(part)] = value
            else:
                at = at[int(part)]
        elif isinstance(at, dict):
            if is_last:
                at[part] = value
            elif part in at:
                at = at[part]
            else:
                at = at.setdefault(part, [] if parts[done + 1].isdigit() else {})
        else:
            raise KeyFault(f"{path} is a value, which has no {part}")
