"""What a path holds that can be reviewed: a log, the run that wrote it, or a folder of runs."""

import shlex
from dataclasses import dataclass
from pathlib import Path

from mission.review.logged_flight import ReviewError

SUFFIX = ".ulg"
DEPTH_MAX, FLIGHTS_MAX = 6, 1000
CAMPAIGN_FILE, SCENARIO_SUFFIX = "campaign.json", ".scenario.yaml"


@dataclass(frozen=True, slots=True)
class FoundLog:
    """One flight."""

    parts: tuple[Path, ...]  # of its log, in their order
    name: str
    folder: Path | None  # of its run; None: a log by itself


def found_logs(path: Path) -> list[FoundLog]:
    """The flights of a log, of a run's folder, or of a folder of runs.

    Raises:
        ReviewError: there is none.
    """
    if path.is_dir():
        found = _in_folder(path, path.resolve().name, 0)
        if not found:
            raise ReviewError(f"{path}: holds no log: {_why_none(path)}")
        return found[:FLIGHTS_MAX]
    if not path.exists():
        raise ReviewError(f"{path}: there is no such log or folder")
    run = path.parent if path.name == "flight.ulg" else None
    return [FoundLog((path,), path.stem if run is None else run.resolve().name, run)]


def _why_none(folder: Path) -> str:
    if (folder / CAMPAIGN_FILE).is_file():
        return "the campaign has kept none of its worst runs; the same honeyguide campaign command flies them for it"
    scenario = next(iter(sorted(folder.glob(f"*{SCENARIO_SUFFIX}"))), None)
    if scenario is not None:
        return (
            f"it is a run's scenario; honeyguide test {shlex.quote(str(scenario))} --keep FOLDER keeps one that fails"
        )
    return f"there is no {SUFFIX} file in it"


def _in_folder(folder: Path, name: str, depth: int) -> list[FoundLog]:
    """The run that this folder is, whatever else lies in it; or else each log in it and below."""
    try:
        entries = sorted(folder.iterdir())
    except OSError as error:
        raise ReviewError(f"{folder}: cannot be read: {error.strerror or error}") from error
    logs = [entry for entry in entries if entry.suffix == SUFFIX and entry.is_file()]
    parts = sorted((log for log in logs if _part_number(log)), key=_part_number)
    if parts:
        return [FoundLog(tuple(parts), name, folder)]
    prefix = f"{name}/" if depth else ""
    found = [FoundLog((log,), f"{prefix}{log.stem}", None) for log in logs]
    if depth < DEPTH_MAX:
        for entry in entries:
            if entry.is_dir() and not entry.is_symlink():
                found += _in_folder(entry, f"{prefix}{entry.name}", depth + 1)
    return found


def _part_number(path: Path) -> int:
    """Which part of a run's log a file is, from 1; 0: it is another log."""
    if path.name == "flight.ulg":
        return 1
    number = path.stem.removeprefix("flight-")
    return int(number) if number.isdecimal() else 0
