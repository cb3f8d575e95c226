"""Component metadata: where the files are, what is in them, and that they are read only."""

import json
import lzma
import struct

import pytest

from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.mavlink.services.files.component_metadata import GENERAL, METADATA_FOLDER, checksum
from autopilot.mavlink.services.files.parameter_metadata import bits, choices
from tests.unit.autopilot.mavlink.rig import Rig

ACCEPTED, ACK, NAK = 0, 128, 129
OPEN, READ, CREATE, LIST, CRC = 4, 5, 6, 3, 14
HEADER = struct.Struct("<HBBBBBxI")


class Ftp:
    """One client's requests, in turn."""

    def __init__(self, rig):
        self._rig = rig
        self._seq = 0

    def ask(self, opcode, data=b"", session=0, offset=0, size=None):
        self._seq += 1
        request = HEADER.pack(self._seq, session, opcode, len(data) if size is None else size, 0, 0, offset) + data
        payload = tuple(request.ljust(251, b"\0"))
        self._rig.client.send("FILE_TRANSFER_PROTOCOL", target_component=1, payload=payload)
        reply = bytes(self._rig.only("FILE_TRANSFER_PROTOCOL").payload)
        _, session, code, size, *_ = HEADER.unpack_from(reply)
        return code, session, reply[HEADER.size : HEADER.size + size]

    def read(self, uri):
        path = uri.removeprefix("mftp://").encode()
        code, session, size = self.ask(OPEN, path)
        assert code == ACK
        content = b""
        while len(content) < int.from_bytes(size, "little"):
            code, _, data = self.ask(READ, session=session, offset=len(content), size=239)
            assert code == ACK
            content += data
        return content


def metadata(rig):
    """Every file of the general one and itself, by type, as a client gets them."""
    rig.client.command(512, 397)
    messages = {message.name: message.fields for message in rig.frame()}
    assert messages["COMMAND_ACK"].result == ACCEPTED
    reported, ftp = messages["COMPONENT_METADATA"], Ftp(rig)
    packed = ftp.read(reported.uri)
    assert checksum(packed) == reported.file_crc
    general = json.loads(lzma.decompress(packed))
    files = {0: general}
    for each in general["metadataTypes"]:
        packed = ftp.read(each["uri"])
        assert checksum(packed) == each["fileCrc"]
        files[each["type"]] = json.loads(lzma.decompress(packed))
    return files


def test_parameters_and_events_are_described():
    rig = Rig(dialect=PX4)
    files = metadata(rig)
    assert set(files) == {0, 1, 4}
    parameters = {each["name"]: each for each in files[1]["parameters"]}
    assert len(parameters) == len(rig.vehicle.params)
    takeoff = parameters["MIS_TAKEOFF_ALT"]
    assert (takeoff["type"], takeoff["units"], takeoff["min"], takeoff["default"]) == ("Float", "m", 0.5, 2.5)
    assert parameters["MAV_SYS_ID"]["rebootRequired"]
    assert {"value": 2, "description": "Return"} in parameters["NAV_DLL_ACT"]["values"]


def test_ardupilots_parameters_are_left_to_what_stations_know():
    assert set(metadata(Rig(dialect=ARDUPILOT))) == {0, 4}


def test_files_are_listed_and_read_only():
    ftp = Ftp(Rig())
    assert b"Fgeneral.json.xz\t" in ftp.ask(LIST, METADATA_FOLDER.encode())[2]
    assert ftp.ask(CREATE, f"{METADATA_FOLDER}/{GENERAL}".encode())[0] == NAK
    assert ftp.ask(OPEN, f"{METADATA_FOLDER}/other".encode())[0] == NAK
    assert ftp.ask(CRC, f"{METADATA_FOLDER}/{GENERAL}".encode())[0] == ACK


@pytest.mark.parametrize(
    ("meaning", "bounds", "expected"),
    [
        ("offboard loss: 3 return, 4 land", (3, 4), {3: "Return", 4: "Land"}),
        ("lost sticks: 1 hold, 5 and 6 stop", (0, 6), {1: "Hold", 5: "Stop", 6: "Stop"}),
        ("mode at position 1 of the switch: -1 none, 0 manual", (-1, 9), {-1: "None", 0: "Manual"}),
        ("1: armed so, 0: never", (0, 1), {0: "Never", 1: "Armed so"}),
        ("1: it is on", (0, 1), {0: "Disabled", 1: "Enabled"}),
        ("channel of the stick, 0: none", (0, 18), {}),
        ("least number of satellites", (4, 12), {}),
    ],
)
def test_choices_are_found_in_the_meaning(meaning, bounds, expected):
    assert choices(meaning, *bounds) == expected


@pytest.mark.parametrize(
    ("meaning", "high", "expected"),
    [
        ("exceptions: bit 0 mission, bit 1 other auto modes", 3, {0: "Mission", 1: "Other auto modes"}),
        ("exceptions: bit 0 mission, 1 hold, 2 offboard", 7, {0: "Mission", 1: "Hold", 2: "Offboard"}),
        ("which limits: 1 ceiling, 2 radius, 4 shapes", 7, {0: "Ceiling", 1: "Radius", 2: "Shapes"}),
        ("action: 0 warn, 1 hold, 2 return", 2, {}),
        ("action: 1 warn, 2 return", 7, {}),
    ],
)
def test_bits_are_found_in_the_meaning(meaning, high, expected):
    assert bits(meaning, high) == expected
