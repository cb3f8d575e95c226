"""The world field at known places."""

from math import atan2, degrees, hypot

import numpy as np
import pytest

from common.geomagnetic import declination_deg, field_ned_gauss


@pytest.mark.parametrize(
    ("lat_deg", "lon_deg", "declination", "inclination", "strength_gauss"),
    [
        (47.397742, 8.545594, 3.5, 63.5, 0.484),  # Zurich
        (-33.87, 151.21, 12.8, -64.3, 0.57),  # Sydney
        (40.71, -74.01, -12.6, 66.0, 0.51),  # New York
    ],
)
def test_field_is_that_of_the_magnetic_charts(lat_deg, lon_deg, declination, inclination, strength_gauss):
    field = field_ned_gauss(lat_deg, lon_deg, 100.0)
    assert declination_deg(field) == pytest.approx(declination, abs=0.5)
    assert degrees(atan2(field[2], hypot(field[0], field[1]))) == pytest.approx(inclination, abs=1.0)
    assert np.linalg.norm(field) == pytest.approx(strength_gauss, rel=0.02)


def test_the_field_weakens_with_height_as_a_dipole():
    ground = np.linalg.norm(field_ned_gauss(47.4, 8.5, 0.0))
    high = np.linalg.norm(field_ned_gauss(47.4, 8.5, 4000.0))
    assert 1.0 - high / ground == pytest.approx(3.0 * 4.0 / 6371.0, rel=0.2)


@pytest.mark.parametrize(("lat_deg", "lon_deg"), [(91.0, 0.0), (0.0, 181.0), (float("nan"), 0.0)])
def test_a_place_off_the_globe_is_refused(lat_deg, lon_deg):
    with pytest.raises(ValueError, match="no such place"):
        field_ned_gauss(lat_deg, lon_deg, 0.0)
