"""A task as a command is given it: a name of the catalogue, and KEY=VALUE pairs."""

from collections.abc import Sequence

from policies.tasks.catalogue import build_task, settings_of
from policies.tasks.task import Task, TaskSettings


def task_of(name: str, pairs: Sequence[str], env_count: int) -> tuple[Task, TaskSettings]:
    """Environments of a task, not yet reset, and its settings.

    Raises:
        UnknownTask: as `settings_of`.
    """
    settings = settings_of(name, pairs)
    return build_task(name, env_count, settings), settings
