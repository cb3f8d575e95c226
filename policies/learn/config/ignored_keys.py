"""What ML-Agents drops in silence, or with a line in its log: noted, and put right where its meaning is plain.

It checks the keys of most blocks, but not of those below: a misspelt or misplaced key there has no effect on it. The
usual case: `use_recurrent`, `sequence_length` and `memory_size` lying flat in `network_settings`, where its author
wanted an LSTM and got none.
"""

from collections.abc import Iterable, Iterator
from typing import Any

from pydantic import BaseModel

from common.config.refusal import unknown_key
from common.config.yaml_locations import Located, note_at
from policies.learn.config.behavior import BehavioralCloning
from policies.learn.config.environment import CompletionCriteria
from policies.learn.config.network import Memory, NetworkSettings
from policies.learn.config.old_form import MEMORY_KEYS, wants_memory
from policies.learn.config.run import TorchSettings

_ENCODED = ("gail", "curiosity", "rnd")
_HOW_TO_ASK = ": a memory is asked for by memory: {sequence_length, memory_size}"


def put_right(root: Located, name: str, notes: list[str], *, is_strict: bool) -> None:
    """Makes the meaning of dropped keys plain, in place.

    Args:
        root: a configuration in the new form whose `behaviors` has the one of that name.
        name: the behaviour.
        notes: warnings are appended.
        is_strict: whether flat memory keys are dropped, as ML-Agents does; else they make the LSTM they ask for. SAC
            has none here, so that it drops them always.
    """
    behavior, path = root["behaviors"][name], f"behaviors.{name}"
    if "framework" in behavior:
        notes.append(note_at(behavior.locations["framework"], f"{path}.framework", "deprecated, has no effect"))
        behavior.drop("framework")
    for network, where in _below(behavior, path, "network_settings"):
        _put_memory_right(network, where, notes, is_strict=is_strict or behavior.get("trainer_type") == "sac")
        _drop_unknown(network, where, NetworkSettings, notes)
        for memory, memory_path in _below(network, where, "memory"):
            _drop_unknown(memory, memory_path, Memory, notes)
    for cloning, where in _below(behavior, path, "behavioral_cloning"):
        _drop_unknown(cloning, where, BehavioralCloning, notes)
    for signals, where in _below(behavior, path, "reward_signals"):
        for kind in signals:
            for signal, signal_path in _below(signals, where, kind):
                _put_signal_right(signal, signal_path, kind, notes)
    for device, where in _below(root, "", "torch_settings"):
        _drop_unknown(device, where, TorchSettings, notes)
    _put_curricula_right(root, notes)


def _below(parent: Located, path: str, key: str) -> Iterator[tuple[Located, str]]:
    """The mapping of a key with its path, if there is one."""
    value = parent.get(key)
    if isinstance(value, Located):
        yield value, f"{path}.{key}" if path else key


def _drop_unknown(block: Located, path: str, model: type[BaseModel], notes: list[str]) -> None:
    for key in [key for key in block if key not in model.model_fields]:
        sentence = f"{unknown_key(key, model.model_fields)} (dropped, as ML-Agents does in silence)"
        notes.append(note_at(block.locations[key], f"{path}.{key}", sentence))
        block.drop(key)


def _put_memory_right(network: Located, path: str, notes: list[str], *, is_strict: bool) -> None:
    flat = {key: network[key] for key in MEMORY_KEYS if key in network}
    if not flat:
        return
    location = min((network.locations[key] for key in flat), key=lambda location: location.line)
    is_wanted = wants_memory(network, path) and network.get("memory") is None
    if is_wanted and not is_strict:
        memory = Located(location)
        for key in flat:
            if key != "use_recurrent":
                memory.take(key, network)
        network.put("memory", memory, location)
        effect = "ML-Agents drops these keys in silence and builds no memory; here they make the LSTM that they ask for"
    else:
        effect = "dropped, as ML-Agents does in silence"
        effect += _HOW_TO_ASK if is_wanted and is_strict else ""
    notes.append(note_at(location, f"{path}.{', '.join(flat)}", effect))
    for key in flat:
        network.drop(key)


def _put_signal_right(signal: Located, path: str, kind: str, notes: list[str]) -> None:
    if kind in _ENCODED and "encoding_size" in signal:
        if signal["encoding_size"] is not None:  # empty in the files that ML-Agents itself writes
            _put_encoding_size_right(signal, path, notes)
        signal.drop("encoding_size")
    for network, where in _below(signal, path, "network_settings"):
        _drop_memory(network, where, notes)
        _drop_unknown(network, where, NetworkSettings, notes)


def _drop_memory(network: Located, path: str, notes: list[str]) -> None:
    keys = [key for key in (*MEMORY_KEYS, "memory") if network.get(key) is not None]
    if not keys:
        return
    location = min((network.locations[key] for key in keys), key=lambda location: location.line)
    notes.append(note_at(location, f"{path}.{', '.join(keys)}", "reward signals have no memory: dropped"))
    for key in keys:
        network.drop(key)


def _put_encoding_size_right(signal: Located, path: str, notes: list[str]) -> None:
    location = signal.locations["encoding_size"]
    if "network_settings" in signal:
        effect = "deprecated, has no effect beside network_settings"
    else:
        effect = "deprecated, taken as network_settings: {hidden_units}"
        network = Located(location)
        network.take("hidden_units", signal, "encoding_size")
        signal.put("network_settings", network, location)
    notes.append(note_at(location, f"{path}.encoding_size", effect))


def _put_curricula_right(root: Located, notes: list[str]) -> None:
    for parameters, path in _below(root, "", "environment_parameters"):
        for name in parameters:
            for parameter, where in _below(parameters, path, name):
                lessons = parameter.get("curriculum")
                if isinstance(lessons, list):
                    _put_lessons_right(lessons, f"{where}.curriculum", root["behaviors"], notes)


def _put_lessons_right(lessons: list[Any], path: str, behaviors: Iterable[str], notes: list[str]) -> None:
    known = list(behaviors)
    for k, lesson in enumerate(lessons):
        if not isinstance(lesson, Located):
            continue
        for criteria, where in _below(lesson, f"{path}[{k}]", "completion_criteria"):
            _drop_unknown(criteria, where, CompletionCriteria, notes)
            if k == len(lessons) - 1:
                notes.append(
                    note_at(criteria.location, where, "the last lesson never ends: dropped, as ML-Agents does")
                )
                lesson.drop("completion_criteria")
            elif criteria.get("behavior") not in (None, *known):
                sentence = f"{criteria['behavior']} is not trained in this run: the lesson never ends"
                notes.append(note_at(criteria.location_of("behavior"), f"{where}.behavior", sentence))
