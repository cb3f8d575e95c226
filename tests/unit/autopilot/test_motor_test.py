"""The motor test: which rotor turns when, and when none may."""

from math import inf, nan

import pytest

from autopilot.interface.vehicle_state import LandedState, Verdict
from autopilot.vehicles.multirotor.vehicle import MULTIROTOR
from common.airframe import load_airframe
from tests.unit.autopilot.kinematic import Kinematic


def commands(rig):
    return [round(float(value), 3) for value in rig.setpoint["motor_test"][0]]


@pytest.fixture
def rig():
    rig = Kinematic()
    rig.run(5.0)
    return rig


def test_one_motor_turns_for_its_time_and_no_longer(rig):
    assert rig.fc.motor_test.spin([2], 0.3, 1.0).verdict is Verdict.ACCEPTED
    rig.run(0.9)
    assert commands(rig) == [0.0, 0.0, 0.3] + [0.0] * 5
    rig.run(0.2)
    assert commands(rig) == [0.0] * 8
    assert rig.recorder.has_text("Motor test: finished")


def test_motors_follow_one_another_with_pauses(rig):
    rig.fc.motor_test.spin([0, 3], 0.2, 1.0, pause_s=0.5)
    turning = []
    for _ in range(30):
        rig.run(0.1)
        turning.append(tuple(i for i, command in enumerate(commands(rig)) if command))
    assert turning[5] == (0,)
    assert turning[12] == ()
    assert turning[20] == (3,)
    assert turning[28] == ()


def test_arming_ends_the_test(rig):
    rig.fc.motor_test.spin([0], 0.2, 100.0)
    rig.run(0.1)
    assert rig.fc.arm(force=False).verdict is Verdict.ACCEPTED
    rig.run(0.1)
    assert not rig.fc.motor_test.is_running
    assert commands(rig) == [0.0] * 8


@pytest.mark.parametrize("stop", [lambda fc: fc.disarm(force=False), lambda fc: fc.terminate()])
def test_who_disarms_or_terminates_stops_motors_that_are_tested(rig, stop):
    rig.fc.motor_test.spin([0, 1], 0.2, 100.0)
    rig.run(0.1)
    assert stop(rig.fc).verdict is Verdict.ACCEPTED
    rig.run(0.02)
    assert commands(rig) == [0.0] * 8
    rig.run(150.0)
    assert commands(rig) == [0.0] * 8
    assert rig.recorder.has_text("Motor test: ended")


def test_a_termination_right_after_arming_is_one_though_a_motor_was_being_tested(rig):
    rig.fc.motor_test.spin([0], 0.2, 100.0)
    rig.run(0.1)
    assert rig.fc.arm(force=False).verdict is Verdict.ACCEPTED
    assert rig.fc.terminate().verdict is Verdict.ACCEPTED
    assert not rig.fc.state.is_armed


def test_an_armed_vehicle_tests_no_motor(rig):
    rig.fc.arm(force=False)
    rig.run(0.1)
    assert rig.fc.motor_test.spin([0], 0.2, 1.0).verdict is Verdict.TEMPORARILY_REJECTED


def test_a_vehicle_in_the_air_tests_no_motor(rig):
    rig.fc.state.landed_state = LandedState.IN_AIR
    assert rig.fc.motor_test.spin([0], 0.2, 1.0).verdict is Verdict.TEMPORARILY_REJECTED


@pytest.mark.parametrize(
    ("rotors", "command", "seconds"),
    [([4], 0.2, 1.0), ([-1], 0.2, 1.0), ([], 0.2, 1.0), ([0], 1.1, 1.0), ([0], nan, 1.0), ([0], 0.2, inf),
     ([0], 0.2, -1.0), ([0], -0.1, 1.0), ([0], 0.2, nan)],
)  # fmt: skip
def test_what_is_out_of_range_is_denied(rig, rotors, command, seconds):
    assert rig.fc.motor_test.spin(rotors, command, seconds).verdict is Verdict.DENIED
    rig.run(0.1)
    assert commands(rig) == [0.0] * 8


@pytest.mark.parametrize("name", ["x500", "f550"])
def test_clockwise_begins_at_the_nose(name):
    airframe = load_airframe(name)
    order = MULTIROTOR.motors(airframe)
    positions = [airframe.rotors[rotor] for rotor in order]
    assert positions[0].x_m > 0.0
    assert positions[0].y_m > 0.0
    assert positions[-1].x_m > 0.0
    assert positions[-1].y_m < 0.0
