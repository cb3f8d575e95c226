"""What the names of MAVLink FTP stand for: files of the host's folder, or files made on demand."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Protocol
from urllib.parse import parse_qs

from autopilot.interface.vehicle_state import Severity
from autopilot.mavlink.channel import Endpoint
from autopilot.mavlink.services.files.component_metadata import METADATA_FOLDER, MetadataService
from autopilot.mavlink.services.parameter_protocol import ParameterService
from autopilot.mavlink.wire.param_file import UPLOAD_BYTES_MAX, ParamFileError, packed_parameters, unpacked_parameters
from common.folder import ConfinedFolder

PARAM_FOLDER = "@PARAM"
PARAM_FILE = "param.pck"
SKIPPED = b"S\0"  # an entry of a listing that is none
_ENTRY_WORK = 4  # [us] of a file that is looked at
_BYTES_PER_WORK = 4  # of a file made on demand
_PARAMETER_WORK = 10  # [us] of one in the parameter file


class Nak(IntEnum):
    """Why a request is refused."""

    FAIL = 1
    FAIL_ERRNO = 2
    INVALID_DATA_SIZE = 3
    INVALID_SESSION = 4
    NO_SESSIONS = 5
    EOF = 6
    UNKNOWN_COMMAND = 7
    FILE_EXISTS = 8
    FILE_PROTECTED = 9
    FILE_NOT_FOUND = 10


class FtpError(Exception):
    """A request that is refused."""

    def __init__(self, code: Nak) -> None:
        super().__init__(code.name)
        self.code = code


class OpenFile(Protocol):
    """A file that a session has open."""

    size: int  # [bytes] when it was opened

    def read(self, offset: int, count: int) -> bytes:
        """Bytes from `offset` on; none beyond the end."""
        ...

    def write(self, offset: int, data: bytes, /) -> None: ...

    def close(self) -> None:
        """The client is done with it."""
        ...

    def abandon(self) -> None:
        """The client is gone."""
        ...


@dataclass(frozen=True, slots=True)
class VirtualEntry:
    """A file of a folder that is on no disk."""

    name: str
    size: int
    time_s: int = 0  # Unix time


class VirtualFolder(Protocol):
    """A folder whose files are made on demand."""

    def entries(self) -> Sequence[VirtualEntry]: ...

    def open(self, name: str) -> OpenFile: ...

    def open_to_write(self, name: str, /) -> OpenFile: ...


class _FolderFile:
    """A file of the folder; it is open only while it is read or written, so nothing is left when clients vanish."""

    def __init__(self, folder: ConfinedFolder, name: str, *, is_writable: bool) -> None:
        self.size = folder.size(name)
        self._folder = folder
        self._name = name
        self._is_writable = is_writable

    def read(self, offset: int, count: int) -> bytes:
        return self._folder.read(self._name, offset, count)

    def write(self, offset: int, data: bytes) -> None:
        if not self._is_writable:
            raise FtpError(Nak.FILE_PROTECTED)
        self._folder.write(self._name, offset, data)

    def close(self) -> None:
        """Everything is in the file already."""

    abandon = close


class Snapshot:
    """A file made on demand, as it was when it was opened."""

    def __init__(self, content: bytes) -> None:
        self.size = len(content)
        self._content = content

    def read(self, offset: int, count: int) -> bytes:
        return self._content[offset : offset + count]

    def write(self, _: int, __: bytes, /) -> None:
        raise FtpError(Nak.FILE_PROTECTED)

    def close(self) -> None:
        """Nothing is kept."""

    abandon = close


class _ParameterUpload:
    """Parameters on their way in; they are set when the client closes the file, all of them or none."""

    size = 0

    def __init__(self, endpoint: Endpoint, parameters: ParameterService) -> None:
        self._endpoint = endpoint
        self._parameters = parameters
        self._content = bytearray()

    def read(self, offset: int, count: int) -> bytes:
        return bytes(self._content[offset : offset + count])

    def write(self, offset: int, data: bytes) -> None:
        end = offset + len(data)
        if end > UPLOAD_BYTES_MAX:
            raise FtpError(Nak.INVALID_DATA_SIZE)
        self._content.extend(bytes(max(end - len(self._content), 0)))
        self._content[offset:end] = data

    def close(self) -> None:
        if not self._content:
            return
        try:
            entries = unpacked_parameters(bytes(self._content))
        except ParamFileError as error:
            self._endpoint.text(Severity.WARNING, f"Parameter file not taken: {error}")
            raise FtpError(Nak.FAIL) from error
        self._parameters.set_uploaded(entries)

    def abandon(self) -> None:
        """A file that is not complete sets nothing."""


class _Listing(Sequence[bytes]):
    """The entries of a folder of the host's behind those of others; a file is looked at when its entry is sent."""

    def __init__(self, first: Sequence[bytes], folder: ConfinedFolder, name: str, *, with_times: bool) -> None:
        self._folder, self._name, self._with_times = folder, name, with_times
        self._first = first
        self._names = folder.names(name)

    def __len__(self) -> int:
        return len(self._first) + len(self._names)

    def __getitem__(self, i: Any) -> Any:
        if i < len(self._first):
            return self._first[i]
        try:
            entry = self._folder.entry(self._name, self._names[i - len(self._first)])
        except OSError:  # it has gone, or is a link to nothing
            return SKIPPED
        kind = "D" if entry.is_folder else "F"
        return _entry(kind, entry.name, entry.size, entry.time_s, with_times=self._with_times)


class FtpFiles:
    """Finds what a name stands for."""

    def __init__(
        self,
        endpoint: Endpoint,
        parameters: ParameterService,
        metadata: MetadataService,
        folders: Mapping[str, VirtualFolder],
    ) -> None:
        self._endpoint = endpoint
        self._parameters = parameters
        self._metadata = metadata
        self._virtual = folders  # by their paths
        self._made_work = 0

    @property
    def work(self) -> int:
        """What requests have cost so far, about [us]."""
        folder = self._endpoint.vehicle.host.files
        return self._made_work + (0 if folder is None else _ENTRY_WORK * folder.looked_at)

    @property
    def _folder(self) -> ConfinedFolder:
        folder = self._endpoint.vehicle.host.files
        if folder is None:
            raise FileNotFoundError
        return folder

    def open(self, name: str) -> OpenFile:
        """Opens a file for reading."""
        folder, inner = self._virtual_name(name)
        if folder is not None:
            file = folder.open(inner)
            self._made_work += file.size // _BYTES_PER_WORK if isinstance(file, Snapshot) else 0
            return file
        own = _own_name(name)
        if own is None:
            return _FolderFile(self._folder, name, is_writable=False)
        own_folder, own_file = own
        if own_folder == METADATA_FOLDER and own_file in self._metadata.files:
            return Snapshot(self._metadata.files[own_file])
        file_name, _, query = own_file.partition("?")
        if own_folder != PARAM_FOLDER or file_name != PARAM_FILE:
            raise FileNotFoundError
        return Snapshot(self._parameter_file(query))

    def _parameter_file(self, query: str) -> bytes:
        options = {key: values[-1] for key, values in parse_qs(query).items()}
        try:
            start, count = int(options.get("start", 0)), int(options.get("count", 0))
        except ValueError as error:
            raise FtpError(Nak.FAIL) from error
        entries = self._parameters.entries()
        self._made_work += _PARAMETER_WORK * len(entries)
        chosen = entries[max(start, 0) :]
        if count > 0:
            chosen = chosen[:count]
        return packed_parameters(chosen, len(entries), with_defaults=options.get("withdefaults") == "1")

    def open_to_write(self, name: str, *, is_new: bool) -> OpenFile:
        """Opens a file for writing; a new one is empty, another keeps its content."""
        virtual, inner = self._virtual_name(name)
        if virtual is not None:
            return virtual.open_to_write(inner)
        own = _own_name(name)
        if own is None:
            folder = self.changeable(name)
            if is_new:
                folder.create(name)
            return _FolderFile(folder, name, is_writable=True)
        if own[0] != PARAM_FOLDER or own[1].partition("?")[0] != PARAM_FILE:
            raise FtpError(Nak.FILE_PROTECTED)
        return _ParameterUpload(self._endpoint, self._parameters)

    def listing(self, name: str, *, with_times: bool) -> Sequence[bytes]:
        """The entries of a folder as the protocol writes them, each ended by a zero byte."""
        virtual, inner = self._virtual_name(name)
        if virtual is not None:
            if inner:
                raise FileNotFoundError
            entries = virtual.entries()
            self._made_work += _ENTRY_WORK * len(entries)
            return [_entry("F", each.name, each.size, each.time_s, with_times=with_times) for each in entries]
        if own_folders := self._virtual_children(name):
            return [_entry("D", folder, 0, 0, with_times=with_times) for folder in own_folders]
        own = _own_name(name)
        if own is not None:
            own_folder, inner = own
            if inner:
                raise FileNotFoundError
            if own_folder == METADATA_FOLDER:
                sizes = {file: len(content) for file, content in self._metadata.files.items()}
            else:
                sizes = {PARAM_FILE: len(self._parameter_file(""))}
            return [_entry("F", file, size, 0, with_times=with_times) for file, size in sorted(sizes.items())]
        root = self._virtual_root() if not name.strip("/") else []
        first = [_entry("D", folder, 0, 0, with_times=with_times) for folder in root]
        return _Listing(first, self._folder, name, with_times=with_times)

    def changeable(self, *names: str) -> ConfinedFolder:
        """The folder in which files of these names may be changed."""
        is_own = any(_own_name(name) is not None or self._is_virtual(name) for name in names)
        if is_own or self._endpoint.vehicle.host.files is None:
            raise FtpError(Nak.FILE_PROTECTED)
        return self._folder

    def _virtual_name(self, name: str) -> tuple[VirtualFolder | None, str]:
        """The virtual folder that a name is in, and what follows it."""
        path = name.strip("/")
        for own, folder in self._virtual.items():
            if path == own or path.startswith(f"{own}/"):
                return folder, path[len(own) + 1 :]
        return None, ""

    def _virtual_children(self, name: str) -> list[str]:
        """Virtual folders in a folder that is on no disk itself (APM)."""
        path = name.strip("/")
        return [own[len(path) + 1 :] for own in self._virtual if path and own.startswith(f"{path}/")]

    def _virtual_root(self) -> list[str]:
        return sorted({own.partition("/")[0] for own in self._virtual} | {PARAM_FOLDER}) if self._virtual else []

    def _is_virtual(self, name: str) -> bool:
        return name.strip("/").partition("/")[0] in self._virtual_root()


def _own_name(name: str) -> tuple[str, str] | None:
    """A folder of our own and what follows it in a name; None for a name of the host's folder."""
    folder, _, rest = name.lstrip("/").partition("/")
    return (folder, rest) if folder in (PARAM_FOLDER, METADATA_FOLDER) else None


def _entry(kind: str, name: str, size: int, time_s: int, *, with_times: bool) -> bytes:
    if with_times:
        text = f"{kind}{name}\t{size}\t{time_s}"
    else:
        text = f"F{name}\t{size}" if kind == "F" else f"D{name}"
    encoded = text.encode("utf-8", "replace") + b"\0"
    return encoded if len(encoded) <= 239 else SKIPPED  # it does not fit into a reply
