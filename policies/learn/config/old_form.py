"""Old configuration files in the new form: the flat form (up to 0.16) and the middle one (0.16 to 0.18).

The flat form is one mapping per behaviour over a `default` one; curricula and samplers were files of their own. The
middle form has `behaviors`, with `curriculum` and `parameter_randomization` beside it.
"""

from typing import Any

from common.config.refusal import shown, unknown_key
from common.config.yaml_locations import Located, Location, error_at, mapping_at, merged, note_at
from policies.learn.config.behavior import HYPERPARAMETERS

MEMORY_KEYS = ("use_recurrent", "sequence_length", "memory_size")
_NETWORK_KEYS = "num_layers hidden_units normalize vis_encode_type".split()
_SAC_INTERVALS = "num_update train_interval".split()
_BLOCK_KEYS = (
    "max_steps time_horizon summary_freq keep_checkpoints init_path threaded "
    "reward_signals behavioral_cloning self_play"
).split()
_REQUIRED_OF_PPO = (
    "batch_size beta buffer_size epsilon hidden_units lambd learning_rate max_steps memory_size normalize num_epoch "
    "num_layers reward_signals sequence_length summary_freq time_horizon use_recurrent"
).split()
_CURRICULUM_KEYS = "measure min_lesson_length signal_smoothing".split()
_KNOWN = {
    *_NETWORK_KEYS,
    *MEMORY_KEYS,
    *_SAC_INTERVALS,
    *_BLOCK_KEYS,
    "trainer",
    *(key for kind in HYPERPARAMETERS.values() for key in kind.model_fields),
}


def is_flat(root: Located) -> bool:
    """Whether a file is in the flat form: no `behaviors`, and a block with a key that only that form has there."""
    blocks = [value for value in root.values() if isinstance(value, Located)]
    return "behaviors" not in root and any((_KNOWN - set(_BLOCK_KEYS)) & set(block) for block in blocks)


def flat_names(root: Located) -> list[str]:
    """The behaviours of a file in the flat form."""
    return [name for name in root if name != "default"]


def behavior_from_flat(root: Located, name: str, notes: list[str]) -> Located:
    """One behaviour in the new form: its block, if it has one, over the default one.

    Args:
        root: the file.
        name: the behaviour.
        notes: warnings are appended.

    Raises:
        ConfigError: the block refers to one that does not exist, or lacks what its trainer needs.
    """
    default = _block(root, "default") if "default" in root else Located(root.location)
    own = _block(root, name) if name in root else default
    flat = merged(default, own)
    flat.location = root.location_of(name if name in root else "default")
    return _in_new_form(name, flat, notes)


def _block(root: Located, name: str) -> Located:
    """The mapping of a name, which may be text that names another block."""
    value, seen = root[name], [name]
    while isinstance(value, str):
        if value not in root or value in seen:
            raise error_at(root.location_of(name), name, f"refers to {shown(value)}, which is no block of its own")
        seen.append(value)
        value = root[value]
    if not isinstance(value, Located):
        raise error_at(
            root.location_of(name), name, f"must be a mapping or the name of another block, not {shown(value)}"
        )
    return value


def _in_new_form(name: str, flat: Located, notes: list[str]) -> Located:
    if "trainer" not in flat:
        raise error_at(flat.location, f"{name}.trainer", "is required")
    trainer = str(flat["trainer"])
    for key in _REQUIRED_OF_PPO if trainer == "ppo" else ():
        if key not in flat:
            raise error_at(flat.location, f"{name}.{key}", "is required in this old form of the file")
    behavior, network, hyperparameters = Located(flat.location), Located(flat.location), Located(flat.location)
    behavior.put("trainer_type", flat["trainer"], flat.locations["trainer"])
    behavior.put("hyperparameters", hyperparameters)
    behavior.put("network_settings", network)
    own = HYPERPARAMETERS[trainer].model_fields if trainer in HYPERPARAMETERS else {}
    for key in flat:
        if key in own:
            hyperparameters.take(key, flat)
        elif key in _NETWORK_KEYS:
            network.take(key, flat)
        elif key in _BLOCK_KEYS:
            behavior.take(key, flat)
        elif key not in _KNOWN:
            sentence = f"{unknown_key(key, _KNOWN)} (dropped, as ML-Agents does in silence)"
            notes.append(note_at(flat.locations[key], f"{name}.{key}", sentence))
    if wants_memory(flat, name):
        memory = Located(flat.location)
        for key in ("sequence_length", "memory_size"):
            if key in flat:
                memory.take(key, flat)
        network.put("memory", memory, flat.locations["use_recurrent"])
    if trainer == "sac" and "steps_per_update" not in hyperparameters and set(_SAC_INTERVALS) & set(flat):
        hyperparameters.put("steps_per_update", _steps_per_update(name, flat), _interval_location(flat))
    return behavior


def wants_memory(block: Located, path: str) -> bool:
    """Whether `use_recurrent` is there, and true.

    Raises:
        ConfigError: it is neither true nor false.
    """
    value = block.get("use_recurrent", False)
    if not isinstance(value, bool):
        location = block.locations["use_recurrent"]
        raise error_at(location, f"{path}.use_recurrent", f"must be true or false, not {shown(value)}")
    return value


def _interval_location(flat: Located) -> Location:
    return flat.location_of("num_update" if "num_update" in flat else "train_interval")


def _steps_per_update(name: str, flat: Located) -> float:
    """Steps between updates over updates at a time."""
    try:
        return float(flat.get("train_interval", 1)) / float(flat.get("num_update", 1))
    except (TypeError, ValueError, ZeroDivisionError):
        location = _interval_location(flat)
        raise error_at(
            location, f"{name}.num_update", "num_update and train_interval must be numbers above 0"
        ) from None


def parameters_from_old(samplers: Located, curricula: Located, notes: list[str]) -> Located:
    """`environment_parameters` from `parameter_randomization` and `curriculum`, or from the files they once were.

    Raises:
        ConfigError: a sampler or a curriculum that is none.
    """
    parameters = Located(samplers.location if samplers else curricula.location)
    for name in samplers:
        if name != "resampling-interval":  # every episode draws anew
            parameters.put(name, _sampler_from_old(mapping_at(samplers, name)), samplers.locations[name])
    for behavior in curricula:
        _add_curricula(parameters, behavior, curricula, notes)
    return parameters


def _sampler_from_old(old: Located) -> Located:
    sampler, drawn = Located(old.location), Located(old.location)
    for key in old:
        if key in {"sampler-type", "sampler_type"}:
            kind = "multirangeuniform" if old[key] == "multirange_uniform" else old[key]
            sampler.put("sampler_type", kind, old.locations[key])
        elif key == "sampler_parameters":
            sampler.take(key, old)
        else:
            drawn.take(key, old)
    if "sampler_parameters" not in sampler:
        sampler.put("sampler_parameters", drawn)
    return sampler


def _add_curricula(parameters: Located, behavior: str, curricula: Located, notes: list[str]) -> None:
    """One old curriculum sets several parameters by one row of thresholds: each becomes a curriculum of its own."""
    old = mapping_at(curricula, behavior)
    for key in ("measure", "thresholds", "parameters"):
        if key not in old:
            raise error_at(curricula.locations[behavior], f"curriculum.{behavior}.{key}", "is required")
    unknown = [key for key in old if key not in {*_CURRICULUM_KEYS, "thresholds", "parameters"}]
    dropped = "unknown key (dropped, as ML-Agents does)"
    notes.extend(note_at(old.locations[key], f"curriculum.{behavior}.{key}", dropped) for key in unknown)
    thresholds = old["thresholds"] if isinstance(old["thresholds"], list) else [old["thresholds"]]
    values = mapping_at(old, "parameters")
    for name in values:
        location = values.locations[name]
        if name in parameters:
            notes.append(note_at(location, f"curriculum.{behavior}.{name}", "has a sampler too, which counts"))
            continue
        lessons = values[name]
        if not isinstance(lessons, list) or len(lessons) != len(thresholds) + 1:
            wanted = f"must be a list of {len(thresholds) + 1} values, one more than there are thresholds"
            raise error_at(location, f"curriculum.{behavior}.parameters.{name}", wanted)
        curriculum = Located(location)
        curriculum.put(
            "curriculum", [_lesson(behavior, old, thresholds, k, v, location) for k, v in enumerate(lessons)]
        )
        parameters.put(name, curriculum, location)


def _lesson(behavior: str, old: Located, thresholds: list[Any], k: int, value: Any, location: Location) -> Located:
    lesson = Located(location)
    lesson.put("name", f"Lesson{k}")
    lesson.put("value", value)
    if k < len(thresholds):
        criteria = Located(old.location)
        criteria.put("behavior", behavior)
        criteria.put("threshold", thresholds[k], old.locations["thresholds"])
        criteria.put("min_lesson_length", 1)  # the old defaults of these two
        criteria.put("signal_smoothing", False)
        for key in _CURRICULUM_KEYS:
            if key in old:
                criteria.take(key, old)
        lesson.put("completion_criteria", criteria, old.locations["thresholds"])
    return lesson
