"""What may be said on the command line of a training run. It beats the file; `--resume` beats `--initialize-from`.

`CommandLine` has one field per flag of ML-Agents, of its old releases too; a flag that was not given is None or False.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from common.config.refusal import sentence
from common.config.yaml_locations import ConfigError
from policies.learn.config.environment import Curriculum, EnvironmentParameter
from policies.learn.config.load import Loaded
from policies.learn.config.run import RunConfig

_Block = TypeVar("_Block", bound=BaseModel)


def _flag(default: Any, key: str, meaning: str, *, is_old: bool = False) -> Any:
    """A flag; `key` is the one of the configuration that it sets, if it sets one."""
    return field(default=default, metadata={"key": key, "meaning": meaning, "is_old": is_old})


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandLine:
    """The flags that were given."""

    env: str | None = _flag(None, "env_settings.env_path", "The task by name.")
    env_args: tuple[str, ...] | None = _flag(None, "env_settings.env_args", "Settings of the task, name=value each.")
    run_id: str | None = _flag(None, "checkpoint_settings.run_id", "Name of the run and of its folder.")
    resume: bool = _flag(False, "checkpoint_settings.resume", "Go on with the run of this name where it stopped.")
    force: bool = _flag(False, "checkpoint_settings.force", "Overwrite an existing run of this name.")
    initialize_from: str | None = _flag(
        None, "checkpoint_settings.initialize_from", "Start from the networks of the run of that name."
    )
    inference: bool = _flag(False, "checkpoint_settings.inference", "Act only; learn nothing.")
    deterministic: bool = _flag(
        False, "behavior.network_settings.deterministic", "Take the most probable actions instead of drawing them."
    )
    seed: int | None = _flag(None, "env_settings.seed", "Seed of every random draw.")
    num_envs: int | None = _flag(None, "env_settings.num_envs", "Copies of the num-areas environments.")
    num_areas: int | None = _flag(None, "env_settings.num_areas", "Environments side by side.")
    results_dir: str | None = _flag(None, "checkpoint_settings.results_dir", "Folder of all runs.")
    torch_device: str | None = _flag(None, "torch_settings.device", "Where networks are computed: cpu, cuda, cuda:0.")
    processes: int | None = _flag(
        None, "torch_settings.processes", "Processes that train together; of offline algorithms. Not of ML-Agents."
    )
    debug: bool = _flag(False, "debug", "Log more.")
    base_port: int | None = _flag(None, "env_settings.base_port", "Accepted.")
    timeout_wait: int | None = _flag(None, "env_settings.timeout_wait", "Accepted.")
    max_lifetime_restarts: int | None = _flag(None, "env_settings.max_lifetime_restarts", "Accepted.")
    restarts_rate_limit_n: int | None = _flag(None, "env_settings.restarts_rate_limit_n", "Accepted.")
    restarts_rate_limit_period_s: int | None = _flag(None, "env_settings.restarts_rate_limit_period_s", "Accepted.")
    width: int | None = _flag(None, "engine_settings.width", "Accepted.")
    height: int | None = _flag(None, "engine_settings.height", "Accepted.")
    quality_level: int | None = _flag(None, "engine_settings.quality_level", "Accepted.")
    time_scale: float | None = _flag(None, "engine_settings.time_scale", "Accepted.")
    target_frame_rate: int | None = _flag(None, "engine_settings.target_frame_rate", "Accepted.")
    capture_frame_rate: int | None = _flag(None, "engine_settings.capture_frame_rate", "Accepted.")
    no_graphics: bool = _flag(False, "engine_settings.no_graphics", "Accepted; nothing is ever drawn.")
    no_graphics_monitor: bool = _flag(False, "engine_settings.no_graphics_monitor", "Accepted; nothing is ever drawn.")
    load: bool = _flag(False, "checkpoint_settings.resume", "As resume.", is_old=True)
    train: bool = _flag(False, "checkpoint_settings.train_model", "Accepted; training is the default.", is_old=True)
    torch: bool = _flag(False, "", "Accepted with a warning.", is_old=True)
    tensorflow: bool = _flag(False, "", "Accepted with a warning.", is_old=True)
    cpu: bool = _flag(False, "", "As torch-device cpu.", is_old=True)
    keep_checkpoints: int | None = _flag(
        None, "behavior.keep_checkpoints", "How many of the newest checkpoints stay.", is_old=True
    )
    save_freq: int | None = _flag(None, "behavior.checkpoint_interval", "Steps between checkpoints.", is_old=True)
    curriculum: str | None = _flag(None, "", "An old curriculum file.", is_old=True)
    sampler: str | None = _flag(None, "", "An old sampler file.", is_old=True)
    lesson: int | None = _flag(None, "", "The lesson that curricula begin with, from 0.", is_old=True)


@dataclass(frozen=True, slots=True)
class Flag:
    """One flag, for help texts and tables."""

    option: str  # --run-id
    key: str  # checkpoint_settings.run_id, or empty
    meaning: str
    is_old: bool


def flags() -> tuple[Flag, ...]:
    """Every flag that is understood."""
    return tuple(Flag(_option(entry.name), **entry.metadata) for entry in fields(CommandLine))


def _option(name: str) -> str:
    return "--" + name.replace("_", "-")


def with_command_line(loaded: Loaded, given: CommandLine) -> Loaded:
    """The configuration as the command line has it; `curriculum` and `sampler` are for `load_config`.

    Raises:
        ConfigError: a flag's value that its key cannot have.
    """
    config, warnings, options = loaded.config, list(loaded.warnings), dict(loaded.options)
    for entry in fields(given):
        value = getattr(given, entry.name)
        if value is not None and value is not False and entry.metadata["key"]:
            options[entry.metadata["key"]] = _option(entry.name)
            config = _with(config, entry.metadata["key"], value, _option(entry.name))
    if given.cpu and given.torch_device is None:
        config = _with(config, "torch_settings.device", "cpu", "--cpu")
    if given.lesson is not None:
        config = _from_lesson(config, given.lesson)
    removed = [name for name in ("torch", "tensorflow") if getattr(given, name)]
    warnings += [f"--{name}: removed from ML-Agents, has no effect" for name in removed]
    checkpoints = config.checkpoint_settings
    if checkpoints.load_model:
        config = _with(config, "checkpoint_settings.resume", True, "--load")
    if config.checkpoint_settings.resume and checkpoints.initialize_from is not None:
        warnings.append(f"--initialize-from: {checkpoints.initialize_from} is left alone, because the run is resumed")
        config = _with(config, "checkpoint_settings.initialize_from", None, "--initialize-from")
    return replace(loaded, config=config, warnings=tuple(warnings), options=options)


def _with(config: RunConfig, path: str, value: Any, option: str) -> RunConfig:
    """The configuration with one key changed."""
    try:
        return _changed(config, path.split("."), value)
    except ValidationError as error:
        raise ConfigError(f"{option}: {sentence(error.errors()[0], RunConfig)}") from None


def _changed(block: _Block, path: list[str], value: Any) -> _Block:
    below = getattr(block, path[0])
    new = _changed(below, path[1:], value) if len(path) > 1 else value
    return type(block).model_validate({**dict(block), path[0]: new})


def _from_lesson(config: RunConfig, lesson: int) -> RunConfig:
    if lesson < 0:
        raise ConfigError(f"--lesson: must be at least 0, not {lesson}")
    left: Mapping[str, EnvironmentParameter] = {
        name: Curriculum(curriculum=parameter.curriculum[min(lesson, len(parameter.curriculum) - 1) :])
        if isinstance(parameter, Curriculum)
        else parameter
        for name, parameter in config.environment_parameters.items()
    }
    return _with(config, "environment_parameters", left, "--lesson")
