"""The tangent plane against rotation matrices written from the textbook, and its known lengths."""

from math import cos, radians, sin, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.geodesy import ECCENTRICITY_SQ, SEMI_MAJOR_M, SEMI_MINOR_M, GeoPoint, geodetic_from_ned, ned_from_geodetic

HOME = GeoPoint(47.397742, 8.545594, 488.0)

origins = st.builds(GeoPoint, st.floats(-89.9, 89.9), st.floats(-180.0, 180.0), st.floats(-400.0, 9_000.0))


def ecef(lat_deg, lon_deg, alt_m):
    lat, lon = radians(lat_deg), radians(lon_deg)
    prime_vertical = SEMI_MAJOR_M / sqrt(1.0 - ECCENTRICITY_SQ * sin(lat) ** 2)
    return np.array(
        [
            (prime_vertical + alt_m) * cos(lat) * cos(lon),
            (prime_vertical + alt_m) * cos(lat) * sin(lon),
            (prime_vertical * (SEMI_MINOR_M / SEMI_MAJOR_M) ** 2 + alt_m) * sin(lat),
        ]
    )


def ned_by_matrix(lat_deg, lon_deg, alt_m, origin):
    lat, lon = radians(origin.lat_deg), radians(origin.lon_deg)
    ned_from_ecef = np.array(
        [
            [-sin(lat) * cos(lon), -sin(lat) * sin(lon), cos(lat)],
            [-sin(lon), cos(lon), 0.0],
            [-cos(lat) * cos(lon), -cos(lat) * sin(lon), -sin(lat)],
        ]
    )
    difference = ecef(lat_deg, lon_deg, alt_m) - ecef(origin.lat_deg, origin.lon_deg, origin.alt_m)
    return ned_from_ecef @ difference


@given(origins, st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.floats(-400.0, 9_000.0))
def test_ned_equals_the_matrix_formula(origin, lat_diff, lon_diff, alt_m):
    lat_deg = min(max(origin.lat_deg + lat_diff, -90.0), 90.0)
    lon_deg = origin.lon_deg + lon_diff
    ned = ned_from_geodetic(lat_deg, lon_deg, alt_m, origin)
    assert ned == pytest.approx(ned_by_matrix(lat_deg, lon_deg, alt_m, origin), abs=1e-7)  # float64 of 6,400 km


@given(origins, st.floats(-20e3, 20e3), st.floats(-20e3, 20e3), st.floats(-8e3, 8e3))
def test_round_trip_loses_only_micrometres(origin, north, east, down):
    lat_deg, lon_deg, alt_m = geodetic_from_ned(north, east, down, origin)
    assert abs(lat_deg) <= 90.0
    assert abs(lon_deg) <= 180.0
    assert ned_from_geodetic(lat_deg, lon_deg, alt_m, origin) == pytest.approx((north, east, down), abs=1e-5)


def test_origin_is_zero():
    assert ned_from_geodetic(HOME.lat_deg, HOME.lon_deg, HOME.alt_m, HOME) == pytest.approx((0.0, 0.0, 0.0), abs=1e-8)


def test_directions_have_their_signs():
    north, _, _ = ned_from_geodetic(HOME.lat_deg + 1e-4, HOME.lon_deg, HOME.alt_m, HOME)
    _, east, _ = ned_from_geodetic(HOME.lat_deg, HOME.lon_deg + 1e-4, HOME.alt_m, HOME)
    _, _, down = ned_from_geodetic(HOME.lat_deg, HOME.lon_deg, HOME.alt_m + 10.0, HOME)
    assert north > 0.0
    assert east > 0.0
    assert down == pytest.approx(-10.0)


def test_degree_lengths_at_45_degrees_are_those_of_the_tables():
    """One degree at 45°: 111,131.7 m of latitude, 78,846.8 m of longitude (NIMA TR8350.2 radii)."""
    origin = GeoPoint(45.0, 0.0, 0.0)
    north, _, _ = ned_from_geodetic(45.0 + 1e-4, 0.0, 0.0, origin)
    _, east, _ = ned_from_geodetic(45.0, 1e-4, 0.0, origin)
    assert north * 1e4 == pytest.approx(111_131.7, abs=1.0)
    assert east * 1e4 == pytest.approx(78_846.8, abs=1.0)


def test_a_plane_across_the_date_line_is_continuous():
    origin = GeoPoint(10.0, 179.9999, 0.0)
    _, lon_deg, _ = geodetic_from_ned(0.0, 100.0, 0.0, origin)
    assert lon_deg < -179.0
    assert ned_from_geodetic(10.0, lon_deg, 0.0, origin)[1] == pytest.approx(100.0, abs=1e-3)
