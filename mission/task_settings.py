"""A task as a command is given it: a name of the catalogue, and KEY=VALUE pairs."""

from collections.abc import Mapping, Sequence
from typing import Any

from policies.tasks.catalogue import UnknownTask, build_task, task_settings
from policies.tasks.task import Task, TaskSettings


def settings_of(task: str, pairs: Sequence[str], others: Mapping[str, Any] | None = None) -> TaskSettings:
    """The settings of a task from the pairs of `--env-args`, and from `others` where they say nothing.

    Raises:
        UnknownTask: no such task or setting, a value it cannot have, or no pair.
    """
    values = dict(others or {})
    for pair in pairs:
        key, equals, value = pair.partition("=")
        if not equals or not key:
            raise UnknownTask(f"--env-args {pair}: must be KEY=VALUE")
        values[key] = value
    return task_settings(task, values)


def task_of(name: str, pairs: Sequence[str], env_count: int) -> tuple[Task, TaskSettings]:
    """Environments of a task, not yet reset, and its settings.

    Raises:
        UnknownTask: as `settings_of`.
    """
    settings = settings_of(name, pairs)
    return build_task(name, env_count, settings), settings
