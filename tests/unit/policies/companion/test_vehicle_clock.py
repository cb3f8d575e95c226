"""The vehicle's clock as its companion keeps it, over the end of 32 bits of milliseconds."""

import pytest

from autopilot.mavlink.transport.links import memory_pair
from autopilot.mavlink.wire.codec import encode
from policies.companion.vehicle_clock import SPAN_MS, VehicleClock
from policies.companion.vehicle_link import VehicleLink

DAY_MS = 86_400_000


def reported(*times_ms):
    clock = VehicleClock()
    return [clock.time_us(time_ms % SPAN_MS) // 1000 for time_ms in times_ms]


def test_time_goes_on_after_49_days():
    times_ms = [SPAN_MS - 40, SPAN_MS - 20, SPAN_MS, SPAN_MS + 20, SPAN_MS + 20 * DAY_MS, 3 * SPAN_MS // 2]
    assert reported(*times_ms) == times_ms


def test_messages_that_overtook_each_other_change_nothing():
    times_ms = [SPAN_MS - 20, SPAN_MS + 20, SPAN_MS - 10, SPAN_MS + 40, SPAN_MS + 30]
    assert reported(*times_ms) == times_ms


@pytest.mark.parametrize("up_ms", [60_000, 30 * DAY_MS, SPAN_MS + 5 * DAY_MS])
def test_a_restarted_vehicle_begins_anew(up_ms):
    clock = VehicleClock()
    clock.time_us(up_ms % SPAN_MS)
    clock.pictured(up_ms * 1000)
    assert clock.time_us(500) == 500_000


def test_who_comes_late_learns_the_time_from_a_picture():
    up_ms = 2 * SPAN_MS + 7 * DAY_MS
    clock = VehicleClock()
    assert clock.time_us(up_ms % SPAN_MS) == 7 * DAY_MS * 1000
    clock.pictured((up_ms + 100) * 1000)
    assert clock.time_us((up_ms + 20) % SPAN_MS) == (up_ms + 20) * 1000


def test_the_link_keeps_the_wide_time_and_sends_32_bits_of_it():
    end, companion_end = memory_pair()
    link = VehicleLink(companion_end)
    for time_ms in (SPAN_MS - 20, 0, 20):
        end.send(encode("ATTITUDE_QUATERNION", 1, 1, 0, time_boot_ms=time_ms, q1=1.0))
        link.receive(0)
    assert link.own.boot_us == (SPAN_MS + 20) * 1000
    link.send_setpoint((1.0, 0.0, 0.0), 0.0)
    assert end.receive()


@pytest.mark.parametrize("stamp_us", [1_764_400_000_000_000, 2**63 + 5, 2**64 - 1, 10 * SPAN_MS * 1000])
def test_a_picture_of_another_clock_changes_nothing(stamp_us):
    clock = VehicleClock()
    clock.time_us(60_000)
    clock.pictured(stamp_us)
    assert clock.time_us(60_020) == 60_020_000
