"""Commands about mission, speed and heading: what reaches the vehicle, and what is refused."""

from math import isnan, nan

import pytest

from autopilot.interface.client_requests import ChangeSpeed, SetCurrentItem, StartMission
from autopilot.interface.vehicle_state import Reply, Verdict
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from tests.unit.autopilot.mavlink.rig import Rig, texts

ACCEPTED, TEMPORARILY_REJECTED, DENIED = 0, 1, 2


def test_speed():
    rig = Rig()
    assert rig.ack(178, 1.0, 4.0, -1.0).result == ACCEPTED
    assert rig.ack(178, 1.0, -1.0, -1.0).result == ACCEPTED  # no change
    assert rig.ack(178, 1.0, -2.0, -1.0).result == ACCEPTED  # default
    assert rig.ack(178, 2.0, 1.5, -1.0).result == ACCEPTED  # climb
    assert rig.ack(178, 3.0, 0.8, -1.0).result == ACCEPTED  # descent
    assert rig.ack(178, 4.0, 4.0, -1.0).result == DENIED
    assert rig.ack(178, 1.0, -5.0, -1.0).result == DENIED
    assert rig.vehicle.calls[0] == ChangeSpeed(4.0, 1)
    assert isnan(rig.vehicle.calls[1].speed_m_s)
    assert rig.vehicle.calls[2:] == [ChangeSpeed(1.5, 2), ChangeSpeed(pytest.approx(0.8), 3)]


def test_mission_commands():
    rig = Rig()
    rig.ack(300, 0.0, 0.0)
    rig.ack(300)
    rig.ack(300, 1.0, 3.0)
    rig.ack(193, 0.0)
    rig.ack(193, 1.0)
    rig.ack(224, 2.0)
    rig.ack(224, 2.0, 1.0)
    rig.ack(224, -1.0, 1.0)
    assert rig.vehicle.calls == [
        StartMission(0, -1),
        StartMission(-1, -1),
        StartMission(1, 3),
        ("pause",),
        ("resume",),
        SetCurrentItem(2),
        SetCurrentItem(2, True),
        SetCurrentItem(1, True),
    ]
    assert rig.ack(193, 5.0).result == DENIED
    assert rig.ack(224, -1.0).result == DENIED


def test_items_are_counted_from_home_in_ardupilots_dialect():
    rig = Rig(dialect=ARDUPILOT)
    rig.ack(300, 1.0, 3.0)
    assert rig.vehicle.calls == [StartMission(0, 2)]


def test_landing_sequence_return_path_and_aborted_landing():
    rig = Rig()
    for command, params in ((189, ()), (188, ()), (191, (12.0,))):
        assert rig.ack(command, *params).result == ACCEPTED
    assert rig.vehicle.calls == [("fly_landing_sequence",), ("fly_return_path",), ("abort_landing", 12.0)]
    rig.vehicle.reply = Reply(Verdict.TEMPORARILY_REJECTED, "not landing")
    rig.client.command(191, 0.0)
    assert "Abort landing: not landing" in texts(rig.frame())


def test_heading():
    rig = Rig()
    assert rig.ack(115, 90.0, 20.0, -1.0, 0.0).result == ACCEPTED
    assert rig.ack(115, 30.0, 0.0, 1.0, 1.0).result == ACCEPTED
    assert rig.vehicle.calls == [("turn", 90.0, 20.0, -1.0, False), ("turn", 30.0, 0.0, 1.0, True)]


@pytest.mark.parametrize(("command", "p1"), [(195, nan), (201, 3.0), (201, 0.0), (80, 3.0)])
def test_region_of_interest_at_a_place(command, p1):
    rig = Rig()
    assert rig.ack(command, p1, 0.0, 0.0, 0.0, 47.5, 8.5, 500.0).result == ACCEPTED
    assert rig.vehicle.calls == [("look_at", command, 47.5, 8.5, 500.0)]


@pytest.mark.parametrize(
    ("command", "params", "offset_deg"),
    [
        (197, (), 0.0),
        (201, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 0.0),
        (201, (1.0,), 0.0),
        (196, (0, 0, 0, 0, 0, 0, 45), 45),
    ],
)
def test_region_of_interest_ahead(command, params, offset_deg):
    rig = Rig()
    assert rig.ack(command, *map(float, params)).result == ACCEPTED
    assert rig.vehicle.calls == [("look_ahead", command, offset_deg)]


def test_region_of_interest_that_is_no_place_is_denied():
    rig = Rig()
    assert rig.ack(201, 2.0, 4.0).result == DENIED
    assert rig.vehicle.calls == []
