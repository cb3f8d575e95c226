"""Which logs there are, and their bytes."""

import pytest

from autopilot.interface.platform import LogFile
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from autopilot.mavlink.services.files.log_transfer import BINS_PER_FRAME
from tests.unit.autopilot.mavlink.rig import Rig, texts


class Shelf:
    """Logs in memory; the last is being written."""

    def __init__(self, **contents):
        self.contents = contents

    def logs(self):
        return [
            LogFile(name, len(content), 1_700_000_000 + i) for i, (name, content) in enumerate(self.contents.items())
        ]

    def read(self, name, offset, count):
        return self.contents.get(name, b"")[offset : offset + count]

    def erase(self):
        erased = list(self.contents)[:-1]
        for name in erased:
            del self.contents[name]
        return len(erased)


@pytest.fixture
def rig():
    rig = Rig()
    rig.vehicle.host.logs = Shelf(a=bytes(range(200)) * 50, b=b"", c=b"x" * 180, d=b"growing")
    return rig


def request_data(client, log_id, offset, count):
    client.send("LOG_REQUEST_DATA", id=log_id, ofs=offset, count=count)


def joined(pieces, offset=0):
    content = b""
    for piece in pieces:
        assert piece.ofs == offset + len(content)
        content += bytes(piece.data[: piece.count])
    return content


def test_list_tells_number_size_and_time(rig):
    rig.client.send("LOG_REQUEST_LIST", start=0, end=0xFFFF)
    entries = rig.all("LOG_ENTRY")
    assert [(entry.id, entry.size) for entry in entries] == [(0, 10_000), (1, 0), (2, 180), (3, 7)]
    assert {(entry.num_logs, entry.last_log_num) for entry in entries} == {(4, 3)}
    assert entries[1].time_utc == 1_700_000_001
    rig.client.send("LOG_REQUEST_LIST", start=1, end=2)
    assert [entry.id for entry in rig.all("LOG_ENTRY")] == [1, 2]


def test_long_list_is_spread_over_frames(rig):
    rig.vehicle.host.logs = Shelf(**{f"log{i:03}": b"" for i in range(50)})
    rig.client.send("LOG_REQUEST_LIST", start=0, end=0xFFFF)
    assert [entry.id for entry in rig.all("LOG_ENTRY")] == list(range(20))
    assert [entry.id for entry in rig.all("LOG_ENTRY", 2)] == list(range(20, 50))


@pytest.mark.parametrize("stored", [None, Shelf()])
def test_no_logs_are_one_entry_that_says_so(rig, stored):
    rig.vehicle.host.logs = stored
    rig.client.send("LOG_REQUEST_LIST", start=0, end=0xFFFF)
    entry = rig.only("LOG_ENTRY")
    assert (entry.num_logs, entry.id, entry.size) == (0, 0, 0)
    request_data(rig.client, 0, 90, 90)
    piece = rig.only("LOG_DATA")
    assert (piece.id, piece.ofs, piece.count) == (0, 90, 0)


def test_data_comes_in_bins_some_per_frame(rig):
    request_data(rig.client, 0, 0, 0xFFFFFFFF)
    pieces = rig.all("LOG_DATA")
    assert len(pieces) == BINS_PER_FRAME
    assert {piece.count for piece in pieces} == {90}
    pieces += rig.all("LOG_DATA", 3)
    assert joined(pieces) == bytes(range(200)) * 50
    assert pieces[-1].count == 10_000 % 90
    assert rig.all("LOG_DATA", 5) == []


def test_gap_is_sent_again_and_only_the_gap(rig):
    request_data(rig.client, 0, 450, 270)
    assert joined(rig.all("LOG_DATA", 2), 450) == (bytes(range(200)) * 50)[450:720]


def test_end_after_full_bins_is_an_empty_bin(rig):
    request_data(rig.client, 2, 0, 0xFFFFFFFF)
    assert [piece.count for piece in rig.all("LOG_DATA")] == [90, 90, 0]
    request_data(rig.client, 2, 0, 180)
    assert [piece.count for piece in rig.all("LOG_DATA")] == [90, 90]
    request_data(rig.client, 1, 0, 90)
    assert [piece.count for piece in rig.all("LOG_DATA")] == [0]


def test_two_clients_get_different_logs_at_once(rig):
    request_data(rig.client, 0, 0, 10_000)
    request_data(rig.second_client, 2, 0, 180)
    first, second = [], []
    for _ in range(8):
        first += rig.all("LOG_DATA")
        second += [message.fields for message in rig.second_client.received() if message.name == "LOG_DATA"]
    assert joined(first) == bytes(range(200)) * 50
    assert joined(second) == b"x" * 180


def test_end_request_stops_the_data_of_its_sender_only(rig):
    request_data(rig.client, 0, 0, 10_000)
    request_data(rig.second_client, 0, 0, 10_000)
    rig.frame()
    rig.client.send("LOG_REQUEST_END")
    assert rig.all("LOG_DATA", 8) == []
    assert sum(message.name == "LOG_DATA" for message in rig.second_client.received()) == 112


def test_numbers_stay_while_logs_come_and_go(rig):
    rig.client.send("LOG_REQUEST_LIST", start=0, end=0xFFFF)
    rig.frame()
    rig.vehicle.host.logs.contents["e"] = b"new"
    rig.second_client.send("LOG_ERASE")
    rig.frame()
    request_data(rig.client, 3, 0, 90)
    assert rig.only("LOG_DATA").count == 0  # erased: nothing, rather than another log
    rig.client.send("LOG_REQUEST_LIST", start=0, end=0xFFFF)
    assert [(entry.id, entry.size) for entry in rig.all("LOG_ENTRY")] == [(0, 3)]


def test_erase_keeps_the_log_being_written_and_says_how_many_went(rig):
    rig.client.send("LOG_ERASE")
    assert texts(rig.frame()) == ["3 logs erased"]
    assert list(rig.vehicle.host.logs.contents) == ["d"]


def test_ardupilots_numbers_begin_with_one():
    rig = Rig(dialect=ARDUPILOT)
    rig.vehicle.host.logs = Shelf(a=b"first", b=b"second")
    rig.client.send("LOG_REQUEST_LIST", start=0, end=0xFFFF)
    entries = rig.all("LOG_ENTRY")
    assert [(entry.id, entry.last_log_num, entry.size) for entry in entries] == [(1, 2, 5), (2, 2, 6)]
    request_data(rig.client, 2, 0, 90)
    assert joined(rig.all("LOG_DATA")) == b"second"
