"""The camera's memory card: a folder on the host, with a capacity."""

import shutil
from pathlib import Path

from common.files import write_whole

CAPACITY_BYTES = 512 << 20
HOST_BYTES_KEPT = 8 << 20  # of the host's disk, for the flight's logs
_SUFFIXES = (".jpg", ".mp4")


class MediaFolder:
    """Photos and videos in one folder.

    Args:
        root: made when the first file is stored; what is in it already counts.
        capacity_bytes: of the card.

    Attributes:
        used_bytes: of the files that are complete.
        growing_bytes: of one that is being written.
    """

    def __init__(self, root: Path, capacity_bytes: int = CAPACITY_BYTES) -> None:
        self.root = root
        self.capacity_bytes = capacity_bytes
        self.used_bytes = sum(path.stat().st_size for path in self.files())
        self.growing_bytes = 0

    def files(self) -> list[Path]:
        """What is stored, in the order of the names."""
        if not self.root.is_dir():
            return []
        return sorted(path for path in self.root.iterdir() if path.suffix in _SUFFIXES and path.is_file())

    @property
    def free_bytes(self) -> int:
        """On the card, or on the host's disk if there is less."""
        on_card = self.capacity_bytes - self.used_bytes - self.growing_bytes
        try:
            on_host = shutil.disk_usage(self.root).free - HOST_BYTES_KEPT
        except OSError:  # nothing has been stored yet
            on_host = on_card
        return max(min(on_card, on_host), 0)

    def store(self, name: str, data: bytes) -> bool:
        """Writes a file whole; False: there is no room, or the host does not let us."""
        if len(data) > self.free_bytes:
            return False
        try:
            self.root.mkdir(parents=True, exist_ok=True)
            write_whole(self.root / name, data)
        except OSError:
            return False
        self.used_bytes += len(data)
        return True

    def open_path(self, name: str) -> Path | None:
        """Where a file that grows may be written; None: the host does not let us."""
        try:
            self.root.mkdir(parents=True, exist_ok=True)
        except OSError:
            return None
        return self.root / name

    def keep(self, part: Path, name: str) -> bool:
        """Gives a file that has grown its name; False: it has gone, or the host does not let us."""
        self.growing_bytes = 0
        try:
            part.replace(self.root / name)
            self.used_bytes += (self.root / name).stat().st_size
        except OSError:
            return False
        return True

    def format(self) -> None:
        """Removes everything that is stored; other files are left alone."""
        for path in self.files():
            path.unlink()
        self.used_bytes = 0
