"""What episodes start from: hovers and stands of each split, of one airframe or of several."""

import numpy as np
import pytest

from common.airframe import load_airframe
from mission.flight_config import FlightConfig
from mission.simulator.flight_rig import flight_rig
from policies.tasks.catalogue import UnknownTask, build_task, task_settings
from policies.tasks.drive.drive import rtk_sensors
from policies.tasks.flight.hover_bank import HOVER_COUNT, PLAIN, hover_bank
from policies.tasks.flight.standing_bank import standing_bank
from policies.tasks.task_params import NumberError
from sim.sensors.sensors import sensor_model
from sim.world.world import build_world

SPLITS = ("train", "validation", "test")
THREE = ("x500", "f450", "f550")


def hovering(split):
    truth = hover_bank(has_estimator=False, device="cpu", split=split).rows["truth"]
    return np.hstack([truth["pos_ned"], truth["q_ned_from_frd"]])


def standing(split):
    truth = standing_bank("rover", rtk_sensors, has_estimator=False, device="cpu", split=split).rows["truth"]
    return truth["q_ned_from_frd"].copy()


@pytest.mark.parametrize("starts", [hovering, standing])
def test_no_start_of_one_split_is_one_of_another(starts):
    found = np.vstack([starts(split) for split in SPLITS])
    apart = np.abs(found[:, None] - found[None]).max(axis=2)
    np.fill_diagonal(apart, 1.0)
    assert apart.min() > 1e-3


def follow(**settings):
    return build_task(
        "FollowMe",
        48,
        task_settings("FollowMe", {"observation": "tracked", "has_estimator": "false", "terrain": "kept", **settings}),
    )


def test_of_several_airframes_each_is_as_frequent_and_flies_by_parameters_of_its_own():
    bank = hover_bank(has_estimator=False, device="cpu", airframes=THREE)
    assert bank.vehicle_count == len(THREE) * HOVER_COUNT
    task = follow(airframe="+".join(THREE))
    task.set_params({"mass_scale": 1.0, "wind_m_s": 0.0, "wind_gust_m_s": 0.0, "guard": 0.0})
    task.reset(0)
    masses = task.rig.arrays.model.numpy()["mass_kg"]
    known = [load_airframe(name).body.mass_kg for name in THREE]
    counts = [int((np.abs(masses - mass) < 1e-3).sum()) for mass in known]
    assert sum(counts) == 48
    assert min(counts) >= 8  # of 16 expected; fewer than one in a hundred
    for _ in range(30):
        task.step()
    truth = task.rig.rows["truth"]
    tilt = truth["q_ned_from_frd"][:, :2]
    assert np.abs(tilt).max() < 0.1  # each stays in its hover: allocation and gains are of its airframe
    assert np.abs(truth["vel_ned"]).max() < 0.5


@pytest.mark.parametrize(("name", "word"), [("x9000", "unknown airframe"), ("x500+rover", "rover cannot hover")])
def test_what_cannot_hover_is_refused(name, word):
    with pytest.raises(UnknownTask, match=word):
        follow(airframe=name)


def test_roughness_is_that_of_the_episode_however_many_there_were():
    task = follow()
    task.set_params({"sensor_noise": 1.0, "sensor_roughness": 1.0})
    found = []
    for _ in range(2):
        task.begin(np.ones(48, dtype=np.bool_))
        found.append(task.rig.arrays.sensor_model.numpy()["imu"]["accel_broadband"].copy())
    rough = sensor_model(1.0, roughness=1.0).imu.accel_broadband
    assert found[0] == pytest.approx(rough, rel=1e-5)
    assert found[1] == pytest.approx(rough, rel=1e-5)


def test_flights_have_the_roughness_that_is_asked_for():
    config = FlightConfig(sensor_roughness=1.0)
    rig = flight_rig(config, load_airframe("x500"), build_world(PLAIN))
    model = rig.arrays.sensor_model.numpy()[0]
    assert model["mag"]["white_std"] == pytest.approx(22e-3, rel=0.01)


def test_a_state_of_a_version_with_other_numbers_is_refused():
    task = follow()
    task.reset(0)
    state = task.state()
    state["samplers"] = state["samplers"][:-1]
    with pytest.raises(NumberError, match="another version"):
        task.load_state(state)


def test_a_state_with_several_airframes_is_gone_on_with():
    first, second = follow(airframe="+".join(THREE)), follow(airframe="+".join(THREE))
    first.reset(5)
    for _ in range(3):
        first.step()
    second.load_state(first.state())
    for task in (first, second):
        for _ in range(3):
            task.step()
    np.testing.assert_array_equal(first.rig.rows["truth"]["pos_ned"], second.rig.rows["truth"]["pos_ned"])
