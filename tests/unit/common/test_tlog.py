"""Telemetry logs, read back by pymavlink."""

from pymavlink import mavutil
from pymavlink.dialects.v20 import common as mavlink

from common.clock import SIMULATED_EPOCH_US
from common.logs.tlog import TlogWriter


def heartbeat(sender, custom_mode):
    message = mavlink.MAVLink_heartbeat_message(2, 12, 81, custom_mode, 4, 3)
    return message.pack(sender)


def test_pymavlink_reads_frames_and_times(tmp_path):
    path = tmp_path / "flight.tlog"
    sender = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    with TlogWriter(path) as log:
        for k in range(10):
            log.frame(k * 1_000_000, heartbeat(sender, k))
    reader = mavutil.mavlink_connection(str(path), dialect="common")
    messages = []
    while (message := reader.recv_msg()) is not None:
        messages.append(message)
    reader.close()
    assert [message.custom_mode for message in messages] == list(range(10))
    times_s = [round(message._timestamp - SIMULATED_EPOCH_US * 1e-6, 3) for message in messages]
    assert times_s == [float(k) for k in range(10)]


def test_a_record_is_the_time_then_the_frame(tmp_path):
    path = tmp_path / "flight.tlog"
    with TlogWriter(path) as log:
        log.frame(1_500_000, b"\xfdframe")
    assert path.read_bytes() == (SIMULATED_EPOCH_US + 1_500_000).to_bytes(8, "big") + b"\xfdframe"
