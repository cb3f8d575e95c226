"""A folder that clients may work in by name, and that they cannot get out of.

Names are relative to the folder's root, with `/` between their parts; a leading `/` means the root too. Neither `..`
nor a symbolic link leads outside. What is stored is bounded in bytes and in number.
"""

import errno
import os
from dataclasses import dataclass
from pathlib import Path

QUOTA_BYTES = 64 << 20
ENTRIES_MAX = 2000  # files and folders in all


@dataclass(frozen=True, slots=True)
class FolderEntry:
    """A file or a folder."""

    name: str
    is_folder: bool
    size: int  # 0 for a folder
    time_s: int  # Unix time of the last change


class ConfinedFolder:
    """Files below `root`, which is made when something is put there. Methods raise OSError as the file system does."""

    def __init__(self, root: Path, quota_bytes: int = QUOTA_BYTES) -> None:
        self.root = root.resolve()
        self.quota_bytes = quota_bytes
        self._used_bytes = 0
        self._entries = 0
        self._measure()

    def path(self, name: str) -> Path:
        """Where `name` lies.

        Raises:
            PermissionError: outside the folder.
        """
        parts = [part for part in name.split("/") if part not in ("", ".")]
        path = self.root.joinpath(*parts)
        # the last part too: opening it would follow a link
        if ".." in parts or "\0" in name or not path.resolve().is_relative_to(self.root):
            raise PermissionError(errno.EACCES, "outside the folder", name)
        return path

    def entries(self, name: str) -> list[FolderEntry]:
        """What a folder holds, in the order of the names; without what leads outside."""
        found: list[FolderEntry] = []
        folder = self.path(name)
        if folder == self.root and not folder.exists():
            return found
        for path in sorted(folder.iterdir()):
            if path.resolve().is_relative_to(self.root):
                stat = path.stat()
                is_folder = path.is_dir()
                found.append(FolderEntry(path.name, is_folder, 0 if is_folder else stat.st_size, int(stat.st_mtime)))
        return found

    def size(self, name: str) -> int:
        """Bytes of a file that can be read."""
        path = self.path(name)
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, "a folder", name)
        return path.stat().st_size

    def read(self, name: str, offset: int, count: int) -> bytes:
        """Bytes of a file from `offset` on; fewer at its end."""
        with self.path(name).open("rb") as file:
            file.seek(offset)
            return file.read(count)

    def create(self, name: str) -> None:
        """Makes a file, or empties it."""
        path = self._changeable(name)
        self._measure()
        if not path.exists():
            self._require_entry()
        path.open("wb").close()
        self._measure()

    def write(self, name: str, offset: int, data: bytes) -> None:
        """Writes into a file that exists.

        Raises:
            OSError: ENOSPC, there would be more than the quota.
        """
        path = self._changeable(name)
        growth = max(offset + len(data) - path.stat().st_size, 0)
        if self._used_bytes + growth > self.quota_bytes:
            self._measure()  # something may have been removed
            if self._used_bytes + growth > self.quota_bytes:
                raise OSError(errno.ENOSPC, "the folder is full")
        with path.open("r+b", buffering=0) as file:
            file.seek(offset)
            file.write(data)
        self._used_bytes += growth

    def truncate(self, name: str, length: int) -> None:
        """Cuts a file to `length` bytes.

        Raises:
            OSError: EINVAL, it is shorter.
        """
        path = self._changeable(name)
        if length > path.stat().st_size:
            raise OSError(errno.EINVAL, "the file is shorter", name)
        with path.open("r+b") as file:
            file.truncate(length)

    def remove(self, name: str) -> None:
        """Removes a file."""
        self._changeable(name).unlink()

    def make_folder(self, name: str) -> None:
        self._measure()
        self._require_entry()
        self._changeable(name).mkdir()

    def remove_folder(self, name: str) -> None:
        """Removes an empty folder."""
        self._changeable(name).rmdir()

    def rename(self, name: str, new_name: str) -> None:
        """Gives a file or a folder another name or place; what stands there already is not replaced."""
        source, target = self._changeable(name), self._changeable(new_name)
        source.stat()
        if target.exists():
            raise FileExistsError(errno.EEXIST, "there is one of this name", new_name)
        source.rename(target)

    def _changeable(self, name: str) -> Path:
        path = self.path(name)
        if path == self.root:
            raise PermissionError(errno.EACCES, "the folder itself stays as it is", name)
        return path

    def _require_entry(self) -> None:
        if self._entries >= ENTRIES_MAX:
            raise OSError(errno.ENOSPC, "too many files")
        self.root.mkdir(parents=True, exist_ok=True)

    def _measure(self) -> None:
        """Counts what is there; others may have changed it."""
        self._used_bytes = self._entries = 0
        for folder, folder_names, file_names in os.walk(self.root):
            self._entries += len(folder_names) + len(file_names)
            for file_name in file_names:
                self._used_bytes += os.lstat(os.path.join(folder, file_name)).st_size  # noqa: PTH118  walk gives text
