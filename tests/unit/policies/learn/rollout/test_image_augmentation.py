"""Augmented images: how far they move, brighten and blur, and that depth keeps its values."""

import torch

from policies.learn.config.behavior import Augmentation
from policies.learn.rollout.image_augmentation import augmented


def images(channels=4):
    generator = torch.Generator().manual_seed(0)
    return torch.randint(60, 120, (3, 50, 16, 16, channels), generator=generator, dtype=torch.uint8)


def changed(original, **settings):
    return augmented(original, Augmentation(**settings), torch.Generator().manual_seed(1))


def test_nothing_asked_changes_nothing():
    original = images()
    assert changed(original) is original


def test_shift_moves_a_whole_sequence_alike_and_by_no_more_than_asked():
    original = torch.zeros(3, 50, 16, 16, 1, dtype=torch.uint8)
    original[:, :, 8, 8] = 200
    moved = changed(original, shift_px=2)
    places = (moved[..., 0] == 200).nonzero()
    assert len(places) == 150
    offsets = places[:, 2:] - 8
    assert offsets.abs().max() == 2
    assert (offsets.view(3, 50, 2) == offsets.view(3, 50, 2)[0]).all()
    assert len(offsets.unique(dim=0)) > 10


def test_exposure_is_one_factor_of_a_sequence_and_spares_depth():
    original = images()
    moved = changed(original, exposure=0.5)
    assert torch.equal(moved[..., 3], original[..., 3])
    ratios = moved[..., :3].float() / original[..., :3].float()
    factors = ratios.mean((0, 2, 3, 4))
    assert (ratios - factors[None, :, None, None, None]).abs().max() < 0.02
    assert 2.0**-0.52 < factors.min() < 0.8
    assert 1.2 < factors.max() < 2.0**0.52


def test_noise_has_the_deviation_asked_for():
    original = images()
    moved = changed(original, noise=5.0)
    off = (moved.float() - original.float())[..., :3]
    assert abs(off.mean()) < 0.1
    assert abs(off.std() - 5.0) < 0.1
    assert torch.equal(moved[..., 3], original[..., 3])
