"""Signatures as pymavlink makes and checks them, and the rules about replays, keys and unsigned frames."""

import os

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot.mavlink.server import MavlinkServer
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.codec import FrameReader, encode
from autopilot.mavlink.wire.signing import (
    EPOCH_UNIX_US,
    MINUTE_TICKS,
    STREAMS_MAX,
    FileStore,
    MemoryStore,
    SigningConfig,
    SigningState,
)
from common.clock import SIMULATED_EPOCH_US
from tests.unit.autopilot.mavlink.rig import FRAME_US, AskedVehicle

KEY = bytes(range(32))
NOW = (SIMULATED_EPOCH_US - EPOCH_UNIX_US) // 10  # [10 us]
ARM = {"target_system": 1, "target_component": 1, "command": 400, "param1": 1.0}


class OuterLink:
    """A memory link as if it came from another process, or another machine."""

    keeps_datagrams = False
    is_internal = False
    role = LinkRole.GROUND

    def __init__(self, inner, is_trusted):
        self.is_trusted = is_trusted
        self.receive, self.send, self.close = inner.receive, inner.send, inner.close


class Station:
    """A pymavlink client with a key, and the vehicle it speaks to."""

    def __init__(self, *, is_trusted=True, is_required=False, key=b"", store=None):
        self.time_us = 5_000_000
        self.store = store or MemoryStore(SigningState(key, 0))
        vehicle_end, self.end = memory_pair()
        self.vehicle = AskedVehicle()
        self.log = []
        self.server = MavlinkServer(
            self.vehicle,
            [OuterLink(vehicle_end, is_trusted)],
            on_frame=lambda _, data: self.log.append(data),
            signing=SigningConfig(self.store, lambda: SIMULATED_EPOCH_US + self.time_us, is_required),
        )
        self.mav = mavlink.MAVLink(self, 255, 190)
        self.mav.robust_parsing = True

    def sign(self, key=KEY, timestamp=NOW):
        signing = self.mav.signing
        signing.secret_key, signing.link_id, signing.sign_outgoing, signing.timestamp = key, 3, True, timestamp
        signing.allow_unsigned_callback = lambda *_: False

    def write(self, data):
        self.end.send(bytes(data))

    def frame(self):
        """What pymavlink makes of what the vehicle sends in a frame."""
        self.time_us += FRAME_US
        self.server.frame(self.time_us)
        data = b"".join(self.end.receive())
        return self.mav.parse_buffer(data) or []

    def arms(self):
        """Whether the vehicle obeys."""
        before = len(self.vehicle.calls)
        self.mav.command_long_send(1, 1, 400, 0, 1.0, 0, 0, 0, 0, 0, 0)
        self.frame()
        return len(self.vehicle.calls) > before

    def set_up(self, key=KEY):
        self.mav.setup_signing_send(1, 1, list(key), NOW)
        return self.frame()


def texts(messages):
    return [message.text for message in messages if message.get_type() == "STATUSTEXT"]


def test_pymavlink_takes_what_we_sign_and_we_take_what_it_signs():
    station = Station(key=KEY)
    station.sign()
    messages = [message for _ in range(5) for message in station.frame()]
    assert len(messages) > 10
    assert not [message for message in messages if message.get_type() == "BAD_DATA"]
    assert all(message.get_signed() for message in messages)
    assert station.mav.signing.sig_count == len(messages)
    assert station.mav.signing.badsig_count == 0
    assert station.arms()


def test_pymavlinks_own_setup_turns_signing_on_and_off():
    station = Station()
    assert not any(message.get_signed() for message in station.frame())
    assert "Signing: on" in texts(station.set_up())
    station.sign()
    assert all(message.get_signed() for message in station.frame())
    assert station.store.load().key == KEY
    station.mav.signing.allow_unsigned_callback = lambda *_: True
    assert "Signing: off" in texts(station.set_up(bytes(32)))
    assert not any(message.get_signed() for message in station.frame())
    assert station.store.load().key == b""


def test_key_is_not_taken_from_another_machine_and_not_logged():
    station = Station(is_trusted=False)
    assert any("this machine" in text for text in texts(station.set_up()))
    assert station.store.load().key == b""
    assert not any(KEY in data for data in station.log)


@pytest.mark.parametrize("time", [(1 << 64) - 1, (1 << 48) - 1, 1 << 47])
def test_key_with_an_absurd_time_works_all_the_same(time):
    station = Station()
    station.mav.setup_signing_send(1, 1, list(KEY), time)
    station.frame()
    station.sign()
    assert all(message.get_signed() for message in station.frame())
    assert station.arms()
    assert max(timestamps(station)) < NOW + MINUTE_TICKS  # its clock has not gone to where it would stand still


def test_wrong_key_is_refused():
    station = Station(key=KEY)
    station.sign(key=bytes(31) + b"x")
    assert not station.arms()


def test_replayed_and_reordered_frames_are_refused():
    station = Station(key=KEY)
    station.sign()
    frame = station.mav.command_long_encode(1, 1, 400, 0, 1.0, 0, 0, 0, 0, 0, 0).pack(station.mav)
    later = station.mav.command_long_encode(1, 1, 400, 0, 1.0, 0, 0, 0, 0, 0, 0).pack(station.mav)
    for data, count in ((later, 1), (later, 1), (frame, 1)):
        station.write(data)
        station.frame()
        assert len(station.vehicle.calls) == count


@pytest.mark.parametrize(("age", "is_taken"), [(MINUTE_TICKS - 1_000_000, True), (MINUTE_TICKS + 1_000_000, False)])
def test_new_stream_older_than_a_minute_is_refused(age, is_taken):
    station = Station(key=KEY)
    station.sign(timestamp=NOW - age)
    assert station.arms() is is_taken


def test_our_clock_rises_to_the_latest_heard_and_is_kept():
    station = Station(key=KEY)
    ahead = NOW + 50 * MINUTE_TICKS
    station.sign(timestamp=ahead)
    assert station.arms()
    station.frame()
    station.server.close()
    assert station.store.load().timestamp >= ahead
    after = Station(store=station.store)
    after.sign(timestamp=ahead - 2 * MINUTE_TICKS)
    assert not after.arms()


@pytest.mark.parametrize(
    ("is_trusted", "key", "is_required", "is_taken"),
    [
        (True, b"", False, True),
        (False, b"", False, True),
        (True, KEY, False, True),
        (False, KEY, False, False),
        (True, KEY, True, False),
        (True, b"", True, False),
    ],
)
def test_unsigned_frames_are_taken_where_they_may_be(is_trusted, key, is_required, is_taken):
    station = Station(is_trusted=is_trusted, key=key, is_required=is_required)
    assert station.arms() is is_taken
    station.mav.signing.allow_unsigned_callback = None


def test_refusal_of_unsigned_frames_is_said_once():
    station = Station(is_required=True)
    said = []
    for _ in range(100):
        station.mav.heartbeat_send(6, 8, 0, 0, 0)
        said += texts(station.frame())
    assert said == ["Signing: unsigned messages are refused"]


def test_first_key_can_be_given_where_signing_is_required():
    station = Station(is_required=True)
    station.set_up()
    assert not station.arms()
    station.sign()
    assert station.arms()


def test_mavlink_1_counts_as_unsigned():
    station = Station(is_required=True, key=KEY)
    station.sign()
    arm = station.mav.command_long_encode(1, 1, 400, 0, 1.0, 0, 0, 0, 0, 0, 0)
    station.write(arm.pack(station.mav, force_mavlink1=True))
    station.frame()
    assert station.vehicle.calls == []


def test_radio_may_not_know_the_key():
    station = Station(is_required=True, key=KEY)
    station.write(encode("RADIO_STATUS", 51, 68, 0, rssi=100))
    for _ in range(5):
        station.frame()
    assert (51, 68) in station.server._endpoint.channels[0].heard._sources


def test_script_in_our_process_needs_no_signature():
    vehicle_end, client_end = memory_pair()
    vehicle = AskedVehicle()
    config = SigningConfig(MemoryStore(SigningState(KEY, 0)), lambda: SIMULATED_EPOCH_US, is_required=True)
    server = MavlinkServer(vehicle, [vehicle_end], signing=config)
    client_end.send(encode("COMMAND_LONG", 245, 190, 0, **ARM))
    server.frame(FRAME_US)
    assert vehicle.calls == [("arm", False)]
    frames = [frame for data in client_end.receive() for frame in FrameReader().feed(data)]
    assert frames
    assert all(frame.is_signed for frame in frames)


def test_signatures_of_a_lockstep_flight_are_the_same_each_time():
    def sent():
        vehicle_end, client_end = memory_pair()
        server = MavlinkServer(AskedVehicle(), [vehicle_end])
        client_end.send(encode("SETUP_SIGNING", 255, 190, 0, target_system=1, secret_key=tuple(KEY)))
        for i in range(20):
            server.frame(i * FRAME_US)
        return list(client_end.receive())

    assert sent() == sent()


def test_key_file_is_private_whole_and_checked(tmp_path):
    path = tmp_path / "signing.json"
    store = FileStore(path)
    assert store.load() == SigningState()
    store.save(SigningState(KEY, 77))
    assert FileStore(path).load() == SigningState(KEY, 77)
    assert path.stat().st_mode & 0o077 == 0
    for time in (0, (1 << 48) - 1):  # the first and the last that a signature can carry
        store.save(SigningState(KEY, time))
        assert store.load().timestamp == time
    left = tmp_path / "signing.json.part"
    left.touch(mode=0o644)  # by a killed process
    left.chmod(0o644)
    store.save(SigningState(KEY, 78))
    assert path.stat().st_mode & 0o077 == 0
    good = f'"key": "{KEY.hex()}"'
    for rubbish in (
        "", "{}", '{"key": "00", "timestamp": 1}', '{"key": "", "timestamp": -1}', "[1]", "3", "[" * 100_000,
        f"{{{good}, \"timestamp\": {1 << 48}}}", f"{{{good}, \"timestamp\": 1e400}}",
        f"{{{good}, \"timestamp\": NaN}}", f"{{{good}, \"timestamp\": {10**400}}}",
    ):  # fmt: skip
        path.write_text(rubbish)
        with pytest.raises(ValueError, match="is no signing key"):
            store.load()


def signed_command(station):
    return bytes(station.mav.command_long_encode(1, 1, 400, 0, 1.0, 0, 0, 0, 0, 0, 0).pack(station.mav))


@pytest.mark.parametrize("i_byte", range(1, 7))
def test_every_byte_of_a_signature_counts(i_byte):
    station = Station(key=KEY)
    station.sign()
    frame = bytearray(signed_command(station))
    frame[-i_byte] ^= 0x01
    station.write(frame)
    station.frame()
    assert station.vehicle.calls == []


def test_streams_are_remembered_up_to_a_number_and_no_more_are_let_in():
    station = Station(key=KEY)
    station.sign()
    taken = 0
    for i in range(STREAMS_MAX + 10):
        station.mav.srcSystem, station.mav.srcComponent = 100 + i // 200, 1 + i % 200
        taken += station.arms()
    assert taken == STREAMS_MAX
    station.mav.srcSystem, station.mav.srcComponent = 100, 1
    assert station.arms()  # one of them still is


def timestamps(station, frames=100):
    """Of what the vehicle signs."""
    found = []
    for _ in range(frames):
        station.time_us += FRAME_US
        station.server.frame(station.time_us)
        raw = [frame.raw for data in station.end.receive() for frame in FrameReader().feed(data)]
        found += [int.from_bytes(each[-12:-6], "little") for each in raw]
    return found


@pytest.mark.parametrize("is_killed", [True, False])
def test_no_time_is_signed_twice_over_a_restart_even_if_the_clock_stands(is_killed):
    station = Station(key=KEY)
    sent = timestamps(station)
    if not is_killed:
        station.server.close()
    after = Station(store=station.store)
    assert min(timestamps(after)) > max(sent)


@pytest.mark.parametrize("is_killed", [True, False])
def test_no_frame_is_believed_again_after_a_restart(is_killed):
    station = Station(key=KEY)
    station.frame()
    station.sign(timestamp=NOW + 5 * MINUTE_TICKS // 6)  # later than what has been stored so far
    frames = [signed_command(station) for _ in range(3)]
    for frame in frames:
        station.write(frame)
        station.frame()
    assert len(station.vehicle.calls) == 3
    if not is_killed:
        station.server.close()
    after = Station(store=station.store)
    for frame in frames:
        after.write(frame)
        after.frame()
    assert after.vehicle.calls == []
    after.sign(timestamp=max(timestamps(after, 5)))  # a station follows the clock that it hears
    assert after.arms()


def test_no_frame_is_believed_again_after_the_same_key_is_set_again():
    station = Station(key=KEY)
    station.sign()
    frame = signed_command(station)
    station.write(frame)
    station.frame()
    station.set_up(KEY)
    station.write(frame)
    station.frame()
    assert len(station.vehicle.calls) == 1


def test_key_is_on_the_disk_when_it_is_stored(tmp_path, monkeypatch):
    synced = []
    monkeypatch.setattr(os, "fsync", lambda descriptor: synced.append(os.fstat(descriptor).st_ino))
    path = tmp_path / "signing.json"
    FileStore(path).save(SigningState(KEY, 77))
    assert synced == [path.stat().st_ino, tmp_path.stat().st_ino]
