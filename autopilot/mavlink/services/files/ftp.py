"""MAVLink FTP: files of the host's folder, and the parameter file, for any number of clients.

In: FILE_TRANSFER_PROTOCOL requests. Out: one reply each; a burst is sent some packets per frame, and what is beyond a
frame's work waits for the next one. A request that comes again, because its reply was lost, gets the same reply and is
not carried out again.
"""

from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from struct import Struct
from typing import Any

from autopilot.mavlink.channel import Endpoint, Sender
from autopilot.mavlink.service import Handler, Service
from autopilot.mavlink.services.files.component_metadata import MetadataService
from autopilot.mavlink.services.files.ftp_files import FtpError, FtpFiles, Nak, OpenFile, VirtualFolder
from autopilot.mavlink.services.files.ftp_work import REQUEST_WORK, Budget, Checksums, Listings
from autopilot.mavlink.services.parameter_protocol import ParameterService
from autopilot.mavlink.wire.codec import known_type

DATA_BYTES = 239
SESSIONS_MAX = 16
SESSIONS_PER_CLIENT = 4
SESSION_IDLE_US = 30_000_000  # guess: longer than a client's retries
REPLIES_KEPT_MAX = 32  # clients
REPLY_KEPT_US = 10_000_000
BURST_PACKETS = 150  # PX4 ends a burst after about 35 KB, and the client asks for the next
BURST_PACKETS_PER_FRAME = 24  # of all bursts together: 287 KB/s

_HEADER = Struct("<HBBBBBxI")  # seq, session, opcode, size, request opcode, burst complete, padding, offset
_OPCODE_AT = 3
_PAYLOAD_BYTES = _HEADER.size + DATA_BYTES
_FTP = known_type("FILE_TRANSFER_PROTOCOL")


class Opcode(IntEnum):
    """Requests and replies."""

    NONE = 0
    TERMINATE_SESSION = 1
    RESET_SESSIONS = 2
    LIST_DIRECTORY = 3
    OPEN_FILE_RO = 4
    READ_FILE = 5
    CREATE_FILE = 6
    WRITE_FILE = 7
    REMOVE_FILE = 8
    CREATE_DIRECTORY = 9
    REMOVE_DIRECTORY = 10
    OPEN_FILE_WO = 11
    TRUNCATE_FILE = 12
    RENAME = 13
    CALC_FILE_CRC32 = 14
    BURST_READ_FILE = 15
    LIST_DIRECTORY_WITH_TIME = 16
    ACK = 128
    NAK = 129


@dataclass(frozen=True, slots=True)
class Request:
    """What a client asks."""

    seq: int
    session: int
    opcode: int
    size: int
    offset: int
    data: bytes

    @property
    def name(self) -> str:
        """The path that the data is."""
        return self.names[0]

    @property
    def names(self) -> list[str]:
        try:
            return self.data.decode("utf-8").rstrip("\0").split("\0")
        except UnicodeDecodeError as error:
            raise FtpError(Nak.FAIL) from error


@dataclass(slots=True)
class _Session:
    owner: Sender
    file: OpenFile
    used_us: int
    burst: "_Burst | None" = None


@dataclass(slots=True)
class _Burst:
    """A burst under way."""

    seq: int  # of the next packet
    offset: int
    chunk: int  # bytes per packet
    packets_left: int = BURST_PACKETS


@dataclass(slots=True)
class _LastReply:
    request: bytes
    payload: bytes
    time_us: int


_EMPTY = b""
Answer = tuple[int, int, bytes]  # session, offset, data


class FtpService(Service):
    """Serves files to clients."""

    def __init__(
        self,
        endpoint: Endpoint,
        parameters: ParameterService,
        metadata: MetadataService,
        folders: Mapping[str, VirtualFolder],
    ) -> None:
        self._endpoint = endpoint
        self._files = FtpFiles(endpoint, parameters, metadata, folders)
        self._sessions: dict[int, _Session] = {}
        self._replies: OrderedDict[Sender, _LastReply] = OrderedDict()
        self._budget, self._checksums, self._listings = Budget(), Checksums(), Listings()
        self._work: dict[int, Callable[[Sender, Request], Answer]] = {
            Opcode.NONE: lambda _, request: (request.session, 0, _EMPTY),
            Opcode.TERMINATE_SESSION: self._terminate,
            Opcode.RESET_SESSIONS: self._reset,
            Opcode.LIST_DIRECTORY: self._list,
            Opcode.LIST_DIRECTORY_WITH_TIME: self._list,
            Opcode.OPEN_FILE_RO: self._open,
            Opcode.OPEN_FILE_WO: self._open,
            Opcode.CREATE_FILE: self._open,
            Opcode.READ_FILE: self._read,
            Opcode.WRITE_FILE: self._write,
            Opcode.REMOVE_FILE: self._change,
            Opcode.CREATE_DIRECTORY: self._change,
            Opcode.REMOVE_DIRECTORY: self._change,
            Opcode.TRUNCATE_FILE: self._change,
            Opcode.RENAME: self._change,
        }

    def messages(self) -> Mapping[str, Handler]:
        return {"FILE_TRANSFER_PROTOCOL": self.requested}

    def requested(self, sender: Sender, fields: Any) -> None:
        """One step of a file transfer: list, open, read, write, remove, rename, checksum."""
        raw = bytes(fields.payload)
        if raw[_OPCODE_AT] >= Opcode.ACK:  # a reply
            return
        last = self._replies.get(sender)
        if last is not None and last.request == raw and self._endpoint.time_us - last.time_us < REPLY_KEPT_US:
            self._send(sender, last.payload)
        elif not self._checksums.has(sender, raw):
            if self._budget.is_left and not self._budget.has_waiting:
                self._carry_out(sender, raw)
            else:
                self._budget.wait(sender, raw)

    def _carry_out(self, sender: Sender, raw: bytes) -> None:
        seq, session, opcode, size, _, _, offset = _HEADER.unpack_from(raw)
        before = self._files.work
        request = Request(seq, session, opcode, size, offset, raw[_HEADER.size : _HEADER.size + size])
        try:
            if size > DATA_BYTES:
                raise FtpError(Nak.INVALID_DATA_SIZE)
            if opcode == Opcode.BURST_READ_FILE:
                self._begin_burst(sender, request)
                self._replies.pop(sender, None)  # asked for again, it is sent again
                return
            if opcode == Opcode.CALC_FILE_CRC32:
                self._begin_checksum(sender, request, raw)
                return
            work = self._work.get(opcode)
            if work is None:
                raise FtpError(Nak.UNKNOWN_COMMAND)
            payload = _ack(request, *work(sender, request))
        except (FtpError, OSError) as error:
            payload = _nak(seq, session, opcode, error)
        finally:
            self._budget.charge(REQUEST_WORK + self._files.work - before)
        self._answer(sender, raw, payload)

    def _answer(self, sender: Sender, raw: bytes, payload: bytes) -> None:
        self._remember(sender, _LastReply(raw, payload, self._endpoint.time_us))
        self._send(sender, payload)

    def frame(self) -> None:
        """Goes on with what waits, sends the next packets of the bursts and closes sessions that nobody uses."""
        budget = self._budget
        while budget.has_waiting and budget.is_left:
            self._carry_out(*budget.take())
        self._checksums.go_on(budget)
        budget.renew()
        if not self._sessions:
            return
        now_us = self._endpoint.time_us
        bursts = [number for number, session in self._sessions.items() if session.burst is not None]
        for number in bursts:
            session = self._sessions[number]
            session.used_us = now_us
            for _ in range(max(BURST_PACKETS_PER_FRAME // len(bursts), 1)):
                if session.burst is not None:
                    self._send_burst_packet(number, session, session.burst)
        idle = [number for number, session in self._sessions.items() if now_us - session.used_us > SESSION_IDLE_US]
        for number in idle:
            self._sessions.pop(number).file.abandon()

    # Sessions

    def _open(self, sender: Sender, request: Request) -> Answer:
        own = sum(session.owner == sender for session in self._sessions.values())
        if len(self._sessions) >= SESSIONS_MAX or own >= SESSIONS_PER_CLIENT:
            raise FtpError(Nak.NO_SESSIONS)
        number = request.session  # the client's own choice, as with ArduPilot: MAVProxy hears no other
        if number == 0 or number in self._sessions:
            number = next(i for i in range(SESSIONS_MAX) if i not in self._sessions)
        if request.opcode == Opcode.OPEN_FILE_RO:
            file = self._files.open(request.name)
        else:
            file = self._files.open_to_write(request.name, is_new=request.opcode == Opcode.CREATE_FILE)
        self._sessions[number] = _Session(sender, file, self._endpoint.time_us)
        return number, 0, file.size.to_bytes(4, "little")

    def _session(self, sender: Sender, request: Request) -> _Session:
        session = self._sessions.get(request.session)
        if session is None or session.owner != sender:
            raise FtpError(Nak.INVALID_SESSION)
        session.used_us = self._endpoint.time_us
        return session

    def _terminate(self, sender: Sender, request: Request) -> Answer:
        session = self._session(sender, request)
        del self._sessions[request.session]
        session.file.close()
        return request.session, 0, _EMPTY

    def _reset(self, sender: Sender, request: Request) -> Answer:
        """Closes the sessions of this client; those of others stay."""
        for number, session in list(self._sessions.items()):
            if session.owner == sender:
                del self._sessions[number]
                session.file.abandon()
        return request.session, 0, _EMPTY

    # Reading and writing

    def _read(self, sender: Sender, request: Request) -> Answer:
        session = self._session(sender, request)
        data = session.file.read(request.offset, request.size or DATA_BYTES)
        if not data:
            raise FtpError(Nak.EOF)
        return request.session, request.offset, data

    def _write(self, sender: Sender, request: Request) -> Answer:
        session = self._session(sender, request)
        session.file.write(request.offset, request.data)
        return request.session, request.offset, len(request.data).to_bytes(4, "little")

    def _begin_burst(self, sender: Sender, request: Request) -> None:
        session = self._session(sender, request)
        session.burst = _Burst(request.seq + 1, request.offset, request.size or DATA_BYTES)

    def _send_burst_packet(self, number: int, session: _Session, burst: _Burst) -> None:
        """The next piece; after the file's last one a refusal that says it ends there."""
        opcode = Opcode.BURST_READ_FILE
        try:
            data = session.file.read(burst.offset, burst.chunk)
            if not data:
                raise FtpError(Nak.EOF)
        except (FtpError, OSError) as error:
            session.burst = None
            payload = _nak(burst.seq - 1, number, opcode, error, offset=burst.offset)
        else:
            burst.packets_left -= 1
            is_last = burst.packets_left == 0
            if is_last:
                session.burst = None
            header = _HEADER.pack(burst.seq & 0xFFFF, number, Opcode.ACK, len(data), opcode, is_last, burst.offset)
            payload = header + data
            burst.seq += 1
            burst.offset += len(data)
        self._send(session.owner, payload)

    # Names

    def _list(self, sender: Sender, request: Request) -> Answer:
        now_us, opcode = self._endpoint.time_us, request.opcode
        listing = self._listings.get(sender, opcode, request.data, now_us) if request.offset else None
        if listing is None:
            listing = self._files.listing(request.name, with_times=opcode == Opcode.LIST_DIRECTORY_WITH_TIME)
            self._listings.keep(sender, opcode, request.data, now_us, listing)
        data = b""
        for i in range(request.offset, len(listing)):
            entry = listing[i]
            if len(data) + len(entry) > DATA_BYTES:
                break
            data += entry
        if not data:
            raise FtpError(Nak.EOF)
        return request.session, request.offset, data

    def _change(self, _: Sender, request: Request) -> Answer:
        files = self._files.changeable(*request.names)
        match request.opcode:
            case Opcode.REMOVE_FILE:
                files.remove(request.name)
            case Opcode.CREATE_DIRECTORY:
                files.make_folder(request.name)
            case Opcode.REMOVE_DIRECTORY:
                files.remove_folder(request.name)
            case Opcode.TRUNCATE_FILE:
                files.truncate(request.name, request.offset)
            case _:
                if len(request.names) != 2:
                    raise FtpError(Nak.INVALID_DATA_SIZE)
                files.rename(*request.names)
        return request.session, 0, _EMPTY

    def _begin_checksum(self, sender: Sender, request: Request, raw: bytes) -> None:
        def done(checksum: int) -> None:
            self._answer(sender, raw, _ack(request, request.session, 0, checksum.to_bytes(4, "little")))

        def failed(error: FtpError | OSError) -> None:
            self._answer(sender, raw, _nak(request.seq, request.session, request.opcode, error))

        self._checksums.begin(sender, raw, self._files.open(request.name), done, failed)

    # Replies

    def _remember(self, sender: Sender, reply: _LastReply) -> None:
        self._replies[sender] = reply
        self._replies.move_to_end(sender)
        if len(self._replies) > REPLIES_KEPT_MAX:
            self._replies.popitem(last=False)

    def _send(self, sender: Sender, payload: bytes) -> None:
        content = tuple(payload.ljust(_PAYLOAD_BYTES, b"\0"))
        self._endpoint.reply(sender, _FTP, _FTP.pack(0, sender.sysid, sender.compid, content))


def _ack(request: Request, session: int, offset: int, data: bytes) -> bytes:
    return _HEADER.pack(request.seq + 1 & 0xFFFF, session, Opcode.ACK, len(data), request.opcode, 0, offset) + data


def _nak(seq: int, session: int, opcode: int, error: FtpError | OSError, offset: int = 0) -> bytes:
    if isinstance(error, FtpError):
        data = bytes((error.code,))
    elif isinstance(error, FileNotFoundError):
        data = bytes((Nak.FILE_NOT_FOUND,))
    elif isinstance(error, FileExistsError):
        data = bytes((Nak.FILE_EXISTS,))
    elif isinstance(error, PermissionError):
        data = bytes((Nak.FILE_PROTECTED,))
    else:
        data = bytes((Nak.FAIL_ERRNO, min(error.errno or 0, 255)))
    return _HEADER.pack(seq + 1 & 0xFFFF, session, Opcode.NAK, len(data), opcode, 0, offset) + data
