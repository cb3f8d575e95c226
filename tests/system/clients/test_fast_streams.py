"""Messages more often than frames: what is acknowledged comes, each with its own time, and changes no flight."""

from collections import defaultdict
from math import nan

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.client_requests import TakeOff
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.codec import message_id
from mission.flight import Flight, FlightConfig
from sim.world.world import WorldConfig
from tests.unit.autopilot.mavlink.rig import Client

SECONDS = 8.0
PLAIN = WorldConfig(trees_per_ha=0.0, hill_height_m=0.0)


def flown(intervals_us):
    """A take-off, with messages at intervals: the history, what came from each, and how each was acknowledged."""
    vehicle_end, end = memory_pair(LinkRole.ONBOARD)
    flight = Flight(FlightConfig(seed=2, wind_m_s=5.0, world=PLAIN), links=[vehicle_end])
    client, came, acks = Client(end), defaultdict(list), []
    for name, interval_us in intervals_us.items():
        client.command(511, message_id(name), interval_us)
    flight.run(lambda flight: flight.controller.state.is_ready_to_arm)
    flight.controller.arm(force=False)
    flight.controller.request(TakeOff(flight.config.home.alt_m + 10.0, nan))
    client.received()
    end_us = flight.time_us + int(SECONDS * 1e6)
    while flight.time_us < end_us:
        flight.frame()
        for message in client.received():
            came[message.name].append(message.fields)
    for name in intervals_us:
        client.command(510, message_id(name))
        flight.frame()
        acks += [each.fields for each in client.received() if each.name == "MESSAGE_INTERVAL"]
    return flight.close(), came, acks


@pytest.fixture(scope="module")
def fast():
    return flown({"HIGHRES_IMU": 5_000, "ATTITUDE": 4_000, "ATTITUDE_QUATERNION": 10_000, "SCALED_IMU": 8_000})


def test_as_many_come_as_were_asked_for(fast):
    _, came, reported = fast
    for name, rate_hz in (("HIGHRES_IMU", 200), ("ATTITUDE", 250), ("ATTITUDE_QUATERNION", 100), ("SCALED_IMU", 125)):
        assert len(came[name]) == pytest.approx(rate_hz * SECONDS, abs=2), name
    assert [each.interval_us for each in reported] == [5_000, 4_000, 10_000, 8_000]


def test_each_has_its_own_time_and_its_own_sample(fast):
    _, came, _ = fast
    times = np.array([each.time_usec for each in came["HIGHRES_IMU"]])
    assert set(np.diff(times).tolist()) == {4_000, 8_000}  # 200 Hz out of ticks of 4 ms
    assert len({each.xacc for each in came["HIGHRES_IMU"]}) > 0.99 * len(times)
    assert set(np.diff([each.time_boot_ms for each in came["ATTITUDE"]]).tolist()) == {4}
    assert len({each.pitchspeed for each in came["ATTITUDE"][1000:]}) > 900


def test_the_flight_is_the_same_to_the_bit_as_without(fast):
    history, came, _ = flown({})
    assert len(came["ATTITUDE"]) == pytest.approx(50 * SECONDS, abs=2)
    count = len(history.time_us)
    for name in ("pos_ned_true", "q_true", "pos_ned_est", "vel_ned_est"):
        assert getattr(fast[0], name)[:count].tobytes() == getattr(history, name).tobytes(), name


@pytest.mark.parametrize(("name", "interval_us"), [("GPS_RAW_INT", 10_000), ("HIGHRES_IMU", 2_000)])
def test_what_cannot_be_sent_so_often_is_refused(name, interval_us):
    vehicle_end, end = memory_pair(LinkRole.ONBOARD)
    flight, client = Flight(FlightConfig(world=PLAIN), links=[vehicle_end]), Client(end)
    client.command(511, message_id(name), interval_us)
    flight.frame()
    (ack,) = [each.fields for each in client.received() if each.name == "COMMAND_ACK"]
    assert ack.result == mavlink.MAV_RESULT_DENIED
