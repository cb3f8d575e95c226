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

COPIED = (".plan", ".waypoints", ".toml", ".py")


def run_folder_of(keep: Path, scenario: Scenario, seed: int) -> Path:
    """Where a run is kept."""
    return keep / f"{scenario.name}-seed{seed}"


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
    """Writes the scenario of one run beside its logs, with the files it names; the command that flies it again."""
    given = scenario.model_copy(update={"seeds": (seed,)}).model_dump(mode="json", by_alias=True, exclude_unset=True)
    _copy_files(given, folder)
    if scenario.world.file is not None:
        given["world"]["file"] = keep_world_file(scenario.world.file, folder)
    path = folder / f"{scenario.name}{SUFFIX}"
    write_whole(path, yaml.safe_dump(given, sort_keys=False, default_flow_style=None, allow_unicode=True).encode())
    return f"honeyguide test {shlex.quote(str(path))}"


def _copy_files(given: Any, folder: Path) -> None:
    """Copies the plans, airframes and Python files that a scenario names into the folder, and names the copies."""
    if isinstance(given, list):
        for each in given:
            _copy_files(each, folder)
    elif isinstance(given, dict):
        for key, value in given.items():
            given[key] = _copied(value, folder) if isinstance(value, str) else value
            _copy_files(value, folder)


def _copied(value: str, folder: Path) -> str:
    """The name of the copy, if this is one of those files, with what follows it of a Python file; else the same."""
    file, colon, function = value.rpartition(":") if ".py:" in value else (value, "", "")
    path = Path(file)
    if path.suffix not in COPIED or not path.is_file():
        return value
    shutil.copyfile(path, folder / path.name)
    return f"{path.name}{colon}{function}"
