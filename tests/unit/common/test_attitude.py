"""Vectors of a leaning body, level."""

from math import cos, hypot, inf, isfinite, nextafter, sin

import pytest

from common.attitude import levelled


@pytest.mark.parametrize("pitch_rad", [-1.2, -0.4, 0.0, 0.7, 1.4])
def test_what_is_ahead_of_the_level_body_stays_ahead_and_as_long(pitch_rad):
    ahead_frd = (cos(pitch_rad), 0.0, sin(pitch_rad))
    assert levelled(ahead_frd, (-sin(pitch_rad), 0.0)) == pytest.approx((1.0, 0.0, 0.0), abs=1e-9)


def test_a_body_that_stands_on_its_nose_has_down_and_no_error():
    for lean in (1.0, -1.0, nextafter(1.0, inf), 1.0 + 1e-7):
        level = levelled((3.0, 0.5, -1.0), (lean, 0.0))
        assert all(isfinite(value) for value in level)
        assert level[2] == pytest.approx(3.0 * lean)
        assert hypot(*level[:2]) < 0.01
