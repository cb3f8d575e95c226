"""What a companion believes of its vehicle's mode, by heartbeats and by answers to its own requests."""

from math import inf, isnan, nan

import pytest

from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.mavlink.transport.links import memory_pair
from autopilot.mavlink.wire.codec import encode
from policies.companion.engagement import Wish
from policies.companion.telemetry import RANGE_OLD_US
from policies.companion.vehicle_link import COMPONENT, VehicleLink


@pytest.fixture
def vehicle():
    """Its end of the link, with the companion's."""
    end, companion_end = memory_pair()
    link = VehicleLink(companion_end)
    tell(end, link, "HEARTBEAT", autopilot=int(PX4.autopilot), custom_mode=PX4.custom_mode(Mode.HOLD), base_mode=128)
    return end, link


def tell(end, link, name, **fields):
    end.send(encode(name, 1, 1, 0, **fields))
    link.receive(0)


def answer(end, link, result, target_component=COMPONENT):
    tell(end, link, "COMMAND_ACK", command=176, result=result, target_component=target_component)


def test_a_mode_that_was_asked_for_is_known_with_the_answer(vehicle):
    end, link = vehicle
    link.ask_for(Wish.OFFBOARD)
    assert link.own.mode is Mode.HOLD
    answer(end, link, 0)
    assert link.own.mode is Mode.OFFBOARD
    assert not link.take_refusal()
    tell(end, link, "HEARTBEAT", autopilot=int(PX4.autopilot), custom_mode=PX4.custom_mode(Mode.LAND))
    assert link.own.mode is Mode.LAND


def test_a_refusal_changes_no_mode(vehicle):
    end, link = vehicle
    link.ask_for(Wish.OFFBOARD)
    answer(end, link, 2)
    assert link.own.mode is Mode.HOLD
    assert link.take_refusal()


def test_answers_to_others_say_nothing(vehicle):
    end, link = vehicle
    link.ask_for(Wish.OFFBOARD)
    answer(end, link, 0, target_component=190)
    assert link.own.mode is Mode.HOLD


def test_an_old_request_is_not_answered_twice(vehicle):
    end, link = vehicle
    link.ask_for(Wish.OFFBOARD)
    answer(end, link, 0)
    tell(end, link, "HEARTBEAT", autopilot=int(PX4.autopilot), custom_mode=PX4.custom_mode(Mode.HOLD))
    answer(end, link, 0)
    assert link.own.mode is Mode.HOLD


def test_an_answer_to_everybody_says_nothing_of_the_mode(vehicle):
    end, link = vehicle
    link.ask_for(Wish.OFFBOARD)
    answer(end, link, 0, target_component=0)
    assert link.own.mode is Mode.HOLD


PLACE = {"lat": 473977420, "lon": 85455940, "alt": 488.0, "est_capabilities": 3}


@pytest.fixture
def followed(vehicle):
    end, link = vehicle
    tell(end, link, "GPS_GLOBAL_ORIGIN", latitude=473977420, longitude=85455940, altitude=488_000)
    return end, link


@pytest.mark.parametrize("speed", [inf, -inf, 3.4e38, 1e30])
def test_owner_of_a_speed_that_nobody_has_is_not_believed(followed, speed):
    end, link = followed
    tell(end, link, "FOLLOW_TARGET", **PLACE, vel=(0.0, speed, 0.0))
    assert link.owner.count == 0


def test_owner_without_a_velocity_is_still_a_place(followed):
    end, link = followed
    tell(end, link, "FOLLOW_TARGET", **PLACE, vel=(nan, 1.0, 0.0), position_cov=(3.4e38, 0.0, 0.0))
    assert link.owner.count == 1
    assert link.owner.vel_ned == (0.0, 0.0, 0.0)
    assert link.owner.std_m != link.owner.std_m


@pytest.mark.parametrize("value", [nan, inf, 3.4e38])
def test_telemetry_that_is_no_number_changes_nothing(vehicle, value):
    end, link = vehicle
    tell(end, link, "ATTITUDE_QUATERNION", q1=1.0, yawspeed=0.5)
    tell(end, link, "LOCAL_POSITION_NED", x=1.0, vx=2.0)
    reported = (link.own.pos_ned, link.own.vel_ned, link.own.q_ned_from_frd, link.own.omega_frd)
    tell(end, link, "ATTITUDE_QUATERNION", q1=value)
    tell(end, link, "ATTITUDE_QUATERNION", q1=1.0, rollspeed=value)
    tell(end, link, "LOCAL_POSITION_NED", x=value)
    tell(end, link, "LOCAL_POSITION_NED", vz=value)
    assert reported == (link.own.pos_ned, link.own.vel_ned, link.own.q_ned_from_frd, link.own.omega_frd)


def test_a_failsafe_is_known_by_the_heartbeat_that_brings_its_mode(vehicle):
    end, link = vehicle
    land = {"autopilot": int(PX4.autopilot), "custom_mode": PX4.custom_mode(Mode.LAND), "base_mode": 128}
    tell(end, link, "HEARTBEAT", **land, system_status=5)
    assert (link.own.mode, link.own.is_failsafe) == (Mode.LAND, True)
    tell(end, link, "HEARTBEAT", **land, system_status=4)
    assert not link.own.is_failsafe


@pytest.mark.parametrize(
    ("landed_state", "is_on_ground", "is_landing"), [(1, True, False), (2, False, False), (4, True, True)]
)
def test_who_lands_is_not_down_yet(vehicle, landed_state, is_on_ground, is_landing):
    end, link = vehicle
    tell(end, link, "EXTENDED_SYS_STATE", landed_state=landed_state)
    assert (link.own.is_on_ground, link.own.is_landing) == (is_on_ground, is_landing)


def test_health_battery_and_emergencies_are_heard(vehicle):
    end, link = vehicle
    tell(end, link, "SYS_STATUS", onboard_control_sensors_health=0b101)
    tell(end, link, "BATTERY_STATUS", charge_state=1)
    assert (link.own.health, link.own.is_battery_low) == (0b101, False)
    tell(end, link, "BATTERY_STATUS", charge_state=2)
    assert link.own.is_battery_low
    tell(end, link, "STATUSTEXT", severity=2, text="Position lost: land")
    assert link.own.alarm_us < 0
    tell(end, link, "STATUSTEXT", severity=0, text="Motor failure")
    assert link.own.alarm_us == 0


def test_any_battery_that_is_low_counts(vehicle):
    end, link = vehicle
    tell(end, link, "BATTERY_STATUS", id=0, charge_state=2)
    tell(end, link, "BATTERY_STATUS", id=1, charge_state=1)
    assert link.own.is_battery_low
    tell(end, link, "BATTERY_STATUS", id=0, charge_state=1)
    assert not link.own.is_battery_low


def test_home_is_asked_for_by_the_vehicles_own_return(vehicle):
    end, link = vehicle
    end.receive()
    link.ask_for(Wish.RETURN)
    answer(end, link, 0)
    assert link.own.mode is Mode.RETURN


def test_an_attitude_that_was_overtaken_is_no_news_and_no_restart(vehicle):
    end, link = vehicle
    for time_ms, roll_rate in ((20_000, 0.1), (19_960, 0.2)):
        tell(end, link, "ATTITUDE_QUATERNION", time_boot_ms=time_ms, q1=1.0, rollspeed=roll_rate)
        assert link.own.boot_us == 20_000_000
        assert link.own.omega_frd[0] == pytest.approx(0.1)
    tell(end, link, "ATTITUDE_QUATERNION", time_boot_ms=12_000, q1=1.0)  # it has restarted, and been up for as long
    assert link.own.boot_us == 12_000_000


def test_the_older_of_attitude_and_position_says_how_late_telemetry_is(vehicle):
    end, link = vehicle
    tell(end, link, "ATTITUDE_QUATERNION", q1=1.0)
    assert link.own.late_s > 1e6
    tell(end, link, "LOCAL_POSITION_NED", x=1.0)
    assert link.own.late_s == 0.0
    link.receive(300_000)
    assert link.own.late_s == pytest.approx(0.3)


def test_a_range_finder_that_falls_silent_tells_no_height(vehicle):
    end, link = vehicle
    tell(end, link, "ATTITUDE_QUATERNION", q1=1.0)
    tell(end, link, "DISTANCE_SENSOR", orientation=25, min_distance=10, max_distance=1200, current_distance=160)
    assert link.own.height_m == pytest.approx(1.6)
    link.receive(RANGE_OLD_US - 1)
    assert link.own.height_m == pytest.approx(1.6)
    link.receive(RANGE_OLD_US)
    assert isnan(link.own.height_m)
