"""The Earth's magnetic field from the World Magnetic Model, on the host, once per home.

The date is a constant, so that a simulation does not depend on the day it runs; the field of central Europe turns
by about 0.2 deg a year.
"""

from math import atan2, degrees

import numpy as np
from pygeomag import GeoMag
from pygeomag.wmm.wmm_2025 import WMM_2025

FIELD_DECIMAL_YEAR = 2026.0  # inside the validity of WMM2025 (2025.0 to 2030.0; NOAA/NCEI and BGS, 2024)
_GAUSS_FROM_NANOTESLA = 1.0e-5


def field_ned_gauss(lat_deg: float, lon_deg: float, alt_amsl_m: float) -> np.ndarray:
    """World magnetic field [gauss] in ned, shape (3,).

    Height above the sea stands in for height above the ellipsoid: 50 m change the field by 2e-5 of itself.

    Raises:
        ValueError: latitude or longitude outside the globe.
    """
    if not -90.0 <= lat_deg <= 90.0 or not -180.0 <= lon_deg <= 180.0:
        raise ValueError(f"no such place: latitude {lat_deg}, longitude {lon_deg}")
    model = GeoMag(coefficients_data=WMM_2025)
    result = model.calculate(glat=lat_deg, glon=lon_deg, alt=alt_amsl_m * 1.0e-3, time=FIELD_DECIMAL_YEAR)
    return np.array([result.x, result.y, result.z], dtype=np.float64) * _GAUSS_FROM_NANOTESLA


def declination_deg(field_ned: np.ndarray) -> float:
    """Angle from true north to the horizontal field [deg], east positive."""
    return degrees(atan2(field_ned[1], field_ned[0]))
