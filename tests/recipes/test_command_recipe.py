"""The recipe "A MAVLink command" of CONTRIBUTING.md: a service and one line in the server."""

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot.mavlink.server import MavlinkServer
from docs.generate.mavlink_page import sections
from tests.recipes.parachute_command import ParachuteService
from tests.unit.autopilot.mavlink.rig import Rig, texts

PARACHUTE = mavlink.MAV_CMD_DO_PARACHUTE


@pytest.fixture
def rig(monkeypatch):
    services = MavlinkServer._services
    monkeypatch.setattr(
        MavlinkServer, "_services", lambda server: [*services(server), ParachuteService(server._endpoint)]
    )
    return Rig()


def test_a_command_is_not_supported_before_it_is_added():
    assert Rig().ack(PARACHUTE, 1.0).result == mavlink.MAV_RESULT_UNSUPPORTED


def test_a_command_that_is_added_is_carried_out_and_refused_with_a_reason(rig):
    rig.client.command(PARACHUTE, 2.0)
    messages = rig.frame()
    assert [m.fields.result for m in messages if m.name == "COMMAND_ACK"] == [mavlink.MAV_RESULT_TEMPORARILY_REJECTED]
    assert texts(messages) == ["DO_PARACHUTE: the parachute is safe"]
    assert rig.ack(PARACHUTE, 3.0).result == mavlink.MAV_RESULT_DENIED
    assert rig.ack(PARACHUTE, 1.0).result == mavlink.MAV_RESULT_ACCEPTED
    assert rig.ack(PARACHUTE, 2.0).result == mavlink.MAV_RESULT_ACCEPTED
    assert rig.vehicle.calls == [("terminate",)]


def test_the_page_of_commands_is_made_from_the_handler(rig):
    reported = sections(rig.server.command_handlers()[PARACHUTE])
    assert reported[""] == "Makes the parachute ready or safe, or releases it, which stops the motors."
    assert reported["Params"] == "p1 0 safe, 1 ready, 2 release."
    assert "released while it is safe" in reported["Refused"]
