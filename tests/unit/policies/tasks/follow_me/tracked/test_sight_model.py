"""What lenses that are not as they are taken to be make of a sight."""

import numpy as np
import pytest

from policies.tasks.catalogue import build_task, task_settings
from policies.tasks.follow_me.owner_visibility import HALF_WIDTH

ENVS = 16


def sights(**numbers):
    """First sights of the owner's chest [m] from the vehicle, level, forwards and right: (envs, 3)."""
    settings = {"observation": "tracked", "has_estimator": "false", "terrain": "kept"}
    task = build_task("FollowMe", ENVS, task_settings("FollowMe", settings))
    task.set_params(
        {
            "lens_tilt_deg": 0.0,
            "lens_scale": 1.0,
            "lens_distortion": 0.0,
            "owner_size": 1.0,
            "owner_crouch_fraction": 0.0,
            "owner_hides_per_min": 0.0,
            "bystanders": 0.0,
            "depth_max_m": 50.0,
            "depth_holes": 0.0,
        }
        | numbers
    )
    task.reset(3)
    away = task.follow.tracked.sights_ned.numpy()[:, 0] - task.follow.tracked.eyes_ned.numpy()[:, 0]
    truth = task.rig.rows["truth"]
    x, y, z, w = truth["q_ned_from_frd"].T
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    forwards = away[:, 0] * np.cos(yaw) + away[:, 1] * np.sin(yaw)
    right = -away[:, 0] * np.sin(yaw) + away[:, 1] * np.cos(yaw)
    return np.stack([forwards, right, away[:, 2]], axis=1)


def test_a_camera_that_looks_up_by_five_degrees_shows_people_lower():
    usual, tilted = sights(), sights(lens_tilt_deg=5.0)
    level_m = np.hypot(usual[:, 0], usual[:, 1])
    lower = (tilted - usual)[:, 2]
    assert lower == pytest.approx(level_m * np.tan(np.radians(5.0)), rel=0.15)  # sights' own errors along the ray


def test_a_wider_lens_shows_people_nearer_to_the_middle():
    usual, wider = sights(), sights(lens_scale=1.1)
    aside = np.abs(usual[:, 1]) > 0.3
    assert aside.sum() > 4
    assert np.all(np.abs(wider[aside, 1]) < np.abs(usual[aside, 1]))


@pytest.mark.parametrize("distortion", [-0.15, 0.15])
def test_a_lens_that_bends_lines_shifts_bearings_as_much_as_in_the_image(distortion):
    usual, bent = sights(), sights(lens_distortion=distortion)
    ahead, right, down = usual.T
    off = np.stack([right, down - ahead * np.tan(np.radians(10.0))]) / ahead / HALF_WIDTH  # the camera looks down
    radius = np.hypot(*off)
    shown = radius.copy()
    for _ in range(20):  # where the image shows it: shown * (1 + k shown²) / (1 + k) = radius
        shown = radius * (1.0 + distortion) / (1.0 + distortion * shown**2)
    is_inside = (ahead > 0.5) & (np.abs(off).max(axis=0) < 0.9)
    assert is_inside.sum() > 10
    expected = np.degrees(np.arctan(off[0] * HALF_WIDTH * shown / radius) - np.arctan(off[0] * HALF_WIDTH))
    shift = np.degrees(np.arctan2(bent[:, 1], bent[:, 0]) - np.arctan2(right, ahead))
    off_deg = np.abs(shift - expected)[is_inside]  # about sights that are up to a quarter of a metre wrong
    assert np.median(off_deg) < 0.2
    assert off_deg.max() < 1.0
    assert np.abs(expected[is_inside]).max() > 1.5


@pytest.mark.parametrize(
    ("numbers", "times_as_high"), [({"owner_size": 0.65}, 0.65), ({"owner_crouch_fraction": 1.0}, 0.55)]
)
def test_the_chest_of_who_is_small_or_crouches_is_shown_lower(numbers, times_as_high):
    lower_m = (sights(**numbers) - sights())[:, 2]
    assert np.median(lower_m) == pytest.approx((1.0 - times_as_high) * 1.0, abs=0.05)  # chests are a metre up, about
