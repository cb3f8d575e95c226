"""The seams hold: the loop in one launch and the loop in single launches are the same loop, to the bit."""

import numpy as np
import pytest

from autopilot.params import parameter_table
from bench.flying.fleet import same_bits
from common.airframe import load_airframe
from common.geodesy import DEFAULT_HOME
from common.kernels import FRAME_TICKS
from mission.flight import Flight, FlightConfig
from mission.plan.plan_file import DEFAULT_PLAN, read_plan
from mission.script import fly_plan
from sim.rig import Rig
from sim.sensors.sensors import sensor_model
from sim.stepped import SteppedRig
from sim.wind import wind_model
from sim.world.world import build_world

CONFIG = FlightConfig(wind_m_s=5.0, seed=3)
VEHICLES = 64


def flown(make_rig, folder, on_frame=None):
    """The default mission, to its end."""
    folder.mkdir()
    flight, plan = Flight(CONFIG, folder=folder, make_rig=make_rig), read_plan(DEFAULT_PLAN)
    running = flight.drone.start(fly_plan(flight.drone, plan))
    flight.run(lambda _: running.is_done, on_frame=on_frame)
    assert running.error is None
    flight.close()
    return flight


@pytest.fixture(scope="module")
def flights(tmp_path_factory):
    """The mission on both rigs, and the setpoints of each frame of the first."""
    folder, setpoints = tmp_path_factory.mktemp("rigs"), []
    fused = flown(Rig, folder / "fused", lambda flight: setpoints.append(flight.rig.setpoints.numpy().copy()))
    stepped = flown(SteppedRig, folder / "stepped")
    return fused, stepped, np.array(setpoints), folder


def test_a_mission_on_both_rigs_is_the_same_bytes(flights):
    fused, stepped, _, folder = flights
    assert fused.time_us > 60_000_000
    assert same_bits(fused.rig.snapshot(), stepped.rig.snapshot())
    for log in ("flight.ulg", "flight.tlog"):
        assert (folder / "fused" / log).read_bytes() == (folder / "stepped" / log).read_bytes()


def rig(make_rig, **options):
    made = make_rig(
        load_airframe("x500"),
        build_world(),
        sensor_model(home=DEFAULT_HOME),
        wind_model(5.0, 270.0, 1.0, 1.5),
        home=DEFAULT_HOME,
        vehicle_count=VEHICLES,
        seed=7,
        **options,
    )
    made.load_parameters(parameter_table())
    return made


def test_64_vehicles_fly_the_same_mission_on_both_rigs(flights):
    setpoints = flights[2]
    rigs = rig(Rig), rig(SteppedRig)
    for frame in setpoints:
        for each in rigs:
            each.rows["autopilot.setpoint"][:] = frame
            each.advance(FRAME_TICKS)
    fused, stepped = (each.snapshot() for each in rigs)
    assert np.ptp(rigs[0].truth.numpy()["pos_ned"][:, 0]) > 0.01  # each has noise and wind of its own
    assert same_bits(fused, stepped)


def test_rows_of_a_device_that_the_host_cannot_see_are_the_same():
    plain, mirrored = rig(Rig), rig(Rig, has_mirrors=True)
    for each in (plain, mirrored):
        rows = each.rows["autopilot.setpoint"]
        for _ in range(100):
            rows["is_armed"] = 1
            rows["kind"] = 3
            rows["thrust"] = 0.6
            each.advance(FRAME_TICKS)
    assert mirrored.rows["truth"] is not mirrored.truth.numpy()
    assert mirrored.rows["truth"]["pos_ned"][0, 2] < -0.5
    assert same_bits(plain.snapshot(), mirrored.snapshot())
    assert same_bits([plain.rows["truth"]], [mirrored.rows["truth"]])


def test_a_reboot_in_flight_is_the_same_on_both_rigs():
    rigs = rig(Rig), rig(SteppedRig)
    for each in rigs:
        rows = each.rows["autopilot.setpoint"]
        rows["is_armed"], rows["kind"], rows["thrust"] = 1, 3, 0.8
        for _ in range(50):
            each.advance(FRAME_TICKS)
        each.reboot(1)
        each.advance(1)
    assert rigs[0].truth.numpy()["motor_speed"][1, 0] > 100.0  # they still turn, and nothing drives them
    assert same_bits(*(each.snapshot() for each in rigs))


def test_an_engine_that_holds_everything_still_lets_nothing_fly():
    """The negative control: with another engine the loop is another."""

    class Frozen:
        def __init__(self, _):
            pass

        def boot(self, _):
            pass

        def step(self, *_):
            pass

    frozen = rig(SteppedRig, engine=Frozen)
    frozen.rows["autopilot.setpoint"]["is_armed"] = 1
    before = frozen.rows["truth"].copy()
    frozen.advance(FRAME_TICKS)
    assert same_bits([before], [frozen.rows["truth"]])
    assert frozen.rows["sensors"]["samples"]["imu"]["time_us"].min() > 0
