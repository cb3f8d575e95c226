"""Motor tests as clients ask for them, in the simulator: the rotors really turn, one by one, on the ground."""

import numpy as np
import pytest

from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.codec import encode
from mission.flight import Flight
from mission.flight_config import FlightConfig
from sim.world.world import WorldConfig

MOTOR_TEST, ACTUATOR_TEST, ARM = 209, 310, 400


class Ground:
    """A vehicle on the ground, and a client's link."""

    def __init__(self, dialect, airframe="x500"):
        vehicle_end, self.link = memory_pair(LinkRole.GROUND)
        config = FlightConfig(dialect=dialect, airframe=airframe, world=WorldConfig(trees_per_ha=0.0))
        self.flight = Flight(config, links=[vehicle_end])
        self.run(4.0)

    def command(self, command, *params):
        fields = {f"param{i + 1}": value for i, value in enumerate(params)}
        self.link.send(encode("COMMAND_LONG", 255, 190, 0, target_system=1, command=command, **fields))

    def run(self, seconds):
        for _ in range(round(seconds * 50)):
            self.flight.frame()

    def speeds(self):
        """[rad/s] true."""
        return np.array(self.flight.rig.rows["truth"][0]["motor_speed"])

    def turning(self):
        return [i for i, speed in enumerate(self.speeds()) if speed > 50.0]


@pytest.fixture(scope="module")
def ardupilot():
    ground = Ground("ardupilot")
    yield ground
    ground.flight.close()


def test_each_motor_turns_in_its_turn_and_the_vehicle_stays_where_it_is(ardupilot):
    before = np.array(ardupilot.flight.rig.rows["truth"][0]["pos_ned"])
    turned = []
    ardupilot.command(MOTOR_TEST, 1, 0, 15, 1.0, 4)
    for _ in range(7):
        ardupilot.run(0.75)
        turned.append(ardupilot.turning())
    ardupilot.run(2.0)
    assert list(dict.fromkeys(tuple(motors) for motors in turned if motors)) == [(0,), (3,), (1,), (2,)]
    assert not ardupilot.turning()
    assert not ardupilot.flight.controller.state.is_armed
    assert np.array(ardupilot.flight.rig.rows["truth"][0]["pos_ned"]) == pytest.approx(before, abs=0.01)


def test_more_throttle_turns_it_faster(ardupilot):
    speeds = []
    for throttle in (10, 20):
        ardupilot.command(MOTOR_TEST, 1, 0, throttle, 1.0)
        ardupilot.run(0.9)
        speeds.append(ardupilot.speeds()[0])
        ardupilot.run(1.0)
    assert speeds[1] > 1.3 * speeds[0] > 100.0


def test_px4_actuator_test_turns_the_motor_of_that_number_for_3_s_at_most():
    ground = Ground("px4")
    ground.command(ACTUATOR_TEST, 0.15, 60.0, 0, 0, 2)
    ground.run(2.9)
    assert ground.turning() == [1]
    ground.run(1.0)
    assert not ground.turning()
    ground.flight.close()


def test_an_armed_vehicle_turns_all_rotors_or_none(ardupilot):
    ardupilot.command(MOTOR_TEST, 1, 0, 15, 100.0)
    ardupilot.run(1.0)
    ardupilot.command(ARM, 1)
    ardupilot.run(2.0)
    assert ardupilot.flight.controller.state.is_armed
    assert ardupilot.turning() == [0, 1, 2, 3]
    speeds = ardupilot.speeds()[:4]
    assert speeds.max() < 1.05 * speeds.min()
    ardupilot.command(ARM, 0)
    ardupilot.run(2.0)
    assert not ardupilot.turning()
