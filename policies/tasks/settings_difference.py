"""Whether what was recorded under one setting of a task can be learnt from under another.

Settings of conditions, such as the weather of a task or the places of its goals, may differ; what is seen, done, paid
or reached may not.
"""

from collections.abc import Mapping
from typing import Any

from policies.tasks.catalogue import UnknownTask, runs_code, settings_class


def settings_difference(task: str, here: Mapping[str, Any], there: Mapping[str, Any]) -> str:
    """The first setting by which they are of two tasks, with both values; empty: there is none.

    Args:
        task: its name.
        here: settings as JSON.
        there: the same; a setting that one of them has not is one that its version did not have.
    """
    return next(
        (
            f"{name} is {_said(there[name])} there and {_said(here[name])} here"
            for name in differing_settings(here, there)
            if name not in _conditions_of(task)
        ),
        "",
    )


def differing_settings(here: Mapping[str, Any], there: Mapping[str, Any]) -> list[str]:
    """The settings that both have, with other values."""
    return [name for name in here if name in there and here[name] != there[name]]


def _conditions_of(task: str) -> frozenset[str]:
    """What of a task's settings are conditions; of one that is not known here, those of all tasks."""
    from policies.tasks.task import TaskSettings  # noqa: PLC0415  (imports Warp)

    if runs_code(task):  # named by a file, whose module is not imported for that
        return TaskSettings.conditions
    try:
        return settings_class(task).conditions
    except UnknownTask:
        return TaskSettings.conditions


def _said(value: Any) -> str:
    return str(value) if value != "" else "as the preset has it"
