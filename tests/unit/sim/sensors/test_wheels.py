import numpy as np
import pytest

from autopilot.ports import SETPOINT_DRIVE
from common.airframe import load_airframe
from common.geodesy import DEFAULT_HOME
from sim.bodies.vehicles import class_of
from sim.faults import set_fault
from sim.rig import Rig
from sim.sensors.sensors import sensor_model
from sim.sensors.wheels import SCALE_STD, STEP_M
from sim.wind import wind_model
from sim.world.world import build_world
from tests.unit.sim.rover_fleet import FLAT

NAN3 = (np.nan,) * 3


def driving(noise=1.0, count=1, seconds=4.0, name="rover"):
    """Rovers at 2 m/s, and their samples."""
    airframe = load_airframe(name)
    vehicle, body = class_of(airframe)
    rig = Rig(
        airframe, build_world(FLAT), sensor_model(noise), wind_model(0.0), home=DEFAULT_HOME, vehicle_count=count,
        body=body, law=vehicle.law,
    )  # fmt: skip
    rig.advance(750)  # the estimator aligns
    setpoint = rig.rows["autopilot.setpoint"]
    for field, value in {"kind": SETPOINT_DRIVE, "is_armed": 1, "speed": 2.0, "yaw": 0.0, "yaw_rate": np.nan}.items():
        setpoint[field] = value
    rig.advance(round(seconds * 250))
    return rig


def samples(rig):
    return rig.rows["sensors"]["samples"]["wheels"]


def test_without_errors_the_encoders_tell_the_treads_speed():
    rig = driving(noise=0.0)
    truth = rig.truth_row()["wheel_speed_m_s"]
    assert samples(rig)["left_m_s"][0] == pytest.approx(truth[0], abs=1e-3)
    assert samples(rig)["right_m_s"][0] == pytest.approx(truth[1], abs=1e-3)


def test_a_sample_is_timed_at_the_middle_of_what_it_counts():
    rig = driving(noise=0.0)
    end_us = int(rig.rows["tick"][0]) * 4_000
    assert end_us - int(samples(rig)["time_us"][0]) == 10_000


def test_each_side_has_a_scale_of_its_own_within_its_deviation():
    rig = driving(count=64)
    truth = rig.rows["truth"]["wheel_speed_m_s"]
    scale = np.concatenate([samples(rig)["left_m_s"] / truth[:, 0], samples(rig)["right_m_s"] / truth[:, 1]])
    step = STEP_M / 0.02 / 2.0
    assert 0.7 * SCALE_STD < scale.std() < 1.4 * np.hypot(SCALE_STD, step)
    assert np.abs(scale.mean() - 1.0) < 0.005


def test_faults_stop_freeze_and_shift_them():
    rig = driving(noise=0.0, count=3)
    for row, (mode, magnitude) in enumerate((("off", 0.0), ("stuck", 0.0), ("biased", 1.0))):
        set_fault(rig.rows["faults"][row], "wheels", mode, magnitude)
    before = samples(rig).copy()
    rig.rows["autopilot.setpoint"]["speed"] = 1.0
    rig.advance(500)
    now, truth = samples(rig), rig.rows["truth"]["wheel_speed_m_s"]
    assert now["time_us"][0] == before["time_us"][0]
    assert now["time_us"][1] > before["time_us"][1]
    assert now["left_m_s"][1] == before["left_m_s"][1]
    assert now["left_m_s"][2] == pytest.approx(truth[2, 0] + 1.0, abs=1e-2)


def test_what_flies_has_none():
    rig = Rig(load_airframe("x500"), build_world(FLAT), sensor_model(), wind_model(0.0), home=DEFAULT_HOME)
    rig.advance(250)
    assert samples(rig)["time_us"][0] == 0
