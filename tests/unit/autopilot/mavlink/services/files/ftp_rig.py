"""A client of MAVLink FTP that makes its frames by hand."""

import struct
from dataclasses import dataclass

from autopilot.mavlink.services.files.ftp import Opcode
from autopilot.mavlink.services.files.ftp_files import Nak

HEADER = struct.Struct("<HBBBBBxI")


@dataclass
class FtpReply:
    seq: int
    session: int
    opcode: int
    size: int
    request_opcode: int
    burst_complete: int
    offset: int
    data: bytes

    @property
    def error(self):
        return self.data[0] if self.opcode == Opcode.NAK else None


def reply_of(fields):
    raw = bytes(fields.payload)
    header = HEADER.unpack_from(raw)
    return FtpReply(*header, raw[12 : 12 + header[3]])


class FtpClient:
    def __init__(self, rig, client=None):
        self.rig = rig
        self.client = client or rig.client
        self.seq = 100

    def send(self, opcode, data=b"", *, session=0, offset=0, size=None, seq=None):
        if seq is None:
            self.seq += 2
            seq = self.seq
        data = data.encode() if isinstance(data, str) else data
        raw = HEADER.pack(seq, session, opcode, len(data) if size is None else size, 0, 0, offset) + data
        self.client.send("FILE_TRANSFER_PROTOCOL", payload=tuple(raw.ljust(251, b"\0")))

    def ask(self, opcode, data=b"", **options):
        """The only reply; what is much work may take a few frames."""
        self.send(opcode, data, **options)
        replies = self.replies()
        for _ in range(5):
            replies = replies or self.replies()
        (reply,) = replies
        assert reply.seq == (options.get("seq") or self.seq) + 1
        assert reply.request_opcode == opcode
        return reply

    def replies(self, frames=1):
        messages = []
        for _ in range(frames):
            own = self.rig.frame()
            messages += own if self.client is self.rig.client else self.client.received()
        return [reply_of(message.fields) for message in messages if message.name == "FILE_TRANSFER_PROTOCOL"]

    def read(self, name):
        opened = self.ask(Opcode.OPEN_FILE_RO, name)
        assert opened.opcode == Opcode.ACK
        content = b""
        while True:
            reply = self.ask(Opcode.READ_FILE, session=opened.session, offset=len(content), size=239)
            if reply.error == Nak.EOF:
                self.ask(Opcode.TERMINATE_SESSION, session=opened.session)
                assert int.from_bytes(opened.data, "little") == len(content)
                return content
            content += reply.data

    def write(self, name, content, opcode=Opcode.CREATE_FILE):
        opened = self.ask(opcode, name)
        assert opened.opcode == Opcode.ACK
        for offset in range(0, len(content), 239):
            reply = self.ask(Opcode.WRITE_FILE, content[offset : offset + 239], session=opened.session, offset=offset)
            assert reply.opcode == Opcode.ACK
        return self.ask(Opcode.TERMINATE_SESSION, session=opened.session)


def content_of(length):
    return bytes(i * 7 % 251 for i in range(length))
