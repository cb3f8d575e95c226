"""Failing runs kept: logs, result, and the scenario with its seed, which flies precisely that run again."""

import shlex
import shutil
from collections import Counter
from collections.abc import Iterable, Sequence
from hashlib import sha256
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


def run_names(files: Sequence[tuple[Path, str]]) -> list[str]:
    """What the runs of scenarios are kept as: the scenario's name, behind as much of the path as sets equal ones apart.

    Args:
        files: each another, with the name of its scenario.
    """
    names = [name for _, name in files]
    where = [(*path.resolve().parts[1:-1], path.name.removesuffix(SUFFIX)) for path, _ in files]
    where = [parts[:-1] if parts[-1] == name else parts for parts, name in zip(where, names, strict=True)]
    found = names
    for depth in range(1, 1 + max(map(len, where), default=0)):
        counts = Counter(found)
        if len(counts) == len(found):
            break
        found = [
            "-".join((*parts[-depth:], name)) if counts[chosen] > 1 else chosen
            for chosen, parts, name in zip(found, where, names, strict=True)
        ]
    return found


def run_folder(keep: Path, name: str, seed: int) -> Path:
    """Where a run is kept."""
    return keep / f"{name}-seed{seed}"


def check_apart(folders: Iterable[Path], files: Iterable[Path]) -> None:
    """Refuses to keep runs where a scenario is read from: what lies there would be taken away.

    Raises:
        UserError: a file is in one of the folders.
    """
    taken = {folder.resolve(): folder for folder in folders}
    for file in files:
        for parent in file.resolve().parents:
            if parent in taken:
                raise UserError(f"{file}: the run would be kept in {taken[parent]}, where it is: keep it elsewhere")


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


def is_under_way(folder: Path) -> bool:
    """Whether a run has begun there that is not kept yet: its scenario comes last."""
    return (folder / RESULT_FILE).is_file() and not any(folder.glob(f"*{SUFFIX}"))


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
    copy = folder / path.name
    if copy.is_file() and copy.read_bytes() != path.read_bytes():  # another vehicle's, from another folder
        copy = folder / f"{path.stem}_{sha256(path.read_bytes()).hexdigest()[:8]}{path.suffix}"
    shutil.copyfile(path, copy)
    return f"{copy.name}{colon}{function}"
