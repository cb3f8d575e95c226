"""What must be the same for a checkpoint's networks and arrays to fit into a run.

In: configurations. Out: one sentence with the first difference, before anything is loaded. What is not listed here
(learning rates, lengths, schedules) may be changed when a run is resumed.
"""

from collections.abc import Mapping
from typing import Any

from policies.learn.config.run import RunConfig
from policies.learn.export.policy_path import CheckpointError
from policies.tasks.task import TaskSettings

_OF_PPO = ("shared_critic", "privileged_critic", "normalize_returns")
_OF_SAC = ("buffer_size", "hindsight", "save_replay_buffer")
_OF_DAGGER = ("buffer_size", "save_replay_buffer")
_OF_OFFLINE = ("actions",)
_OF_TRAINERS = {
    "ppo": _OF_PPO,
    "sac": _OF_SAC,
    "dagger": _OF_DAGGER,
    **dict.fromkeys(("bc", "td3_bc", "iql", "awac"), _OF_OFFLINE),
}
_OF_SIGNALS = ("network_settings", "use_actions", "use_vail", "normalize_reward")


def settings_that_must_fit(config: RunConfig, settings: TaskSettings) -> dict[str, Any]:
    """Of a run: key to plain value."""
    behavior = config.behavior
    names = _OF_TRAINERS[behavior.trainer_type]
    hyperparameters = behavior.hyperparameters.model_dump()
    network = behavior.network_settings.model_dump(exclude={"deterministic"})
    if network["mixture"] == 1:  # checkpoints of before there were mixtures do not have it
        del network["mixture"]
    if network["memory"] and network["memory"]["memory_type"] == "lstm":  # nor what a transformer has
        network["memory"] = {key: network["memory"][key] for key in ("sequence_length", "memory_size")}
    signals = {name: signal.model_dump() for name, signal in behavior.reward_signals.in_use.items()}
    return flat(
        {
            "task": config.env_settings.env_path,
            "env_args": settings.model_dump(),
            "environments": config.env_settings.env_count,
            "trainer_type": behavior.trainer_type,
            "network_settings": network,
            "hyperparameters": {name: hyperparameters[name] for name in names},
            "reward_signals": {
                name: {key: signal[key] for key in _OF_SIGNALS if key in signal} for name, signal in signals.items()
            },
            "behavioral_cloning": behavior.behavioral_cloning is not None,
        }
    )


def flat(values: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested mappings as one, the keys joined by dots."""
    result: dict[str, Any] = {}
    for key, value in values.items():
        if isinstance(value, Mapping):
            result |= flat(value, f"{prefix}{key}.")
        else:
            result[f"{prefix}{key}"] = value
    return result


def require_fit(here: Mapping[str, Any], there: Mapping[str, Any], source: str) -> None:
    """Refuses what was made with other settings; `source` is where they come from.

    Raises:
        CheckpointError: with the first difference.
    """
    for key in [*here, *(key for key in there if key not in here)]:
        if key not in there:
            raise CheckpointError(f"{source}: made without {key}, which is {here[key]} here")
        if key not in here:
            raise CheckpointError(f"{source}: made with {key} {there[key]}, which there is none of here")
        if here[key] != there[key]:
            raise CheckpointError(
                f"{source}: made for other settings: {key} is {there[key]} there and {here[key]} here"
            )
