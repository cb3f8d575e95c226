"""Servos, relays, tunes, corrections and traffic over the link."""

from math import nan

import pytest

from autopilot.inputs.traffic import AIRCRAFT_MAX, CONFLICT_US, FORGOTTEN_US
from autopilot.interface.aircraft import Aircraft
from autopilot.interface.vehicle_state import WinchStatus
from autopilot.mavlink.wire.rtcm import FRAGMENT_LENGTH, RtcmAssembler, crc24q, is_rtcm
from autopilot.mavlink.wire.tune import TuneError, tune_length_s
from tests.unit.autopilot.mavlink.rig import HOME, AskedVehicle, Rig, texts

ACCEPTED, DENIED, UNSUPPORTED = 0, 2, 3
SET_RELAY, SET_SERVO, SET_ACTUATOR, GRIPPER, WINCH = 181, 183, 187, 211, 42600


def rtcm(length=40, kind=1005):
    body = (kind << 4).to_bytes(2, "big") + bytes(range(256)) * 4
    frame = bytes([0xD3]) + length.to_bytes(2, "big") + body[:length]
    return frame + crc24q(frame).to_bytes(3, "big")


def fragments(message, sequence=3):
    pieces = [message[i : i + FRAGMENT_LENGTH] for i in range(0, len(message), FRAGMENT_LENGTH)]
    if len(message) % FRAGMENT_LENGTH == 0 and len(pieces) < 4:
        pieces.append(b"")  # an empty one says that the full one before it was the last
    return [(1 | i << 1 | sequence << 3, piece) for i, piece in enumerate(pieces)]


def test_servo_relay_and_actuators_end_in_the_outputs():
    rig = Rig()
    assert rig.ack(SET_SERVO, 9.0, 1700.0).result == ACCEPTED
    assert rig.ack(SET_ACTUATOR, nan, -1.0, 0.5, nan, nan, nan, 0.0).result == ACCEPTED
    assert rig.ack(SET_RELAY, 2.0, 1.0).result == ACCEPTED
    state = rig.vehicle.state
    assert state.aux_pulses_us[:4] == (1700, 1000, 1750, 0)
    assert state.relays == 0b100
    rig.client.command(512, 36.0)
    output = rig.only("SERVO_OUTPUT_RAW")
    assert (output.servo9_raw, output.servo10_raw, output.servo11_raw) == (1700, 1000, 1750)
    assert rig.ack(SET_RELAY, 2.0, 0.0).result == ACCEPTED
    assert state.relays == 0


@pytest.mark.parametrize(
    ("command", "params"),
    [
        (SET_SERVO, (3.0, 1500.0)),  # a rotor's
        (SET_SERVO, (9.0, 100.0)),
        (SET_SERVO, (nan, 1500.0)),
        (SET_RELAY, (9.0, 1.0)),
        (SET_RELAY, (1.0, 7.0)),
        (SET_ACTUATOR, (1.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
        (SET_ACTUATOR, (0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0)),
    ],
)
def test_outputs_that_are_not_there_are_refused_with_a_reason(command, params):
    rig = Rig()
    rig.client.command(command, *params)
    messages = rig.frame()
    assert [m.fields.result for m in messages if m.name == "COMMAND_ACK"] == [DENIED]
    assert len(texts(messages)[0]) > 10


def test_devices_that_are_not_carried_are_unsupported():
    rig = Rig()
    assert rig.ack(GRIPPER, 0.0, 1.0).result == UNSUPPORTED


def test_winch_is_a_component_of_its_own():
    rig = Rig()
    rig.client.send("COMMAND_LONG", target_component=169, command=WINCH, param2=4.0)
    assert [m for m in rig.frame() if m.name == "COMMAND_ACK"] == []  # there is none

    vehicle = AskedVehicle()
    vehicle.state.read_winch = lambda: WinchStatus(1.5, 0.5, 0.1, 16.0, 2.0, 7)
    rig = Rig(vehicle=vehicle)
    messages = rig.frame(60)
    assert {m.compid for m in messages if m.name == "WINCH_STATUS"} == {169}
    assert {(m.fields.type, m.compid) for m in messages if m.name == "HEARTBEAT"} == {(2, 1), (42, 169)}
    rig.client.send("COMMAND_LONG", target_component=169, command=WINCH, param2=4.0)
    acks = [(m.compid, m.fields.result) for m in rig.frame() if m.name == "COMMAND_ACK"]
    assert acks == [(169, UNSUPPORTED)]  # this rig carries the status of a winch, but no winch


@pytest.mark.parametrize(
    ("tune", "notes", "length_s"),
    [
        ("C", 1, 0.5),
        ("MFT60L4CDE", 3, 3.0),
        ("T120 L8 O3 C# D- E. P8 <G2>", 4, 0.25 + 0.25 + 0.375 + 0.25 + 1.0),
        ("N24N0", 2, 1.0),
        ("MLT240L16CDEFGAB", 7, 7 * 0.0625),
    ],
)
def test_tunes_are_as_long_as_they_sound(tune, notes, length_s):
    assert tune_length_s(tune) == (notes, pytest.approx(length_s))


@pytest.mark.parametrize("tune", ["", "P4", "H", "T20C", "L99C", "C0", "O9C", "C" * 2000])
def test_what_is_no_tune_is_said_so(tune):
    with pytest.raises(TuneError, match=r"\w"):
        tune_length_s(tune)


def test_tune_is_played_and_another_format_refused():
    rig = Rig()
    rig.client.send("PLAY_TUNE", tune="MFT100", tune2="L8CDE")
    assert texts(rig.frame()) == ["Tune: 3 notes, 0.9 s"]
    rig.client.send("PLAY_TUNE_V2", format=2, tune="t1")
    assert "format 2" in texts(rig.frame())[0]
    rig.client.send("PLAY_TUNE_V2", format=1, tune="L4C")
    assert texts(rig.frame()) == ["Tune: 1 notes, 0.5 s"]


@pytest.mark.parametrize("length", [10, 180 - 6, 200, 360 - 6, 700])
def test_corrections_come_through_whole(length):
    message = rtcm(length)
    assembler = RtcmAssembler()
    if len(message) <= FRAGMENT_LENGTH:
        assert assembler.add(0, message) == message
    pieces = fragments(message)
    assert [assembler.add(*piece) for piece in pieces] == [None] * (len(pieces) - 1) + [message]
    shuffled = [*pieces[1:], pieces[0]]
    assert assembler.add(*shuffled[0]) is None or len(pieces) == 1
    assert message in [assembler.add(*piece) for piece in shuffled[1:]] or len(pieces) == 1


def test_damaged_or_mixed_corrections_are_dropped():
    message = rtcm(200)
    assembler = RtcmAssembler()
    first, second = fragments(message, 4)
    assert assembler.add(*first) is None
    assert assembler.add(*fragments(rtcm(300), 5)[1]) is None
    assert assembler.add(*second) is None  # the first half was of another message
    assert not is_rtcm(message[:-1] + b"\0")
    assert not is_rtcm(b"")
    assert not is_rtcm(b"\xd3")


def test_corrections_reach_the_receiver():
    rig = Rig()
    message = rtcm(60)
    rig.client.send("GPS_RTCM_DATA", flags=0, len=len(message), data=tuple(message.ljust(180, b"\0")))
    rig.frame()
    assert rig.vehicle.calls == [("give_corrections", message)]


def aircraft(icao=1, north_deg=0.0, alt_m=600.0):
    return Aircraft(icao, "HB-ABC", HOME.lat_deg + north_deg, HOME.lon_deg, alt_m, 1.0, 60.0, -1.0, 1, 7000)


def test_known_aircraft_are_told_once_a_second():
    rig = Rig()
    rig.vehicle.traffic.report(aircraft(icao=0x4B0001))
    rig.vehicle.state.nearest_aircraft = None
    seen = [m.fields for m in rig.frame(100) if m.name == "ADSB_VEHICLE"]
    assert len(seen) == 2
    assert (seen[0].ICAO_address, seen[0].callsign, seen[0].altitude) == (0x4B0001, "HB-ABC", 600_000)
    assert seen[0].hor_velocity == 6000


def test_aircraft_from_a_receiver_on_the_link_is_taken_in():
    rig = Rig()
    rig.client.send("ADSB_VEHICLE", ICAO_address=7, lat=470000000, lon=80000000, altitude=500_000, flags=3, tslc=1)
    rig.client.send("ADSB_VEHICLE", ICAO_address=8, lat=470000000, lon=80000000, altitude=500_000, flags=0, tslc=1)
    rig.frame()
    assert [each.icao for each in rig.vehicle.traffic.known()] == [7]


def test_near_aircraft_is_a_conflict_until_it_is_no_longer_reported():
    rig = Rig()
    state = rig.vehicle.state
    rig.vehicle.traffic.report(aircraft(north_deg=0.1))  # 11 km
    assert state.traffic_conflict_us == 0
    rig.vehicle.traffic.report(aircraft(north_deg=0.001, alt_m=5_000.0))
    assert state.traffic_conflict_us == 0
    rig.vehicle.traffic.report(aircraft(north_deg=0.001, alt_m=state.position.alt_m + 100.0))
    assert state.traffic_conflict_us == state.time_us + CONFLICT_US


def test_list_is_bounded_and_forgets():
    rig = Rig()
    for icao in range(AIRCRAFT_MAX + 20):
        rig.vehicle.traffic.report(aircraft(icao=icao))
    assert len(rig.vehicle.traffic.known()) == AIRCRAFT_MAX
    rig.vehicle.state.time_us += FORGOTTEN_US + 1
    assert rig.vehicle.traffic.known() == []
