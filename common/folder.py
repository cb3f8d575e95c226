"""A folder that clients may work in by name, and that they cannot get out of.

Names are relative to the folder's root, with `/` between their parts; a leading `/` means the root too. Neither `..`
nor a symbolic link leads outside. What is stored is bounded in bytes and in number.
"""

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

QUOTA_BYTES = 64 << 20
ENTRIES_MAX = 2000  # files and folders in all


class FolderEntry(NamedTuple):
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
        self.looked_at = 0  # entries, since it was made: what the work of a request is counted by
        self._entries = self._entries_there()
        self._used_bytes = self._bytes_there()

    def path(self, name: str) -> Path:
        """Where `name` lies.

        Raises:
            PermissionError: outside the folder.
        """
        parts = [part for part in name.split("/") if part not in ("", ".")]
        if ".." in parts or "\0" in name:
            raise PermissionError(errno.EACCES, "outside the folder", name)
        path = self.root
        for part in parts:  # the last one too: opening it would follow a link
            path /= part
            if path.is_symlink() and not self._is_inside(path):
                raise PermissionError(errno.EACCES, "outside the folder", name)
        return path

    def _is_inside(self, path: Path) -> bool:
        try:
            return path.resolve().is_relative_to(self.root)
        except RuntimeError:  # a link to itself
            return False

    def names(self, name: str) -> list[str]:
        """What a folder holds, sorted; without links that lead outside. Looks at no file, which is what takes time."""
        folder = self.path(name)
        if folder == self.root and not folder.exists():
            return []
        with os.scandir(folder) as entries:
            found = [e.name for e in entries if not e.is_symlink() or self._is_inside(Path(e.path))]
        self.looked_at += len(found) // 10
        return sorted(found)

    def entry(self, folder: str, name: str) -> FolderEntry:
        """One of the names that a folder holds."""
        self.looked_at += 1
        status = self.path(f"{folder}/{name}").stat()
        is_folder = stat.S_ISDIR(status.st_mode)
        return FolderEntry(name, is_folder, 0 if is_folder else status.st_size, int(status.st_mtime))

    def size(self, name: str) -> int:
        """Bytes of a file that can be read."""
        status = self.path(name).stat()
        if stat.S_ISDIR(status.st_mode):
            raise IsADirectoryError(errno.EISDIR, "a folder", name)
        if not stat.S_ISREG(status.st_mode):  # a pipe would wait for its other end
            raise PermissionError(errno.EACCES, "not a file", name)
        return status.st_size

    def read(self, name: str, offset: int, count: int) -> bytes:
        """Bytes of a file from `offset` on; fewer at its end."""
        with self.path(name).open("rb") as file:
            file.seek(offset)
            return file.read(count)

    def create(self, name: str) -> None:
        """Makes a file, or empties it."""
        path = self._changeable(name)
        size = self.size(name) if path.exists() else None
        if size is None:
            self._require_entry()
        path.open("wb").close()
        self._entries += size is None
        self._used_bytes -= size or 0

    def write(self, name: str, offset: int, data: bytes) -> None:
        """Writes into a file that exists.

        Raises:
            OSError: ENOSPC, there would be more than the quota.
        """
        path = self._changeable(name)
        growth = max(offset + len(data) - path.stat().st_size, 0)
        if self._used_bytes + growth > self.quota_bytes:
            self._used_bytes = self._bytes_there()  # something may have been removed
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
        size = path.stat().st_size
        if length > size:
            raise OSError(errno.EINVAL, "the file is shorter", name)
        with path.open("r+b") as file:
            file.truncate(length)
        self._used_bytes -= size - length

    def remove(self, name: str) -> None:
        """Removes a file."""
        path = self._changeable(name)
        size = path.lstat().st_size
        path.unlink()
        self._entries -= 1
        self._used_bytes -= size

    def make_folder(self, name: str) -> None:
        path = self._changeable(name)
        self._require_entry()
        path.mkdir()
        self._entries += 1

    def remove_folder(self, name: str) -> None:
        """Removes an empty folder."""
        self._changeable(name).rmdir()
        self._entries -= 1

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
            self._entries = self._entries_there()  # others may have removed some
            if self._entries >= ENTRIES_MAX:
                raise OSError(errno.ENOSPC, "too many files")
        self.root.mkdir(parents=True, exist_ok=True)

    def _entries_there(self) -> int:
        """How many there are now; looks at no file, which is what takes time."""
        count = sum(1 for _ in _entries_below(self.root))
        self.looked_at += count // 10
        return count

    def _bytes_there(self) -> int:
        """How much all files hold now."""
        total = 0
        for entry in _entries_below(self.root):
            self.looked_at += 1
            with suppress(OSError):  # it has just gone
                total += 0 if entry.is_dir(follow_symlinks=False) else entry.stat(follow_symlinks=False).st_size
        return total


def _entries_below(root: Path) -> Iterator[os.DirEntry[str]]:
    """All files and folders in a folder and in those in it; links are not followed."""
    folders = [os.fspath(root)]
    while folders:
        with suppress(OSError), os.scandir(folders.pop()) as entries:  # one that has just gone holds nothing
            for entry in entries:
                yield entry
                if entry.is_dir(follow_symlinks=False):
                    folders.append(entry.path)
