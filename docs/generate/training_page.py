"""The text of docs/reference/training-config.md, made from the models that read the configuration."""

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

from policies.learn.config import behavior, environment, network, offline, run, signals
from policies.learn.config.command_line import flags

HEADER = """\
# Training configuration

Written by `python -m docs.generate` from the code: do not edit.

A run is configured by a YAML file in the form of Unity ML-Agents, whose keys and defaults are these. Keys marked with a
star are ours, and unknown to ML-Agents; their defaults keep its behaviour, `normalize_reward` excepted.

    behaviors:
      Parking1:
        trainer_type: ppo
        hyperparameters: {batch_size: 256, learning_rate: 3e-4}
        reward_signals: {extrinsic: {gamma: 0.99}}
        success_target: 0.95
    env_settings: {env_path: Parking1, env_args: [preset=improved], num_areas: 1024}

All three forms that ML-Agents has had are read: this one, the one with `curriculum` and `parameter_randomization` at
the top (0.16 to 0.18), and the flat one with a `default` block (up to 0.16), with its curriculum and sampler files. Of
several behaviours, one is chosen by its name. Numbers may be written `1e-5` or `2e6`.

- An unknown key, a value of another kind and a number that cannot work are refused: `FILE:LINE: key: …`, exit code 2.
- What ML-Agents drops in silence is warned about with file, line and key: unknown keys in `network_settings`, `memory`,
  `behavioral_cloning`, `completion_criteria` and `torch_settings`, and keys of the flat form that nobody knows. So are
  deprecated keys (`framework`, `encoding_size`) and keys that stand there twice.
- `use_recurrent`, `sequence_length` and `memory_size` lying flat in `network_settings` have no effect on ML-Agents: the
  network has no memory. Here they make the LSTM that they ask for, with a warning. A strict reading drops them.

"""
PARAMETERS = """\
## environment_parameters

Each names a number of the task, and gives it a value, something it is drawn from at every episode's start, or lessons:

    environment_parameters:
      mass: 8
      friction:
        sampler_type: uniform
        sampler_parameters: {min_value: 0.5, max_value: 1.0}
      distance:
        curriculum:
        - {name: near, value: 3, completion_criteria: {behavior: Parking1, measure: reward, threshold: 4}}
        - {name: far, value: 12}

| sampler_type | sampler_parameters |
|---|---|
"""
BLOCKS: Mapping[str, type[BaseModel]] = {
    "behaviors: NAME": behavior.Behavior,
    "hyperparameters of ppo": behavior.PpoHyperparameters,
    "hyperparameters of sac": behavior.SacHyperparameters,
    "hyperparameters of dagger": behavior.DaggerHyperparameters,
    "hyperparameters of dagger: augmentation": behavior.Augmentation,
    "hyperparameters of bc": offline.BcHyperparameters,
    "hyperparameters of td3_bc": offline.Td3BcHyperparameters,
    "hyperparameters of iql": offline.IqlHyperparameters,
    "hyperparameters of awac": offline.AwacHyperparameters,
    "offline": offline.OfflineSettings,
    "network_settings": network.NetworkSettings,
    "network_settings: memory": network.Memory,
    "reward_signals: extrinsic": signals.ExtrinsicSettings,
    "reward_signals: gail": signals.GailSettings,
    "reward_signals: curiosity": signals.CuriositySettings,
    "reward_signals: rnd": signals.RndSettings,
    "behavioral_cloning": behavior.BehavioralCloning,
    "env_settings": environment.EnvSettings,
    "checkpoint_settings": run.CheckpointSettings,
    "torch_settings": run.TorchSettings,
    "engine_settings": environment.EngineSettings,
}
LESSONS: Mapping[str, type[BaseModel]] = {
    "curriculum: lesson": environment.Lesson,
    "curriculum: completion_criteria": environment.CompletionCriteria,
}
SAMPLERS: Mapping[str, type[BaseModel]] = {
    "uniform": environment.UniformParameters,
    "gaussian": environment.GaussianParameters,
    "multirangeuniform": environment.MultiRangeUniformParameters,
    "constant": environment.ConstantParameters,
}


def training_text() -> str:
    """The whole page."""
    parts = [HEADER, *(_section(title, block) for title, block in BLOCKS.items())]
    parts += [PARAMETERS + "".join(_sampler_row(kind, block) for kind, block in SAMPLERS.items()) + "\n"]
    parts += [_section(title, block) for title, block in LESSONS.items()]
    return "".join([*parts, _flag_table()])


def _section(title: str, block: type[BaseModel]) -> str:
    rows = [f"## {title}\n", "| key | default | values | meaning |", "|---|---|---|---|"]
    required = block.model_json_schema().get("required", [])
    for key, schema in block.model_json_schema()["properties"].items():
        star = " *" if schema.get("is_own") else ""
        default = "required" if key in required else _default(schema)
        meaning = " ".join(schema.get("description", "").split())
        rows.append(f"| {key}{star} | {default} | {_values(schema)} | {meaning} |")
    return "\n".join(rows) + "\n\n"


def _sampler_row(kind: str, block: type[BaseModel]) -> str:
    defaults = {key: schema["default"] for key, schema in block.model_json_schema()["properties"].items()}
    return f"| {kind} | {', '.join(f'{key} {_shown(value)}' for key, value in defaults.items())} |\n"


def _default(schema: Mapping[str, Any]) -> str:
    if "as" in schema:
        return f"as {schema['as']}"
    default = schema.get("default")
    return "" if isinstance(default, dict) or "default" not in schema else _shown(default)


def _shown(value: Any) -> str:
    if value is None or value == []:
        return "none"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def _values(schema: Mapping[str, Any]) -> str:
    """What a key may have, in few words."""
    kinds = [kind for kind in schema.get("anyOf", [schema]) if kind.get("type") != "null"]
    if len(kinds) != 1 or "$ref" in kinds[0]:
        return "block" if kinds and all("$ref" in kind for kind in kinds) else ("number, sampler" if kinds else "none")
    kind = kinds[0]
    if "enum" in kind:
        return ", ".join(kind["enum"])
    words = {"integer": "whole", "number": "", "boolean": "true, false", "string": "text", "array": "list"}[
        kind["type"]
    ]
    bounds = [f"{sign} {kind[name]:g}" for name, sign in _SIGNS.items() if name in kind]
    return " ".join([word for word in (words, ", ".join(bounds)) if word]) or "number"


_SIGNS = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}


def _flag_table() -> str:
    rows = [
        "## Command line\n",
        "The command line beats the file; `--resume` beats `--initialize-from`. Old flags are those that ML-Agents has",
        "deprecated or dropped.\n",
        "| flag | key | meaning |",
        "|---|---|---|",
    ]
    for flag in flags():
        key = flag.key.replace("behavior.", "behaviors: NAME: ", 1)
        rows.append(f"| {flag.option} | {key} | {'Old. ' if flag.is_old else ''}{flag.meaning} |")
    return "\n".join(rows) + "\n"
