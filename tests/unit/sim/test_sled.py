"""A second class of vehicles is data: a sled flies on the same loop, sensors, estimator and rigs as the multirotor."""

import numpy as np
import pytest

from autopilot.params import all_parameters
from bench.flying.fleet import same_bits
from common.airframe import load_airframe
from common.geodesy import DEFAULT_HOME
from common.kernels import FRAME_TICKS
from common.params import ParameterTable
from sim.rig import Rig
from sim.sensors.sensors import sensor_model
from sim.stepped import SteppedRig
from sim.wind import wind_model
from sim.world.world import WorldConfig, build_world
from tests.unit.sim.sled import SLED_BODY, SLED_LAW, SLED_PARAMETERS

VEHICLES = 4


def sleds(make_rig=Rig, **params):
    rig = make_rig(
        load_airframe("x500"),  # what a sled does not ask it for does not matter
        build_world(WorldConfig(size_m=128.0, hill_height_m=0.0, trees_per_ha=0.0)),
        sensor_model(home=DEFAULT_HOME),
        wind_model(0.0),
        home=DEFAULT_HOME,
        vehicle_count=VEHICLES,
        seed=1,
        body=SLED_BODY,
        law=SLED_LAW,
    )
    table = ParameterTable([*all_parameters(), *SLED_PARAMETERS])
    for name, value in params.items():
        table.set_exactly(name, value)
    rig.load_parameters(table)
    return rig


def driven(rig, *speeds_m_s, seconds=10.0):
    """Drives north at one speed after the other and returns the true speed at the end of each, (speeds, vehicles)."""
    rig.advance(15 * 250)  # until the estimator knows where it is
    rows, reached = rig.rows["autopilot.setpoint"], []
    rows["is_armed"] = 1
    for speed in speeds_m_s:
        rows["vel_ned"] = (speed, 0.0, 0.0)
        for _ in range(round(50 * seconds)):
            rig.advance(FRAME_TICKS)
        reached.append(rig.truth.numpy()["vel_ned"][:, 0].copy())
    return np.array(reached)


def test_a_sled_drives_forwards_and_backwards_on_its_estimate():
    rig = sleds(SLED_SPEED_P=5.0)
    ahead, back = driven(rig, 2.0, -1.0)
    assert ahead == pytest.approx(np.full(VEHICLES, 2.0), abs=0.2)
    assert back == pytest.approx(np.full(VEHICLES, -1.0), abs=0.2)
    truth, estimate = rig.rows["truth"], rig.rows["autopilot.ekf.rows"]["estimate"]
    assert np.linalg.norm(truth["pos_ned"] - estimate["pos_ned"], axis=1).max() < 1.5
    assert np.allclose(truth["height_agl_m"], 0.1)


def test_a_parameter_of_the_class_reaches_its_law():
    slow, fast = (driven(sleds(SLED_SPEED_P=gain), 2.0)[0].mean() for gain in (0.1, 5.0))
    assert slow < 1.5 < fast


def test_both_rigs_drive_a_sled_to_the_same_bits():
    fused, stepped = sleds(), sleds(SteppedRig)
    for rig in (fused, stepped):
        driven(rig, 1.0, seconds=2.0)
    assert same_bits(fused.snapshot(), stepped.snapshot())


def test_sleds_and_multirotors_live_in_one_process():
    before = Rig(
        load_airframe("x500"),
        build_world(WorldConfig(size_m=64.0, hill_height_m=0.0, trees_per_ha=0.0)),
        sensor_model(home=DEFAULT_HOME),
        wind_model(0.0),
        home=DEFAULT_HOME,
    )
    sleds().advance(FRAME_TICKS)
    before.advance(FRAME_TICKS)
    assert before.rows["body"].dtype != sleds().rows["body"].dtype
