from math import inf, nan

import pytest

from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from autopilot.mavlink.dialects.px4 import PX4
from tests.unit.autopilot.mavlink.rig import Rig

MOTOR_TEST, ACTUATOR_TEST = 209, 310
ACCEPTED, REJECTED, DENIED, UNSUPPORTED = range(4)


def asked(dialect, *params):
    rig = Rig(dialect=dialect)
    return rig.ack(MOTOR_TEST, *params).result, rig.vehicle.calls


@pytest.mark.parametrize(("motor", "rotor"), [(1, 0), (2, 3), (3, 1), (4, 2)])
def test_ardupilot_counts_motors_clockwise(motor, rotor):
    result, calls = asked(ARDUPILOT, motor, 0, 12.0, 5.0, 1, 0)
    assert (result, calls) == (ACCEPTED, [("spin", [rotor], 0.12, 5.0, 2.5)])


def test_ardupilot_counts_by_number_if_asked():
    assert asked(ARDUPILOT, 2, 0, 12.0, 5.0, 1, 2)[1][0][1] == [1]


def test_px4_counts_motors_by_their_numbers_and_turns_them_3_s_at_most():
    assert asked(PX4, 2, 0, 50.0, 10.0)[1] == [("spin", [1], 0.5, 3.0, 1.5)]
    assert asked(PX4, 2, 0, 50.0, 0.0)[1][0][3] == 3.0


def test_several_motors_follow_one_another():
    assert asked(ARDUPILOT, 1, 0, 10.0, 2.0, 4)[1] == [("spin", [0, 3, 1, 2], 0.1, 2.0, 1.0)]


def test_throttle_may_be_a_pulse():
    assert asked(ARDUPILOT, 1, 1, 1150.0, 2.0)[1][0][2] == pytest.approx(0.15)


@pytest.mark.parametrize("motor", [0.0, 5.0, -1.0, nan, 1.5])
def test_a_motor_there_is_not_is_denied(motor):
    assert asked(ARDUPILOT, motor, 0, 10.0, 1.0) == (DENIED, [])


def test_more_motors_than_there_are_is_denied():
    assert asked(ARDUPILOT, 3, 0, 10.0, 1.0, 3) == (DENIED, [])


@pytest.mark.parametrize("throttle_type", [2, 3, 7, nan])
def test_another_type_of_throttle_is_unsupported(throttle_type):
    assert asked(ARDUPILOT, 1, throttle_type, 10.0, 1.0) == (UNSUPPORTED, [])


def test_actuator_test_turns_a_motor():
    rig = Rig()
    assert rig.ack(ACTUATOR_TEST, 0.5, 1.0, 0.0, 0.0, 3).result == ACCEPTED
    assert rig.ack(ACTUATOR_TEST, nan, 1.0, 0.0, 0.0, 3).result == ACCEPTED
    assert rig.vehicle.calls == [("spin", [2], 0.5, 1.0, 0.0), ("spin", [2], 0.0, 0.0, 0.0)]


@pytest.mark.parametrize("function", [0, 17, 33, nan])
def test_actuator_test_turns_nothing_but_motors(function):
    rig = Rig()
    assert rig.ack(ACTUATOR_TEST, 0.5, 1.0, 0.0, 0.0, function).result == UNSUPPORTED
    assert not rig.vehicle.calls


def test_infinite_time_is_no_longer_than_the_longest():
    rig = Rig()
    assert rig.ack(MOTOR_TEST, 1, 0, 10.0, inf).result == DENIED  # infinite parameters are refused everywhere
