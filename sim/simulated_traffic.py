"""Other aircraft in the sky of the simulation, and the ADS-B receiver that hears them once a second.

In: the time. Out: reports. Each flies straight through the area, over and over again; where and how fast comes from the
seed. They are heard, not seen: no camera shows them.
"""

from math import cos, pi, sin

import numpy as np

from autopilot.interface.aircraft import Aircraft
from common.geodesy import GeoPoint, geodetic_from_ned

HEARD_WITHIN_M = 5_000.0  # half the length of a passage
_LOWEST_M, _HIGHEST_M = 150.0, 900.0  # above home
_SLOWEST_M_S, _FASTEST_M_S = 30.0, 90.0  # light aircraft
_LIGHT = 1  # ADSB_EMITTER_TYPE


class SimulatedTraffic:
    """Some aircraft.

    Args:
        count: how many.
        home: the middle of the area.
        seed: of their ways.
    """

    def __init__(self, count: int, home: GeoPoint, seed: int) -> None:
        self._home = home
        rng = np.random.default_rng([seed, 0xAD5B])
        self._heading = rng.uniform(0.0, 2.0 * pi, count)
        self._aside_m = rng.uniform(-2_000.0, 2_000.0, count)
        self._height_m = rng.uniform(_LOWEST_M, _HIGHEST_M, count)
        self._speed_m_s = rng.uniform(_SLOWEST_M_S, _FASTEST_M_S, count)
        self._start_m = rng.uniform(0.0, 2.0 * HEARD_WITHIN_M, count)

    def __len__(self) -> int:
        return len(self._heading)

    def heard(self, time_us: int) -> list[Aircraft]:
        """What the receiver hears at a time."""
        return [self._aircraft(i, time_us * 1e-6) for i in range(len(self))]

    def _aircraft(self, i: int, time_s: float) -> Aircraft:
        heading, speed = float(self._heading[i]), float(self._speed_m_s[i])
        along = (float(self._start_m[i]) + speed * time_s) % (2.0 * HEARD_WITHIN_M) - HEARD_WITHIN_M
        aside = float(self._aside_m[i])
        north, east = along * cos(heading) - aside * sin(heading), along * sin(heading) + aside * cos(heading)
        lat_deg, lon_deg, alt_m = geodetic_from_ned(north, east, -float(self._height_m[i]), self._home)
        return Aircraft(0x4B0001 + i, f"HB-{i + 100}", lat_deg, lon_deg, alt_m, heading, speed, 0.0, _LIGHT, 7000)
