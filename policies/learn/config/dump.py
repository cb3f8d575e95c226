"""A configuration as the text of a YAML file in ML-Agents' new form: every key that has a value."""

from typing import Any

import yaml

from policies.learn.config.run import RunConfig


def dump(config: RunConfig) -> str:
    """The YAML; reading it again gives an equal configuration."""
    values = config.model_dump(exclude_none=True)
    name, behavior = values.pop("behavior_name"), values.pop("behavior")
    return str(yaml.safe_dump(_plain({"behaviors": {name: behavior}, **values}), sort_keys=False))


def _plain(value: Any) -> Any:
    """Tuples as the lists that YAML has."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return [_plain(item) for item in value] if isinstance(value, tuple | list) else value
