"""Termination over MAVLink, and who counts as a ground station."""

import pytest

from autopilot.vehicle import Mode, Reply, Verdict
from tests.unit.autopilot.mavlink.rig import Rig, texts

TERMINATE = 185
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
