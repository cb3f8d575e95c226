"""What a ground station asks when it connects, in both dialects, of a whole vehicle on a memory link."""

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot.mavlink.transport.links import LinkRole, memory_pair
from mission.flight import Flight, FlightConfig
from tests.unit.autopilot.mavlink.rig import Client, texts

FRAMES_IN_100_MS = 5
REQUEST = mavlink.MAV_CMD_REQUEST_MESSAGE
UNSUPPORTED = mavlink.MAV_RESULT_UNSUPPORTED


class Station:
    """A ground station and the vehicle it talks to, in simulated time."""

    def __init__(self, dialect):
        vehicle_end, client_end = memory_pair(LinkRole.GROUND)
        self.flight = Flight(FlightConfig(dialect=dialect), links=[vehicle_end])
        self.client = Client(client_end)

    def hear(self, frames=FRAMES_IN_100_MS):
        messages = []
        for _ in range(frames):
            self.flight.frame()
            messages += self.client.received()
        return messages

    def request(self, command, *params):
        """What a command is answered with in 100 ms: the result, and the messages after the acknowledgement."""
        self.client.command(command, *params)
        messages = self.hear()
        (at,) = [i for i, each in enumerate(messages) if each.name == "COMMAND_ACK" and each.fields.command == command]
        return messages[at].fields.result, [message.name for message in messages[at + 1 :]]


@pytest.fixture(scope="module", params=["px4", "ardupilot"])
def station(request):
    """Ready to fly."""
    station = Station(request.param)
    station.hear(1500)
    return station


def test_station_is_greeted_and_told_that_the_vehicle_is_ready(station):
    station.client.send("HEARTBEAT", type=mavlink.MAV_TYPE_GCS, autopilot=mavlink.MAV_AUTOPILOT_INVALID)
    messages = station.hear(100)
    assert any(station.flight.config.dialect in text for text in texts(messages))
    status = [message.fields for message in messages if message.name == "SYS_STATUS"][-1]
    prearm = mavlink.MAV_SYS_STATUS_PREARM_CHECK
    assert status.onboard_control_sensors_enabled & status.onboard_control_sensors_health & prearm
    broken = status.onboard_control_sensors_enabled & ~status.onboard_control_sensors_health
    assert broken == 0
    assert status.onboard_control_sensors_health & mavlink.MAV_SYS_STATUS_GEOFENCE


def test_version_comes_after_its_acknowledgement(station):
    for command in ((REQUEST, 148.0), (520, 1.0)):
        result, after = station.request(*command)
        assert result == 0
        assert "AUTOPILOT_VERSION" in after


def test_modes_are_listed_whole(station):
    result, after = station.request(REQUEST, 435.0, 0.0)
    assert result == 0
    count = after.count("AVAILABLE_MODES")
    assert count > 8
    for i in range(1, count + 1):
        assert station.request(REQUEST, 435.0, float(i))[1].count("AVAILABLE_MODES") == 1


@pytest.mark.parametrize("msg_id", [300, 395])
def test_what_there_is_not_is_refused_at_once(station, msg_id):
    assert station.request(REQUEST, float(msg_id))[0] == UNSUPPORTED


@pytest.mark.parametrize(
    ("msg_id", "name"),
    [
        (242, "HOME_POSITION"), (49, "GPS_GLOBAL_ORIGIN"), (436, "CURRENT_MODE"), (437, "AVAILABLE_MODES_MONITOR"),
        (42, "MISSION_CURRENT"), (264, "FLIGHT_INFORMATION"), (193, "EKF_STATUS_REPORT"), (245, "EXTENDED_SYS_STATE"),
        (147, "BATTERY_STATUS"), (1, "SYS_STATUS"), (397, "COMPONENT_METADATA"),
    ],
)  # fmt: skip
def test_state_is_sent_on_request(station, msg_id, name):
    result, after = station.request(REQUEST, float(msg_id))
    assert result == 0
    assert name in after


def test_parameters_arrive_dense_and_complete(station):
    station.client.send("PARAM_REQUEST_LIST")
    values = [message.fields for message in station.hear(60) if message.name == "PARAM_VALUE"]
    assert [value.param_index for value in values] == list(range(values[0].param_count))


@pytest.mark.parametrize("mission_type", [0, 1, 2])
def test_empty_lists_are_counted(station, mission_type):
    station.client.send("MISSION_REQUEST_LIST", target_component=1, mission_type=mission_type)
    counts = [message.fields for message in station.hear() if message.name == "MISSION_COUNT"]
    assert [(count.count, count.mission_type) for count in counts] == [(0, mission_type)]


def test_streams_are_set_in_groups(station):
    for group, name in ((2, "SYS_STATUS"), (6, "GLOBAL_POSITION_INT"), (10, "ATTITUDE"), (11, "VFR_HUD")):
        station.client.send(
            "REQUEST_DATA_STREAM", target_component=1, req_stream_id=group, req_message_rate=10, start_stop=1
        )
        station.hear(50)
        count = sum(message.name == name for message in station.hear(50))
        assert 9 <= count <= 11


@pytest.mark.slow
@pytest.mark.parametrize("dialect", ["px4", "ardupilot"])
def test_every_command_number_is_acknowledged_exactly_once(dialect):
    """With parameters of 0, except those that restart, end or arm something: they come in other tests."""
    station = Station(dialect)
    station.hear(50)
    left_out = {246, 185, 400}
    for first in range(0, 65_536, 256):
        numbers = [number for number in range(first, first + 256) if number not in left_out]
        for number in numbers:
            station.client.command(number, *(0.0,) * 7)
        acks = [message.fields.command for message in station.hear(16) if message.name == "COMMAND_ACK"]
        assert acks == numbers
