"""Transfers over a link that loses 10 %, repeats 5 % and delays 10 %, with a client that asks again as clients do."""

import struct
import zlib

import numpy as np
import pytest

from autopilot.mavlink.services.files.ftp import Opcode
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.codec import FrameReader, decode, encode
from common.folder import ConfinedFolder
from mission.client_fields import parameter_from_wire
from mission.flight import Flight, FlightConfig
from tests.lossy import LossyLink

ASK_AGAIN_FRAMES = 25  # 0.5 s
TRIES = 50
FTP_HEADER = struct.Struct("<HBBBBBxI")
DATA = 239  # bytes of one FTP packet


class Client:
    """Asks until it is answered."""

    def __init__(self, flight, link):
        self.flight = flight
        self.link = link
        self._reader = FrameReader()
        self._seq = 0
        self._ftp_seq = 0

    def send(self, name, **fields):
        self._seq = self._seq + 1 & 0xFF
        self.link.send(encode(name, 255, 190, self._seq, target_system=1, target_component=1, **fields))

    def frame(self):
        self.flight.frame()
        return [decode(frame) for data in self.link.receive() for frame in self._reader.feed(data)]

    def ask(self, answer, name, accept=None, **fields):
        """The fields of the first accepted answer."""
        for _ in range(TRIES):
            self.send(name, **fields)
            for _ in range(ASK_AGAIN_FRAMES):
                for message in self.frame():
                    if message.name == answer and (accept is None or accept(message.fields)):
                        return message.fields
        raise AssertionError(f"{name} is not answered")

    def upload(self, items):
        """By the vehicle's requests; says the last thing again when it is silent."""
        count = {"count": len(items), "mission_type": 0}
        last, silent = ("MISSION_COUNT", count), 0
        self.send(last[0], **last[1])
        for _ in range(50 * 300):
            silent += 1
            for message in self.frame():
                if message.name in ("MISSION_REQUEST_INT", "MISSION_REQUEST"):
                    silent, last = 0, ("MISSION_ITEM_INT", items[message.fields.seq])
                    self.send(last[0], **last[1])
                elif message.name == "MISSION_ACK" and last[0] == "MISSION_ITEM_INT":
                    return message.fields.type
            if silent > 75:
                silent = 0
                self.send(last[0], **last[1])
        raise AssertionError("the upload does not end")

    def download(self):
        count = self.ask("MISSION_COUNT", "MISSION_REQUEST_LIST", mission_type=0).count
        items = [
            self.ask("MISSION_ITEM_INT", "MISSION_REQUEST_INT", lambda f, i=i: f.seq == i, seq=i) for i in range(count)
        ]
        self.send("MISSION_ACK", type=0, mission_type=0)
        return items

    def parameters(self):
        """The list, then what is missing by its index; and how many were asked for again."""
        values = {}

        def take(fields):
            if fields.param_index < 0xFFFF:
                values[fields.param_index] = fields
            return True

        count = self.ask("PARAM_VALUE", "PARAM_REQUEST_LIST", take).param_count
        for _ in range(500):
            for message in self.frame():
                if message.name == "PARAM_VALUE":
                    take(message.fields)
        missing = [i for i in range(count) if i not in values]
        for i in missing:
            self.ask(
                "PARAM_VALUE",
                "PARAM_REQUEST_READ",
                lambda f, i=i: take(f) and f.param_index == i,
                param_id="",
                param_index=i,
            )
        return values, len(missing)

    def ftp(self, opcode, data=b"", *, session=0, offset=0, size=None):
        """The reply to one request; asked again with the same number, so that it is done once."""
        self._ftp_seq = self._ftp_seq + 2 & 0xFFFF
        number, length = self._ftp_seq, len(data) if size is None else size
        raw = FTP_HEADER.pack(number, session, opcode, length, 0, 0, offset) + data

        def is_reply(fields):
            return int.from_bytes(bytes(fields.payload[:2]), "little") == (number + 1 & 0xFFFF)

        fields = self.ask(
            "FILE_TRANSFER_PROTOCOL", "FILE_TRANSFER_PROTOCOL", is_reply, payload=tuple(raw.ljust(251, b"\0"))
        )
        _, session, opcode, size, _, _, _ = FTP_HEADER.unpack_from(bytes(fields.payload))
        return session, opcode, bytes(fields.payload[12 : 12 + size])


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    vehicle_end, client_end = memory_pair(LinkRole.GROUND)
    flight = Flight(FlightConfig(noise=0.0), links=[vehicle_end])
    flight.host.files = ConfinedFolder(tmp_path_factory.mktemp("files"))
    client = Client(flight, LossyLink(client_end, 5))
    for _ in range(500):
        client.frame()
    yield client
    assert client.link.lost > 300
    flight.close()


def test_mission_is_uploaded_and_downloaded_exactly(client):
    rng = np.random.default_rng(1)
    items = [
        {
            "seq": i, "frame": 6, "command": 22 if i == 0 else 16, "current": int(i == 0), "autocontinue": 1,
            "param1": 0.0, "param2": 0.0, "param3": 0.0, "param4": 0.0, "x": 473_977_420 + int(rng.integers(5_000)),
            "y": 85_455_940 + int(rng.integers(5_000)), "z": 10.0 + i, "mission_type": 0,
        }
        for i in range(60)
    ]  # fmt: skip
    assert client.upload(items) == 0
    got = client.download()
    keys = ("seq", "frame", "command", "param1", "x", "y", "z")
    assert [[getattr(item, key) for key in keys] for item in got] == [[item[key] for key in keys] for item in items]


def test_every_parameter_is_fetched_exactly(client):
    values, missing = client.parameters()
    params = client.flight.params
    assert missing > len(params) // 30
    got = {fields.param_id: parameter_from_wire(fields) for fields in values.values()}
    assert got == {name: pytest.approx(params[name], rel=1e-6) for name in params}


def test_file_is_written_and_read_exactly(client):
    content = np.random.default_rng(2).bytes(20_000)
    session, opcode, _ = client.ftp(Opcode.CREATE_FILE, b"a.bin")
    assert opcode == Opcode.ACK
    for offset in range(0, len(content), DATA):
        piece = content[offset : offset + DATA]
        assert client.ftp(Opcode.WRITE_FILE, piece, session=session, offset=offset)[1] == Opcode.ACK
    client.ftp(Opcode.TERMINATE_SESSION, session=session)
    assert (client.flight.host.files.root / "a.bin").read_bytes() == content
    checksum = client.ftp(Opcode.CALC_FILE_CRC32, b"a.bin")[2]
    assert len(checksum) == 4
    session, _, size = client.ftp(Opcode.OPEN_FILE_RO, b"a.bin")
    assert int.from_bytes(size, "little") == len(content)
    got = b""
    while True:
        _, opcode, piece = client.ftp(Opcode.READ_FILE, session=session, offset=len(got), size=DATA)
        if opcode == Opcode.NAK:
            break
        got += piece
    assert zlib.crc32(got) == zlib.crc32(content)
    assert got == content
