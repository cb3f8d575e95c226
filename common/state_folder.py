"""A folder of records that outlive a restart, and a killed process: JSON that people can read.

A record is `NAME.json`, written whole and at rare intervals, and `NAME.journal`, to which each change since then is
appended in one call: what has been noted is there when the process is killed in the next instant, and what a kill cut
off had not been noted. A line belongs to the file whose generation it names, so that it never counts twice.
"""

import errno
import fcntl
import json
import os
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from common.files import write_durably

VERSION = 1
JOURNAL_BYTES_MAX = 4 << 20  # a record with so many changes is written anew


class StateFolder:
    """Reads and writes records.

    Args:
        folder: made if it is missing.

    Raises:
        OSError: it cannot be made or written.
        BlockingIOError: another process has it.
    """

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        self._lock = os.open(folder / "lock", os.O_WRONLY | os.O_CREAT, 0o644)
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)  # ends with the process, however it ends
        except OSError:
            os.close(self._lock)
            raise
        self.problems: list[str] = []  # one sentence for each file that could not be read
        self._generations: dict[str, int] = {}
        self._journals: dict[str, int] = {}  # file descriptors

    def read(self, record: str) -> dict[str, Any]:
        """The record with the changes noted; empty if there is none. What cannot be read is put aside."""
        problems = len(self.problems)
        content = self._read_whole(record)
        path = self._journal_path(record)
        if len(self.problems) > problems and path.exists():
            self._put_aside(path, "it is of no use without the record")
        if path.exists():
            changes, is_damaged = self._read_journal(path, self._generations[record])
            if is_damaged:
                self._put_aside(path, "its changes up to there are used")
            for change in changes:
                content = merged(content, change)
            if changes or is_damaged:
                self.write(record, content)
        return content

    def _read_whole(self, record: str) -> dict[str, Any]:
        self._generations[record] = 0
        path = self._path(record)
        try:
            whole = json.loads(path.read_bytes())
            if whole["version"] != VERSION or whole["record"] != record:
                raise ValueError("another version or record")
            self._generations[record] = int(whole["generation"])
            return dict(whole["content"])
        except FileNotFoundError:
            return {}
        except (ValueError, TypeError, KeyError, OverflowError, RecursionError):
            self._put_aside(path, "the defaults are used")
            return {}

    def _read_journal(self, path: Path, generation: int) -> tuple[list[dict[str, Any]], bool]:
        """The changes that belong to this generation, and whether more than the last line is broken."""
        *lines, _cut_off = path.read_bytes().split(b"\n")
        changes: list[dict[str, Any]] = []
        for line in lines:
            checksum, _, text = line.partition(b" ")
            if checksum != _checksum(text):
                return changes, True
            try:
                number, change = json.loads(text)
                if number == generation:
                    changes.append(dict(change))
            except (ValueError, TypeError, RecursionError):
                return changes, True
        return changes, False

    def note(self, record: str, changes: Mapping[str, Any]) -> None:
        """Adds or replaces keys of the record, and removes those that are None; kept from now on.

        Raises:
            OSError: the disk is full.
        """
        text = json.dumps([self._generation(record), dict(changes)]).encode()
        journal = self._journal(record)
        line = _checksum(text) + b" " + text + b"\n"
        written = os.write(journal, line)
        size = os.fstat(journal).st_size
        if written < len(line):
            os.ftruncate(journal, size - written)  # half a line would spoil the next
            raise OSError(errno.ENOSPC, "the disk is full")
        if size > JOURNAL_BYTES_MAX:
            self.read(record)

    def write(self, record: str, content: Mapping[str, Any]) -> None:
        """Replaces the record as a whole; kept from now on, also if power is lost.

        Raises:
            OSError: the disk is full; the record is as it was.
        """
        generation = self._generation(record) + 1
        whole = {"version": VERSION, "record": record, "generation": generation, "content": dict(content)}
        write_durably(self._path(record), (json.dumps(whole, indent=1) + "\n").encode())
        self._generations[record] = generation
        os.ftruncate(self._journal(record), 0)

    def close(self) -> None:
        """Lets others have the folder."""
        if self._lock >= 0:
            os.close(self._lock)
            self._lock = -1
        for journal in self._journals.values():
            os.close(journal)
        self._journals.clear()

    def _generation(self, record: str) -> int:
        if record not in self._generations:
            self._read_whole(record)
        return self._generations[record]

    def _journal(self, record: str) -> int:
        if record not in self._journals:
            flags = os.O_WRONLY | os.O_CREAT | os.O_APPEND
            self._journals[record] = os.open(self._journal_path(record), flags, 0o644)
        return self._journals[record]

    def _path(self, record: str) -> Path:
        return self.folder / f"{record}.json"

    def _journal_path(self, record: str) -> Path:
        return self.folder / f"{record}.journal"

    def _put_aside(self, path: Path, instead: str) -> None:
        journal = self._journals.pop(path.stem, None) if path.suffix == ".journal" else None
        if journal is not None:
            os.close(journal)
        number = 1
        while (aside := path.with_name(f"{path.name}.bad-{number}")).exists():
            number += 1
        path.rename(aside)
        self.problems.append(f"{path}: cannot be read; {instead}, and it is kept as {aside.name}")


def merged(content: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """The record after its changes; None removes a key."""
    return {key: value for key, value in {**content, **changes}.items() if value is not None}


def _checksum(text: bytes) -> bytes:
    return f"{zlib.crc32(text):08x}".encode()
