"""Frames of several channels in one log, counted as pymavlink counts them."""

from itertools import pairwise

from autopilot.mavlink.transport.frame_log import FrameLog
from autopilot.mavlink.wire.codec import SIGNED_FLAG, FrameReader, decode, encode, frame_bytes, known_type

HEARTBEAT = known_type("HEARTBEAT")


class Log:
    """A frame log, and what lies in it."""

    def __init__(self):
        self.data = []
        self.log = FrameLog(lambda _, data: self.data.append(data), 1)

    def hear(self, seq, channel=0, sysid=255, compid=190, name="PING"):
        (frame,) = FrameReader().feed(encode(name, sysid, compid, seq, time_usec=seq + 1000))
        self.log.received(0, frame, channel)

    def say(self, seq, compid=1, flags=0):
        frame = frame_bytes(HEARTBEAT, bytes(9), seq, 1, compid, flags)
        self.log.sent(0, HEARTBEAT, bytes(9), compid, frame)
        return frame

    def frames(self):
        return FrameReader().feed(b"".join(self.data))

    def lost(self, sysid=255):
        """As pymavlink counts: differences of sequence numbers beyond one."""
        seqs = [frame.seq for frame in self.frames() if frame.sysid == sysid]
        return sum((after - before - 1) & 0xFF for before, after in pairwise(seqs))


def test_what_the_vehicle_says_on_many_channels_is_counted_once():
    log = Log()
    for k in range(300):
        log.say(k & 0xFF, compid=1)
        log.say((k + 40) & 0xFF, compid=154)
    assert [frame.seq for frame in log.frames() if frame.compid == 154] == [k & 0xFF for k in range(300)]


def test_what_the_vehicle_says_is_not_made_into_a_frame_twice():
    log = Log()
    said = [log.say(k & 0xFF) for k in range(300)]
    assert all(logged is frame for logged, frame in zip(log.data, said, strict=True))


def test_a_signed_frame_of_the_vehicle_is_logged_unsigned():
    log = Log()
    log.say(0, flags=SIGNED_FLAG)
    (frame,) = log.frames()
    assert (frame.seq, frame.is_signed) == (0, False)


def test_one_client_on_two_channels_loses_nothing():
    log = Log()
    for k in range(300):
        log.hear(k & 0xFF, channel=0)
        log.hear((40 + k) & 0xFF, channel=1)
    assert log.lost() == 0
    assert [decode(frame).fields.time_usec for frame in log.frames()[:4]] == [1000, 1040, 1001, 1041]


def test_a_frame_in_step_is_logged_as_it_came():
    log = Log()
    raw = encode("PING", 255, 190, 77, time_usec=5)
    (frame,) = FrameReader().feed(raw)
    log.log.received(0, frame, 0)
    assert log.data == [raw]


def test_what_was_really_lost_stays_a_loss():
    log = Log()
    for seq in (10, 11, 15, 16):
        log.hear(seq, channel=0)
        log.hear(seq + 100, channel=1)
    assert log.lost() == 6


def test_clients_of_any_number_are_counted_within_bounds():
    log = Log()
    for k in range(2000):
        log.hear(k & 0xFF, channel=k, sysid=1 + k % 250, compid=k % 7)
    assert len(log.log._heard) <= 256
    assert len(log.log._seqs) <= 512
