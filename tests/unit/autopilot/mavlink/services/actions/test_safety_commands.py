"""Termination over MAVLink, and who counts as a ground station."""

import pytest

from autopilot.interface.vehicle_state import Mode, Reply, Verdict
from autopilot.vehicles.multirotor.vehicle import MULTIROTOR
from common.airframe import load_airframe
from tests.unit.autopilot.mavlink.rig import Rig, texts

TERMINATE = 185
INJECT_FAILURE = 420
GNSS, RC_SIGNAL, MAVLINK_SIGNAL = 4, 104, 105  # FAILURE_UNIT
OK, OFF, STUCK = 0, 1, 2  # FAILURE_TYPE
GCS, ONBOARD_CONTROLLER = 6, 18
FLIGHT_TERMINATION = 8  # MAV_STATE


def test_termination_is_asked_of_the_vehicle():
    rig = Rig()
    assert rig.ack(TERMINATE, 1.0).result == Verdict.ACCEPTED
    assert rig.vehicle.calls == [("terminate",)]


@pytest.mark.parametrize("p1", [0.0, float("nan")])
def test_termination_cannot_be_taken_back(p1):
    rig = Rig()
    assert rig.ack(TERMINATE, p1).result == Verdict.DENIED
    assert rig.vehicle.calls == []


def test_refused_termination_says_why():
    rig = Rig()
    rig.vehicle.reply = Reply(Verdict.TEMPORARILY_REJECTED, "not armed")
    rig.client.command(TERMINATE, 1.0)
    assert any("not armed" in text for text in texts(rig.frame()))


def test_terminated_vehicle_says_so_in_its_heartbeat():
    rig = Rig()
    rig.update(mode=Mode.TERMINATION)
    assert rig.all("HEARTBEAT", 60)[0].system_status == FLIGHT_TERMINATION


@pytest.mark.parametrize(("kind", "is_station"), [(GCS, True), (ONBOARD_CONTROLLER, False)])
def test_heartbeat_of_a_ground_station_keeps_its_link_alive(kind, is_station):
    rig = Rig()
    rig.client.send("HEARTBEAT", type=kind, autopilot=8, mavlink_version=3)
    rig.frame()
    assert (rig.vehicle.station.heard_us == rig.time_us) == is_station


def test_failure_is_asked_of_the_vehicle():
    rig = Rig()
    assert rig.ack(INJECT_FAILURE, GNSS, STUCK, 1.0).result == Verdict.ACCEPTED
    assert rig.ack(INJECT_FAILURE, GNSS, OK).result == Verdict.ACCEPTED
    assert rig.vehicle.calls == [("inject_failure", GNSS, STUCK, 1), ("inject_failure", GNSS, OK, 0)]


def test_lost_radio_is_silent_and_its_heartbeats_keep_no_link_alive():
    rig = Rig()
    assert rig.ack(INJECT_FAILURE, MAVLINK_SIGNAL, OFF).result == Verdict.DENIED  # SYS_FAILURE_EN is 0
    rig.vehicle.params.set("SYS_FAILURE_EN", 1)
    assert rig.ack(INJECT_FAILURE, MAVLINK_SIGNAL, STUCK).result == Verdict.UNSUPPORTED
    assert rig.ack(INJECT_FAILURE, MAVLINK_SIGNAL, OFF).result == Verdict.ACCEPTED
    rig.second_client.received()
    rig.client.send("HEARTBEAT", type=GCS, autopilot=8, mavlink_version=3)
    assert rig.frame(100) == []
    assert rig.second_client.received() == []
    assert rig.vehicle.station.heard_us == -1
    assert rig.ack(INJECT_FAILURE, MAVLINK_SIGNAL, OK).result == Verdict.ACCEPTED
    assert rig.frame(100)


def test_sticks_are_cut_off_and_given_back():
    rig = Rig()
    rig.vehicle.params.set("SYS_FAILURE_EN", 1)
    assert rig.ack(INJECT_FAILURE, RC_SIGNAL, OFF).result == Verdict.ACCEPTED
    assert rig.vehicle.sticks.is_cut
    assert rig.ack(INJECT_FAILURE, RC_SIGNAL, OK).result == Verdict.ACCEPTED
    assert not rig.vehicle.sticks.is_cut


@pytest.mark.parametrize("mav_type", [2, 10, 13])
def test_heartbeat_tells_the_kind_of_vehicle(mav_type):
    rig = Rig()
    rig.update(mav_type=mav_type)
    assert rig.all("HEARTBEAT", 60)[0].type == mav_type


@pytest.mark.parametrize(("airframe", "mav_type"), [("x500", 2), ("f450", 2), ("f550", 13)])
def test_a_multirotors_kind_is_the_number_of_its_rotors(airframe, mav_type):
    assert MULTIROTOR.mav_type(load_airframe(airframe)) == mav_type
