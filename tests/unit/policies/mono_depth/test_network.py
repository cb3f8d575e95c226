"""Depth told from colours: where level ground is seen, what a distribution says, and how good the one that ships is."""

import numpy as np
import pytest
import torch

from policies.mono_depth.network import BIN_BYTES, BINS, BLOCK, MonoDepth, flat_ground, quantile_byte, shipped
from policies.mono_depth.training import judge
from policies.mono_depth.views import views
from policies.person_detector.scenes import Stage
from policies.tasks.follow_me.observe import DEPTH_HALF_M, IMAGE_SIZE

DOWN = (0.0, 0.0, 1.0)


def test_level_ground_is_seen_where_a_pinhole_camera_sees_it() -> None:
    ground = flat_ground(torch.tensor([[0.0, 1.0, 0.0]]), torch.tensor([2.0]))[0]  # looks at the horizon
    assert (ground[: IMAGE_SIZE // 2] == 1.0).all()
    below = (IMAGE_SIZE - 0.5 - IMAGE_SIZE / 2) / (IMAGE_SIZE / 2)  # of the last row, per depth
    depth_m = 2.0 / below
    assert float(ground[-1, 0]) == pytest.approx(depth_m / (depth_m + float(DEPTH_HALF_M)), rel=1e-5)


def test_ground_is_nowhere_if_no_height_is_known() -> None:
    assert (flat_ground(torch.tensor([[0.0, 1.0, 0.0]]), torch.tensor([float("nan")])) == 1.0).all()


def test_what_is_likely_enough_to_be_near_is_near() -> None:
    logits = np.full((BINS, 1), -20.0, np.float32)
    logits[5], logits[20] = np.log(0.45), np.log(0.55)
    assert quantile_byte(logits)[0] // BIN_BYTES == 5
    logits[5], logits[20] = np.log(0.3), np.log(0.7)
    assert quantile_byte(logits)[0] // BIN_BYTES == 20
    logits[BINS - 1] = 10.0
    assert quantile_byte(logits)[0] == 255


def test_the_one_that_ships_sees_trunks_and_people_in_worlds_that_it_was_not_trained_in() -> None:
    found = judge(shipped().eval(), views(Stage(11, is_test=True), 256))
    assert found["near trunks seen"].value > 0.7  # type: ignore[attr-defined]
    assert found["something near where nothing is"].value < 0.03  # type: ignore[attr-defined]
    assert found["somebody seen"].value > 0.6  # type: ignore[attr-defined]
    assert found["median error, nearer than 5 m"] < 0.12  # type: ignore[operator]


def test_an_image_becomes_depth_of_its_size_whatever_is_known_of_the_height() -> None:
    pixels = np.random.default_rng(1).integers(0, 255, (IMAGE_SIZE, IMAGE_SIZE, 4), dtype=np.uint8)
    for height_m in (2.0, float("nan")):
        seen = MonoDepth().see(pixels, DOWN, height_m)
        assert seen.depth.shape == seen.is_person.shape == (IMAGE_SIZE, IMAGE_SIZE)
        assert (seen.depth[::BLOCK, ::BLOCK] == seen.depth[1::BLOCK, 1::BLOCK]).all()
