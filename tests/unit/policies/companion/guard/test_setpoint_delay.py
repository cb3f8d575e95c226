"""How late setpoints are, over links with a delay, by the answers of a vehicle."""

import pytest

from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.codec import FrameReader, decode, encode
from mission.follow.late_link import LateLink
from policies.companion.guard.setpoint_delay import SetpointDelay
from policies.companion.vehicle_link import VehicleLink

FRAME_US = 20_000


def late_s(lag_s: float, *, answers: bool = True) -> float:
    """By what is measured in 5 s."""
    here, end = memory_pair(LinkRole.ONBOARD)
    time_us, reader, delay = 0, FrameReader(), SetpointDelay()
    link = VehicleLink(LateLink(here, lag_s, lambda: time_us) if lag_s > 0.0 else here)
    delay.attach(link)
    for time_us in range(0, 5_000_000, FRAME_US):
        asked = [decode(frame) for data in end.receive() for frame in reader.feed(data)]
        end.send(encode("TIMESYNC", 1, 1, 0, ts1=7))  # it asks, too
        for message in asked:
            if message.name == "TIMESYNC" and answers:
                end.send(encode("TIMESYNC", 1, 1, 0, tc1=time_us * 1000 + 1, ts1=message.fields.ts1))
        link.receive(time_us)
        delay.step(time_us)
    return delay.late_s


@pytest.mark.parametrize(
    ("lag_s", "measured_s"), [(0.0, 0.0), (0.02, 0.02), (0.08, 0.08), (0.2, 0.2), (0.5, 0.5), (0.62, 0.62), (2.0, 0.7)]
)
def test_a_late_link_is_known_by_the_vehicles_answers(lag_s: float, measured_s: float) -> None:
    assert late_s(lag_s) == pytest.approx(measured_s)


def test_who_does_not_answer_is_no_later_than_usual() -> None:
    assert late_s(0.2, answers=False) == 0.0
