"""Configuration files of ML-Agents in all three forms, and ours, read into a `RunConfig`.

In: a YAML file, the name of one of its behaviours, and the curriculum and sampler files that 0.15 had beside it.
Out: the configuration, and one sentence for each thing in the file that is not what it seems to be.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from common.config.refusal import sentence, unknown_key
from common.config.yaml_locations import (
    ConfigError,
    Located,
    Location,
    error_at,
    location_at,
    mapping_at,
    merged,
    read_yaml,
)
from policies.learn.config.ignored_keys import put_right
from policies.learn.config.old_form import behavior_from_flat, flat_names, is_flat, parameters_from_old
from policies.learn.config.run import RunConfig

_TOP_KEYS = (*(set(RunConfig.model_fields) - {"behavior", "behavior_name"}), "behaviors", "default_settings")
_MIDDLE_KEYS = ("curriculum", "parameter_randomization")


@dataclass(frozen=True, slots=True)
class Loaded:
    """A configuration, and what its reader should be told."""

    config: RunConfig
    warnings: tuple[str, ...] = ()
    root: Located = field(default_factory=lambda: Located(Location("")))
    """The file in its new form: where its keys stand."""
    options: Mapping[str, str] = field(default_factory=dict)
    """Keys that a flag has set, and the flag."""

    def error(self, loc: tuple[int | str, ...], sentence: str) -> ConfigError:
        """What is wrong with the value of a key, with the flag, or the file and the line, that it comes from."""
        option = self.options.get(".".join(map(str, loc)))
        if option is not None:
            return ConfigError(f"{option}: {sentence}")
        location, path = location_at(self.root, loc)
        return error_at(location, path, sentence)


def load_config(
    path: Path | str,
    behavior: str | None = None,
    *,
    is_strict: bool = False,
    curriculum_path: Path | str | None = None,
    sampler_path: Path | str | None = None,
) -> Loaded:
    """Reads a training configuration.

    Args:
        path: a YAML file in the new, the middle or the old flat form.
        behavior: the behaviour to train; it may be left out where the file has only one.
        is_strict: whether flat memory keys in `network_settings` are dropped as ML-Agents does; else they make an LSTM.
        curriculum_path: an old curriculum file.
        sampler_path: an old sampler file.

    Raises:
        ConfigError: what ML-Agents would refuse, or what cannot work.
    """
    notes: list[str] = []
    file = read_yaml(path, notes)
    root = _in_new_form(file, behavior, notes)
    for key, old_path in (("parameter_randomization", sampler_path), ("curriculum", curriculum_path)):
        if old_path is not None:
            old = read_yaml(old_path, notes)
            root.put(key, old, old.location)
    _move_old_parameters(root, notes)
    name = next(iter(root["behaviors"]))
    put_right(root, name, notes, is_strict=is_strict)
    return Loaded(_validated(root, name), tuple(notes), root)


def _in_new_form(file: Located, wanted: str | None, notes: list[str]) -> Located:
    """The file with the one chosen behaviour in `behaviors`, defaults merged into it."""
    root, behaviors = Located(file.location), Located(file.location)
    if is_flat(file):
        name = _choose(flat_names(file), wanted, file.location, has_default="default" in file)
        behaviors.put(name, behavior_from_flat(file, name, notes), file.location_of(name))
        root.put("behaviors", behaviors)
        return root
    for key in file:
        if key not in (*_TOP_KEYS, *_MIDDLE_KEYS):
            raise error_at(file.locations[key], key, unknown_key(key, _TOP_KEYS))
        if file[key] is not None:
            root.take(key, file)
    given = mapping_at(root, "behaviors")
    name = _choose(list(given), wanted, root.location_of("behaviors"), has_default="default_settings" in root)
    behaviors.put(name, _with_defaults(root, given, name), given.location_of(name))
    root.put("behaviors", behaviors, root.location_of("behaviors"))
    if "default_settings" in root:
        root.drop("default_settings")
    return root


def _choose(names: list[str], wanted: str | None, location: Location, *, has_default: bool) -> str:
    if wanted is not None and (wanted in names or has_default):
        return wanted
    listed = ", ".join(names)
    if wanted is not None:
        raise error_at(location, "behaviors", f"there is no behaviour {wanted}" + (f", only {listed}" if names else ""))
    if not names:
        raise error_at(location, "behaviors", "there is no behaviour to train")
    if len(names) > 1:
        raise error_at(location, "behaviors", f"there are {len(names)} behaviours, choose one: {listed}")
    return names[0]


def _with_defaults(root: Located, behaviors: Located, name: str) -> Located:
    """One behaviour over `default_settings`, block by block."""
    own = mapping_at(behaviors, name) if name in behaviors else Located(root.location)
    if "default_settings" not in root:
        if "hyperparameters" in own and "trainer_type" not in own:
            raise error_at(own.locations["hyperparameters"], f"behaviors.{name}.trainer_type", "is required")
        return own.copy()
    default = mapping_at(root, "default_settings")
    if "reward_signals" not in default:  # the default of the defaults, which other signals come on top of
        signals = Located(default.location)
        signals.put("extrinsic", Located(default.location))
        default = default.copy()
        default.put("reward_signals", signals)
    return merged(default, own, is_deep=True)


def _move_old_parameters(root: Located, notes: list[str]) -> None:
    """Curricula and samplers of the middle form, or of their own files, into `environment_parameters`."""
    old = [key for key in _MIDDLE_KEYS if key in root]
    if old:
        samplers, curricula = mapping_at(root, "parameter_randomization"), mapping_at(root, "curriculum")
        parameters = parameters_from_old(samplers, curricula, notes)
        root.put("environment_parameters", merged(parameters, mapping_at(root, "environment_parameters")))
    for key in old:
        root.drop(key)


def _validated(root: Located, name: str) -> RunConfig:
    values: dict[str, Any] = {key: value for key, value in root.items() if key != "behaviors"}
    try:
        return RunConfig.model_validate({"behavior_name": name, "behavior": root["behaviors"][name], **values})
    except ValidationError as error:
        raise _first_refusal(error, root, name) from None


def _first_refusal(error: ValidationError, root: Located, name: str) -> ConfigError:
    """The error that stands first in the file."""
    found: list[tuple[int, ConfigError]] = []
    for detail in error.errors():
        if detail["type"] == "default_factory_not_called":  # a default that is as another key, which is wrong itself
            continue
        loc = detail["loc"]
        location, path = location_at(root, ("behaviors", name, *loc[1:]) if loc[:1] == ("behavior",) else loc)
        found.append((location.line, error_at(location, path, sentence(detail, RunConfig))))
    return min(found, key=lambda item: item[0])[1]
