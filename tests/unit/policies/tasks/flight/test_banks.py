"""What episodes start from: hovers and stands of each split, of one airframe or of several."""

import numpy as np
import pytest

from common.airframe import load_airframe
from policies.tasks.catalogue import UnknownTask, build_task, task_settings
from policies.tasks.drive.drive import rtk_sensors
from policies.tasks.flight.hover_bank import HOVER_COUNT, hover_bank
from policies.tasks.flight.standing_bank import standing_bank

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
    assert {round(float(mass), 3) for mass in masses} == {round(mass, 3) for mass in known}
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
