"""Twenty clients, one of which floods the vehicle: the others must not notice."""

import numpy as np
import pytest

from autopilot.mavlink.server import MavlinkServer
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.codec import FrameReader, decode, encode
from tests.many_clients import CLIENTS, measure
from tests.unit.autopilot.mavlink.rig import FRAME_US, AskedVehicle

WORSE_MAX = 1.2
SETPOINT_FRAMES = 2  # 25 Hz


def lockstep(flood_per_frame, frames=500):
    """Frames to a command's acknowledgement, frames to a setpoint's arrival, and times of heartbeats [us]."""
    pairs = [memory_pair(LinkRole.GROUND) for _ in range(CLIENTS)]
    vehicle = AskedVehicle()
    server = MavlinkServer(vehicle, [vehicle_end for vehicle_end, _ in pairs])
    ends, readers = [client_end for _, client_end in pairs], [FrameReader() for _ in pairs]
    flooder, pilot = 7, 3
    ask = {"target_system": 1, "target_component": 1, "command": 512, "param1": 242.0}
    flood = [encode("COMMAND_LONG", 66, 190, i, **ask | {"command": 40_000 + i}) for i in range(256)]
    asked, latencies, setpoint_latencies, heartbeats = {}, [], [], []
    for k in range(frames):
        for i, end in enumerate(ends):
            if i == flooder:
                for n in range(flood_per_frame):
                    end.send(flood[n & 255])
            elif i not in asked and (k + i) % 5 == 0:
                end.send(encode("COMMAND_LONG", 100 + i, 190, 0, **ask))
                asked[i] = k
        if k % SETPOINT_FRAMES == 0:
            ends[pilot].send(
                encode("SET_POSITION_TARGET_LOCAL_NED", 103, 190, 0, time_boot_ms=k, target_system=1,
                       target_component=1, coordinate_frame=1, type_mask=0b110111111000, z=-10.0)
            )  # fmt: skip
        before = len(vehicle.setpoints)
        server.frame(5_000_000 + k * FRAME_US)
        if k % SETPOINT_FRAMES == 0:
            setpoint_latencies.append(0 if len(vehicle.setpoints) > before else 1)
        for i, end in enumerate(ends):
            for message in [decode(frame) for data in end.receive() for frame in readers[i].feed(data)]:
                if message.name == "COMMAND_ACK" and i != flooder:
                    latencies.append(k - asked.pop(i))
                elif message.name == "HEARTBEAT" and i == pilot and message.sysid == 1:
                    heartbeats.append(k * FRAME_US)
    return latencies, setpoint_latencies, np.diff(heartbeats)


def test_in_lockstep_the_others_notice_nothing_at_all():
    peace, flood = lockstep(0), lockstep(500)
    for calm, disturbed in zip(peace, flood, strict=True):
        assert len(calm) > 7
        np.testing.assert_array_equal(calm, disturbed)


@pytest.mark.slow  # half a minute of wall clock
def test_over_udp_the_others_hardly_notice(tmp_path):
    peace, flood = measure(tmp_path)
    assert len(peace.latencies_s) > 500
    assert flood.unanswered <= peace.unanswered
    assert flood.latency_s < WORSE_MAX * peace.latency_s
    frame_s = 0.02  # a heartbeat is sent in a frame: less than half of one cannot be told from chance
    assert flood.jitter_s < max(WORSE_MAX * peace.jitter_s, 0.5 * frame_s)
