"""Sensors as rough as in logs of real flights: vibration and magnetic noise in a hover."""

import numpy as np
import pytest

from policies.tasks.flight.hover_bank import PLAIN, build_rig
from sim.hovering import fly_to_hover
from sim.sensors.sensors import sensor_model
from sim.world.world import build_world


@pytest.mark.parametrize(("roughness", "shaken_m_s2", "field_gauss"), [(0.0, 0.33, 1.5e-4), (1.0, 3.1, 22e-3)])
def test_vibration_and_field_noise_of_a_hover(roughness, shaken_m_s2, field_gauss):
    rig = build_rig(
        build_world(PLAIN),
        8,
        has_estimator=True,
        threads=1,
        device="cpu",
        sensors=lambda scale: sensor_model(scale, roughness=roughness),
    )
    fly_to_hover(rig, [((0.0, 0.0, -3.0), 0.0)] * 8)
    accel, field = [], []
    for _ in range(200):
        rig.advance(1)
        samples = rig.arrays.sensors.numpy()["samples"].copy()
        accel.append(samples["imu"]["accel_frd"])
        field.append(samples["mag"]["field_frd_gauss"])
    fast = np.diff(np.array(accel), axis=0) / np.sqrt(2.0)  # what a hover does is slow
    assert np.sqrt((fast**2).mean()) == pytest.approx(shaken_m_s2, rel=0.2)
    fresh = np.diff(np.array(field)[::10], axis=0) / np.sqrt(2.0)
    swayed_gauss = 2e-3  # what a hover that sways turns of the field
    assert np.sqrt((fresh**2).mean()) == pytest.approx(field_gauss, rel=0.1, abs=0.0 if roughness else swayed_gauss)
    truth = rig.rows["truth"]
    assert np.linalg.norm(truth["pos_ned"] - [0.0, 0.0, -3.0], axis=1).max() < 2.0  # and it still hovers


@pytest.mark.parametrize("roughness", [-0.1, 1.1])
def test_more_than_there_is_is_refused(roughness):
    with pytest.raises(ValueError, match="between 0 and 1"):
        sensor_model(1.0, roughness=roughness)
