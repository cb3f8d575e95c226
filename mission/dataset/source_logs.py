"""Which logs a dataset is built from: found in folders, each of them once, and those told that are not whole."""

import hashlib
from collections.abc import Sequence
from pathlib import Path

from mission.log.ulog_file import is_whole
from policies.datasets.episodes import DatasetError

DAMAGED = "is damaged or cut off: only what can be read of it counts"


def logs_at(path: Path) -> list[Path]:
    """The logs that a path means: itself, those of a run's folder, or of the runs in a folder, by name.

    Raises:
        DatasetError: there is nothing, or no log.
    """
    if path.is_file():
        return [path]
    if not path.exists():
        raise DatasetError(f"{path}: no such file or folder")
    found = sorted(log for pattern in ("*.ulg", "*.tlog") for log in path.rglob(pattern))
    with_ulog = {log.parent for log in found if log.suffix == ".ulg"}
    logs = [log for log in found if log.suffix == ".ulg" or log.parent not in with_ulog]
    if not logs:
        raise DatasetError(f"{path}: no log there (.ulg or .tlog)")
    return logs


def refuse_twice(logs: Sequence[Path]) -> None:
    """Makes sure that no log is there twice, be it as a copy: its decisions would weigh twice.

    Raises:
        DatasetError: one is, or cannot be read.
    """
    found: dict[str, Path] = {}
    for log in logs:
        try:
            with log.open("rb") as file:
                digest = hashlib.file_digest(file, "sha256").hexdigest()
        except OSError as error:
            raise DatasetError(f"{log}: cannot be read: {error.strerror or error}") from error
        if digest in found:
            raise DatasetError(f"{log}: holds the same as {found[digest]}, which is given too")
        found[digest] = log


def damaged(logs: Sequence[Path]) -> list[Path]:
    """The ULogs that end in the midst of a message, or hold what no logger writes."""
    return [log for log in logs if log.suffix == ".ulg" and not is_whole(log)]
