"""ArduPilot's SIM_* parameters, set over MAVLink in lockstep: wind blows, GNSS goes, motors fail, the pace changes."""

from math import atan2, degrees, hypot

import numpy as np
import pytest

from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.codec import FrameReader, decode, encode
from autopilot.ports import DEAD_RECKONING, POSITION_VALID
from common.clock import SIMULATED_EPOCH_US, wall_unix_us
from common.state_folder import StateFolder
from mission.flight import Flight
from mission.flight_config import FlightConfig
from sim.world.world import WorldConfig


class Hovering:
    """A vehicle of ArduPilot's dialect in the air, and a client's link to it."""

    def __init__(self, height_m=10.0, **options):
        vehicle_end, self.link = memory_pair(LinkRole.GROUND)
        world = WorldConfig(trees_per_ha=0.0)
        self.flight = Flight(FlightConfig(dialect="ardupilot", world=world, **options), links=[vehicle_end])
        self._reader = FrameReader()

        async def climb(drone):
            await drone.wait_ready()
            await drone.arm()
            await drone.takeoff(height_m)

        if height_m:
            running = self.flight.fly(climb, seconds=60.0)
            assert running.is_done
            assert running.error is None
        self.run(0.1)

    def ask(self, name, value):
        bits = int(np.float32(value).view(np.uint32))
        self.link.send(encode("PARAM_SET", 255, 190, 0, 1, 1, name, bits, 9))

    def set(self, name, value):
        self.ask(name, value)
        self.run(0.04)

    def run(self, seconds):
        """What the client hears meanwhile."""
        heard = []
        for _ in range(round(seconds * 50)):
            self.flight.frame()
            heard += [decode(frame) for data in self.link.receive() for frame in self._reader.feed(data)]
        return heard

    @property
    def body(self):
        return self.flight.rig.rows["truth"][0]

    @property
    def state(self):
        return self.flight.controller.state


@pytest.fixture
def hovering():
    vehicle = Hovering()
    yield vehicle
    vehicle.flight.close()


def test_wind_blows_as_it_is_set_and_the_vehicle_leans_into_it(hovering):
    hovering.set("SIM_WIND_DIR", 90.0)
    hovering.set("SIM_WIND_TURB", 0.0)
    hovering.set("SIM_WIND_SPD", 8.0)
    hovering.run(20.0)
    air = hovering.flight.rig.arrays.wind.numpy()[0]["wind_ned"]
    assert (air[0], air[1]) == pytest.approx((0.0, -8.0), abs=0.1)
    estimate = hovering.state.estimate.wind_ned
    assert hypot(estimate[0], estimate[1]) == pytest.approx(8.0, abs=2.0)
    assert degrees(atan2(-estimate[1], -estimate[0])) == pytest.approx(90.0, abs=15.0)


def test_turbulence_shakes_the_air(hovering):
    hovering.set("SIM_WIND_SPD", 5.0)
    hovering.set("SIM_WIND_TURB", 1.0)
    seen = []
    for _ in range(100):
        hovering.run(0.1)
        seen.append(float(hovering.flight.rig.arrays.wind.numpy()[0]["wind_ned"][2]))
    assert 0.2 < np.std(seen) < 3.0


@pytest.mark.parametrize(("name", "off", "on"), [("SIM_GPS_DISABLE", 1, 0), ("SIM_GPS1_ENABLE", 0, 1)])
def test_gnss_goes_and_comes_back(hovering, name, off, on):
    hovering.set(name, off)
    hovering.run(3.0)
    assert hovering.state.samples.gnss.fix_type == 0
    assert hovering.state.estimate.flags & DEAD_RECKONING or not hovering.state.estimate.flags & POSITION_VALID
    hovering.set(name, on)
    hovering.run(5.0)
    assert hovering.state.samples.gnss.fix_type == 3


def test_motor_loses_its_thrust_and_has_it_back(hovering):
    motor = 2  # the third: bit 4
    hovering.run(3.0)
    before = float(hovering.body["motor_speed"][motor])
    hovering.set("SIM_ENGINE_MUL", 0.9)
    hovering.set("SIM_ENGINE_FAIL", 4)
    hovering.run(3.0)
    commands = hovering.state.actuators.command
    assert commands[motor] > 1.05 * np.mean([commands[i] for i in (0, 1, 3)])  # the controller makes up for it
    assert float(hovering.body["motor_speed"][motor]) == pytest.approx(before, rel=0.1)
    hovering.set("SIM_ENGINE_FAIL", 0)
    hovering.run(3.0)
    commands = hovering.state.actuators.command
    assert commands[motor] == pytest.approx(np.mean(commands[:4]), rel=0.05)


def test_dead_motor_brings_a_quadrotor_down(hovering):
    hovering.set("SIM_ENGINE_MUL", 0.0)
    hovering.set("SIM_ENGINE_FAIL", 1)
    hovering.run(5.0)
    assert hovering.body["is_crashed"] or hovering.body["height_agl_m"] < 1.0


def test_low_voltage_brings_the_vehicle_home(hovering):
    hovering.set("BATT_LOW_VOLT", 14.6)
    hovering.set("BATT_LOW_TIMER", 2.0)
    hovering.set("BATT_FS_LOW_ACT", 2)
    hovering.run(3.0)
    assert hovering.state.mode is Mode.HOLD
    hovering.set("SIM_BATT_VOLTAGE", 14.6)
    heard = hovering.run(0.5)
    volts = [message.fields.voltage_battery / 1000.0 for message in heard if message.name == "SYS_STATUS"]
    assert volts[-1] == pytest.approx(14.3, abs=0.5)
    hovering.run(3.0)
    assert hovering.state.mode is Mode.RETURN


def test_radio_falls_silent(hovering):
    hovering.set("SIM_RC_FAIL", 1)
    hovering.run(2.0)
    assert not hovering.flight.controller.sticks.is_heard(hovering.flight.time_us)
    hovering.set("SIM_RC_FAIL", 0)
    hovering.run(2.0)
    assert hovering.flight.controller.sticks.is_heard(hovering.flight.time_us)


@pytest.mark.parametrize(("name", "sensor"), [("SIM_BARO_DISABLE", "baro"), ("SIM_MAG1_FAIL", "mag")])
def test_sensor_falls_silent(name, sensor):
    vehicle = Hovering(height_m=0.0)
    vehicle.run(1.0)
    vehicle.set(name, 1)
    vehicle.run(0.1)
    last_us = getattr(vehicle.state.samples, sensor).time_us
    vehicle.run(1.0)
    assert getattr(vehicle.state.samples, sensor).time_us == last_us
    vehicle.set(name, 0)
    vehicle.run(1.0)
    assert getattr(vehicle.state.samples, sensor).time_us > last_us
    vehicle.flight.close()


def test_pace_is_told_and_changes():
    vehicle = Hovering(height_m=0.0)
    flight = vehicle.flight
    paces = []

    def note(running):
        if running.time_us >= paces_end_us:
            return
        paces.append(running._pacer.speed)
        if len(paces) == 5:
            vehicle.link.send(
                encode("PARAM_SET", 255, 190, 0, 1, 1, "SIM_SPEEDUP", int(np.float32(500.0).view("u4")), 9)
            )

    paces_end_us = flight.time_us + 1_000_000
    flight.run(lambda each: each.time_us >= paces_end_us, speed=200.0, on_frame=note)
    assert paces[:5] == [200.0] * 5
    assert paces[-1] == 500.0
    assert flight.params["SIM_SPEEDUP"] == 500.0
    flight.run(lambda each: each.time_us >= paces_end_us)
    assert flight.params["SIM_SPEEDUP"] == 0.0  # lockstep
    flight.close()


def test_date_is_the_configurations_in_lockstep_and_the_walls_when_paced():
    flight = Flight(FlightConfig(boot_unix_us=1_700_000_000_000_000, world=WorldConfig(trees_per_ha=0.0)))
    flight.run(lambda each: each.time_us >= 40_000)
    assert flight.host.boot_unix_us == 1_700_000_000_000_000
    flight.close()
    flight = Flight(FlightConfig(world=WorldConfig(trees_per_ha=0.0)))
    assert flight.host.boot_unix_us == SIMULATED_EPOCH_US
    flight.run(lambda each: each.time_us >= 40_000, speed=10.0)
    assert abs(flight.host.boot_unix_us - wall_unix_us()) < 60_000_000
    flight.close()


def test_what_the_flight_is_given_holds_from_power_on():
    vehicle = Hovering(height_m=0.0, parameters={"SIM_WIND_SPD": 6.0, "SIM_ENGINE_FAIL": 1, "SIM_ENGINE_MUL": 0.5})
    vehicle.run(0.5)
    assert hypot(*vehicle.flight.rig.arrays.wind.numpy()[0]["wind_ned"][:2]) == pytest.approx(6.0, abs=0.1)
    assert vehicle.flight.rig.arrays.faults.numpy()[0]["motor_loss"][0] == pytest.approx(0.5)
    vehicle.flight.close()


def test_failures_are_not_kept_for_the_next_flight(tmp_path):
    state = StateFolder(tmp_path)
    config = FlightConfig(dialect="ardupilot", world=WorldConfig(trees_per_ha=0.0))
    flight = Flight(config, state=state)
    flight.params.set("SIM_ENGINE_FAIL", 15)
    flight.params.set("RTL_RETURN_ALT", 44.0)
    flight.close()
    flight = Flight(config, state=state)
    assert flight.params["SIM_ENGINE_FAIL"] == 0
    assert flight.params["RTL_RETURN_ALT"] == 44.0
    flight.close()
    state.close()
