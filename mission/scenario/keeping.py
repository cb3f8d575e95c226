"""Failing runs kept: logs, result, and the scenario with its seed, which flies precisely that run again."""

import shlex
import shutil
from pathlib import Path
from typing import Any

import yaml

from common.files import write_whole
from mission.console.option_checks import UserError
from mission.scenario.runner import RESULT_FILE
from mission.scenario.scenario import Scenario
from mission.scenario.scenario_file import SUFFIX
from mission.world.world_copies import keep_world_file


def run_folder_of(keep: Path, scenario: Scenario, seed: int) -> Path:
    """Where a run is kept, empty.

    Raises:
        UserError: something else is there.
    """
    return emptied(keep / f"{scenario.name}-seed{seed}")


def emptied(folder: Path) -> Path:
    """The folder, without what an earlier run has left there.

    Raises:
        UserError: something else is there.
    """
    if folder.exists():
        if not (folder / RESULT_FILE).is_file():
            raise UserError(f"{folder}: is there already, and is no kept run")
        shutil.rmtree(folder)
    return folder


def keep_scenario(folder: Path, scenario: Scenario, seed: int) -> str:
    """Writes the scenario of one run beside its logs, with its plans and its world; the command that flies it again."""
    given = scenario.model_copy(update={"seeds": (seed,)}).model_dump(mode="json", by_alias=True, exclude_unset=True)
    _copy_plans(given, folder)
    if scenario.world.file is not None:
        given["world"]["file"] = keep_world_file(scenario.world.file, folder)
    path = folder / f"{scenario.name}{SUFFIX}"
    write_whole(path, yaml.safe_dump(given, sort_keys=False, default_flow_style=None, allow_unicode=True).encode())
    return f"honeyguide test {shlex.quote(str(path))}"


def _copy_plans(given: Any, folder: Path) -> None:
    """Copies the plans that a scenario names into the folder, and names the copies."""
    if isinstance(given, list):
        for each in given:
            _copy_plans(each, folder)
    elif isinstance(given, dict):
        for key, value in given.items():
            is_plan = isinstance(value, str) and Path(value).suffix in (".plan", ".waypoints") and Path(value).is_file()
            if is_plan:
                shutil.copyfile(value, folder / Path(value).name)
                given[key] = Path(value).name
            else:
                _copy_plans(value, folder)
