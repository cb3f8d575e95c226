"""Geodetic positions and the local tangent plane, in float64 on the host.

The ned frame is the plane tangent to the WGS-84 ellipsoid at an origin. Both directions go through the earth-centred
frame without approximation (Bowring's latitude is within micrometres up to 10 km of height). Heights above mean sea
level are taken as heights above the ellipsoid: the simulated earth has no geoid undulation.
Scalars in, tuples out: telemetry calls these at 50 Hz.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import atan2, cos, degrees, hypot, radians, sin, sqrt

GRAVITY_M_S2 = 9.80665  # standard gravity, CGPM 1901
# WGS-84 (NIMA TR8350.2, 2000, table 3.1)
SEMI_MAJOR_M = 6_378_137.0
FLATTENING = 1.0 / 298.257223563
ECCENTRICITY_SQ = FLATTENING * (2.0 - FLATTENING)
SEMI_MINOR_M = SEMI_MAJOR_M * (1.0 - FLATTENING)
SECOND_ECCENTRICITY_SQ = ECCENTRICITY_SQ / (1.0 - ECCENTRICITY_SQ)


@dataclass(frozen=True, slots=True)
class GeoPoint:
    """A WGS-84 position."""

    lat_deg: float
    lon_deg: float
    alt_m: float  # above mean sea level, except where the owner says otherwise


# Zurich: the home of PX4's simulators, named by many scripts
DEFAULT_HOME = GeoPoint(47.397742, 8.545594, 488.0)


@lru_cache(maxsize=64)
def _tangent_plane(origin: GeoPoint) -> tuple[float, float, float, float]:
    """Sine and cosine of the origin's latitude, its distance from the earth's axis [m] and above the equator [m]."""
    sin_lat = sin(radians(origin.lat_deg))
    cos_lat = cos(radians(origin.lat_deg))
    prime_vertical = SEMI_MAJOR_M / sqrt(1.0 - ECCENTRICITY_SQ * sin_lat * sin_lat)
    axis_distance = (prime_vertical + origin.alt_m) * cos_lat
    equator_distance = (prime_vertical * (1.0 - ECCENTRICITY_SQ) + origin.alt_m) * sin_lat
    return sin_lat, cos_lat, axis_distance, equator_distance


# The plane asked for last and its origin: nearly always the next one too, and found without hashing the origin.
_newest_plane: tuple[GeoPoint, float, float, float, float] = (DEFAULT_HOME, *_tangent_plane(DEFAULT_HOME))


def ned_from_geodetic(lat_deg: float, lon_deg: float, alt_m: float, origin: GeoPoint) -> tuple[float, float, float]:
    """North, east and down coordinates [m] of a position in the tangent plane of `origin`."""
    sin_lat_0, cos_lat_0, axis_distance_0, equator_distance_0 = _tangent_plane(origin)
    lat = radians(lat_deg)
    lon_diff = radians(lon_deg - origin.lon_deg)
    sin_lat = sin(lat)
    prime_vertical = SEMI_MAJOR_M / sqrt(1.0 - ECCENTRICITY_SQ * sin_lat * sin_lat)
    axis_distance = (prime_vertical + alt_m) * cos(lat)
    outward = axis_distance * cos(lon_diff) - axis_distance_0
    northward = (prime_vertical * (1.0 - ECCENTRICITY_SQ) + alt_m) * sin_lat - equator_distance_0
    return (
        cos_lat_0 * northward - sin_lat_0 * outward,
        axis_distance * sin(lon_diff),
        -cos_lat_0 * outward - sin_lat_0 * northward,
    )


def geodetic_from_ned(north: float, east: float, down: float, origin: GeoPoint) -> tuple[float, float, float]:
    """Latitude [deg], longitude [deg] in [-180, 180] and height above sea level [m] of a point of the tangent plane.

    Latitude by Bowring, "Transformation from spatial to geographical coordinates", Survey Review 23 (1976), one step.
    """
    global _newest_plane  # noqa: PLW0603
    plane = _newest_plane
    if plane[0] is not origin:
        plane = _newest_plane = (origin, *_tangent_plane(origin))
    _, sin_lat_0, cos_lat_0, axis_distance_0, equator_distance_0 = plane
    outward = axis_distance_0 - sin_lat_0 * north - cos_lat_0 * down
    equator_distance = equator_distance_0 + cos_lat_0 * north - sin_lat_0 * down
    axis_distance = hypot(outward, east)

    reduced_y = equator_distance * SEMI_MAJOR_M
    reduced_x = axis_distance * SEMI_MINOR_M
    reduced_norm = hypot(reduced_x, reduced_y)
    sin_reduced = reduced_y / reduced_norm
    cos_reduced = reduced_x / reduced_norm
    tangent_y = equator_distance + SECOND_ECCENTRICITY_SQ * SEMI_MINOR_M * sin_reduced * sin_reduced * sin_reduced
    tangent_x = axis_distance - ECCENTRICITY_SQ * SEMI_MAJOR_M * cos_reduced * cos_reduced * cos_reduced
    tangent_norm = hypot(tangent_x, tangent_y)
    sin_lat = tangent_y / tangent_norm
    cos_lat = tangent_x / tangent_norm

    alt_m = (
        axis_distance * cos_lat
        + equator_distance * sin_lat
        - SEMI_MAJOR_M * sqrt(1.0 - ECCENTRICITY_SQ * sin_lat * sin_lat)
    )
    lon_deg = origin.lon_deg + degrees(atan2(east, outward))
    if lon_deg > 180.0:
        lon_deg -= 360.0
    elif lon_deg < -180.0:
        lon_deg += 360.0
    return degrees(atan2(tangent_y, tangent_x)), lon_deg, alt_m
