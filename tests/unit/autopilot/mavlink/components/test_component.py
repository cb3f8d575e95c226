"""A component besides the autopilot, on links whose clients come and go."""

from autopilot.mavlink.components.component import Component
from autopilot.mavlink.server import MavlinkServer
from autopilot.mavlink.transport.links import memory_pair
from autopilot.mavlink.wire.codec import known_type
from tests.unit.autopilot.mavlink.rig import AskedVehicle

_STATUS_ID = known_type("CAMERA_CAPTURE_STATUS").msg_id


class Visitors:
    """A source whose one client may leave."""

    def __init__(self, link):
        self.links = (link,)

    def poll(self, time_us):
        pass

    def close(self):
        pass


class Device(Component):
    def payloads(self):
        return {"CAMERA_CAPTURE_STATUS": lambda: b"\1"}


def test_intervals_of_a_client_that_has_gone_are_forgotten():
    vehicle_end, client_end = memory_pair()
    visitors = Visitors(vehicle_end)
    server = MavlinkServer(AskedVehicle(), [visitors])
    endpoint = server._endpoint
    device = Device(endpoint, 100, 30, "Camera")
    device.set_interval(endpoint.channels[0], _STATUS_ID, 100_000)

    def run(seconds):
        for _ in range(round(seconds * 50)):
            server.frame(endpoint.time_us + 20_000)
            device.frame()

    run(2.0)
    assert any(data[7] == _STATUS_ID & 0xFF and data[5:7] == b"\1\x64" for data in client_end.receive())
    visitors.links = ()
    run(2.0)
    assert device._intervals == []
    assert [data for data in client_end.receive() if data[6] == 100] == []
