"""What a command is given by name (files, runs, tasks, recipes, policies), refused before anything heavy is loaded."""

from pathlib import Path

from mission.console.command_refusal import refuse

LOG_FILE = "flight.ulg"  # in a run folder; what is shown of it afterwards


def check_file(path: Path) -> None:
    """Refuses a file that cannot be opened."""
    try:
        path.open("rb").close()
    except OSError as error:
        refuse(f"{path}: {error.strerror}")


def check_run(folder: Path) -> None:
    """Refuses a folder that holds no run to be shown."""
    if not any(folder.glob("flight*.ulg")) and not vehicle_folders(folder):
        refuse(f"{folder}: holds no run that can be shown: {LOG_FILE} is missing")


def vehicle_folders(folder: Path) -> list[Path]:
    """Those of the vehicles of a run that had several, in their order."""
    found = [path.parent for path in folder.glob("vehicle-*/flight.ulg") if path.parent.name[8:].isdecimal()]
    return sorted(found, key=lambda path: int(path.name[8:]))


def check_task(name: str) -> None:
    """Refuses a task that is none."""
    from policies.tasks.catalogue import UnknownTask, check_name

    try:
        check_name(name)
    except UnknownTask as error:
        refuse(str(error))


def check_recipe(name: str) -> None:
    """Refuses what is neither a configuration file nor a recipe."""
    from common.config.yaml_locations import ConfigError
    from policies.learn.config.recipes import recipe
    from policies.tasks.catalogue import is_task_name

    try:
        if not (name.endswith((".yaml", ".yml")) or Path(name).is_file() or is_task_name(name)):
            recipe(name)
    except ConfigError as error:
        refuse(str(error))


def check_policy(name: str) -> None:
    """Refuses a policy that is not there."""
    from policies.learn.export.policy_path import CheckpointError, find_policy

    try:
        find_policy(name)
    except CheckpointError as error:
        refuse(str(error))


def check_task_or_policy(name: str) -> None:
    """Refuses what is neither."""
    from policies.learn.export.policy_path import CheckpointError, find_policy
    from policies.tasks.catalogue import is_task_name, task_names

    try:
        if not is_task_name(name):
            find_policy(name)
    except CheckpointError as error:
        refuse(f"{error}; the tasks are {', '.join(task_names())}")
