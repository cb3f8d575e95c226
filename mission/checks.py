"""Names of tasks, recipes and policies that a command is given, refused before torch or a task's kernels are loaded."""

from pathlib import Path

from mission.refusal import refuse


def check_task(name: str) -> None:
    """Refuses a task that is none."""
    from policies.tasks.catalogue import UnknownTask, check_name

    try:
        check_name(name)
    except UnknownTask as error:
        refuse(str(error))


def check_recipe(name: str) -> None:
    """Refuses what is neither a configuration file nor a recipe."""
    from policies.learn.config.places import ConfigError
    from policies.learn.config.recipes import recipe

    try:
        if not (name.endswith((".yaml", ".yml")) or Path(name).is_file()):
            recipe(name)
    except ConfigError as error:
        refuse(str(error))


def check_policy(name: str) -> None:
    """Refuses a policy that is not there."""
    from policies.learn.policy_path import CheckpointError, find_policy

    try:
        find_policy(name)
    except CheckpointError as error:
        refuse(str(error))


def check_task_or_policy(name: str) -> None:
    """Refuses what is neither."""
    from policies.learn.policy_path import CheckpointError, find_policy
    from policies.tasks.catalogue import CATALOGUE

    try:
        if name not in CATALOGUE:
            find_policy(name)
    except CheckpointError as error:
        refuse(f"{error}; the tasks are {', '.join(CATALOGUE)}")
