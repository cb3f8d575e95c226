"""What a companion says comes late to the vehicle, in its order; what it hears does not."""

import numpy as np
import pytest

from autopilot.mavlink.transport.links import memory_pair
from common.kernels import FRAME_US
from mission.follow.late_link import LateLink
from tests.unit.mission.follow.follow_flight import following

UNDELAYED_FRAMES = 2  # one until the vehicle reads, one until it writes its setpoint


def arrivals(lag_s):
    """In which frame each of the pieces came that were sent one in each frame."""
    vehicle_end, companion_end = memory_pair()
    now_us, came = [0], {}
    link = LateLink(companion_end, lag_s, lambda: now_us[0])
    for frame in range(20):
        now_us[0] = frame * FRAME_US
        for data in vehicle_end.receive():  # the vehicle is first in a frame
            came[data[0]] = frame
        link.receive()
        link.send(bytes([frame]))
    return came


@pytest.mark.parametrize(("lag_s", "frames"), [(0.02, 1), (0.06, 3), (0.08, 4), (0.07, 4)])
def test_each_piece_comes_so_many_frames_late_and_in_its_order(lag_s, frames):
    came = arrivals(lag_s)
    assert list(came) == sorted(came)
    assert {there - sent for sent, there in came.items()} == {1 + frames}
    assert len(came) == 20 - 1 - frames


def test_what_the_companion_hears_is_not_late():
    vehicle_end, companion_end = memory_pair()
    link = LateLink(companion_end, 0.08, lambda: 0)
    vehicle_end.send(b"telemetry")
    assert list(link.receive()) == [b"telemetry"]


@pytest.mark.parametrize("lag_s", [0.0, 0.04, 0.08])
def test_setpoints_of_a_flight_are_flown_so_much_later(lag_s):
    flight, companion = following(numbers={"setpoint_lag_s": lag_s})
    row = flight.rig.rows["autopilot.setpoint"][0]
    asked_us, flown_us = {}, {}  # when each velocity was for the first time

    def look(_):
        asked_us.setdefault(tuple(np.float32(companion._setpoint[0])), flight.time_us)
        flown_us.setdefault(tuple(row["vel_ned"].tolist()), flight.time_us)

    end_us = flight.time_us + 1_000_000
    flight.run(lambda _: flight.time_us >= end_us, on_frame=look)
    flight.close()
    late_us = {flown_us[vel_ned] - us for vel_ned, us in list(asked_us.items())[1:-2]}  # the first is older
    assert len(asked_us) > 8
    assert late_us == {round(lag_s * 1e6) + UNDELAYED_FRAMES * FRAME_US}
