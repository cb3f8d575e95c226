"""Worlds that the networks of sight train in: those of training alone."""

import numpy as np

from policies.person_detector.scenes import _seeds


def test_training_has_no_world_of_validation_and_tests_have_none_of_either():
    drawn = np.arange(1000)
    assert set(_seeds(drawn, is_test=False) % 4) == {0}  # those of validation leave 2
    assert set(_seeds(drawn, is_test=True) % 2) == {1}
    assert len(set(_seeds(drawn, is_test=False))) == 500
