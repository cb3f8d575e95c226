"""The motor watch: a rotor that stands still is noticed, one that is slow or late is not."""

from types import SimpleNamespace

import pytest

from autopilot.interface.vehicle_state import LandedState
from autopilot.vehicles.multirotor.motor_failures import MOTOR_WATCH_PARAMETERS, MotorWatch
from common.airframe import load_airframe
from common.params import ParameterTable
from tests.unit.autopilot.kinematic import Recorder

FRAME_US = 20_000
COMMAND = 0.6


class Bench:
    """A vehicle in the air whose rotors turn as a test says."""

    def __init__(self, name="f550", **params):
        airframe = load_airframe(name)
        self.count = len(airframe.rotors)
        battery, rotor = airframe.battery, airframe.rotor_model
        curve = rotor.command_curve
        self.asked = rotor.max_speed_rad_s * (curve * COMMAND + (1.0 - curve) * COMMAND**0.5)
        self.speeds = [self.asked] * 8
        self.left_out = []
        self.recorder = Recorder()
        table = ParameterTable(MOTOR_WATCH_PARAMETERS)
        for name_, value in params.items():
            table.set(name_, value)
        self.state = SimpleNamespace(
            time_us=10_000_000,
            landed_state=LandedState.IN_AIR,
            actuators=SimpleNamespace(command=(COMMAND,) * 8),
            samples=SimpleNamespace(battery=SimpleNamespace(voltage_v=battery.cells * battery.full_cell_v)),
        )
        self.watch = MotorWatch(self.state, table, self.recorder, airframe, lambda: self.speeds, self.left_out.append)
        self.watch.reset()

    def run(self, seconds):
        for _ in range(round(seconds * 1e6 / FRAME_US)):
            self.state.time_us += FRAME_US
            has_failure = self.watch.has_failure()
        return has_failure


def test_motor_that_stands_still_is_told_and_left_out():
    bench = Bench()
    assert not bench.run(1.0)
    bench.speeds[2] = 0.0
    assert bench.run(0.4)
    assert [text for _, text in bench.recorder.texts] == ["Motor 3 has failed"]
    assert bench.left_out == [(2,)]


def test_motor_that_works_again_is_used_again():
    bench = Bench()
    bench.speeds[2] = 0.0
    bench.run(1.0)
    bench.speeds[2] = bench.asked
    assert bench.run(0.3)
    assert not bench.run(1.0)
    assert bench.recorder.has_text("Motor 3 works again")
    assert bench.left_out == [(2,), ()]


@pytest.mark.parametrize("fraction", [0.6, 0.8])
def test_weak_motor_has_not_failed(fraction):
    bench = Bench()
    bench.speeds[0] = fraction * bench.asked
    assert not bench.run(2.0)


@pytest.mark.parametrize(
    ("landed_state", "command", "params"),
    [
        (LandedState.ON_GROUND, COMMAND, {}),
        (LandedState.IN_AIR, 0.1, {}),
        (LandedState.IN_AIR, COMMAND, {"FD_ACT_EN": 0}),
    ],
)
def test_motor_is_not_judged(landed_state, command, params):
    bench = Bench(**params)
    bench.state.landed_state = landed_state
    bench.state.actuators.command = (command,) * 8
    bench.speeds = [0.0] * 8
    assert not bench.run(2.0)


def test_short_slowness_and_a_new_command_are_forgiven():
    bench = Bench()
    for _ in range(5):
        bench.speeds[1] = 0.0
        bench.run(0.1)
        bench.speeds[1] = bench.asked
        assert not bench.run(0.2)


def test_patience_is_a_parameter():
    bench = Bench(FD_ACT_MOT_TOUT=2000)
    bench.speeds[1] = 0.0
    assert not bench.run(1.8)
    assert bench.run(0.5)


@pytest.mark.parametrize(("name", "params"), [("x500", {}), ("f550", {"CA_FAILURE_MODE": 0})])
def test_allocation_is_not_told(name, params):
    bench = Bench(name, **params)
    bench.speeds[0] = 0.0
    assert bench.run(1.0)
    assert bench.left_out == []
