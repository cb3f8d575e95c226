"""What the vehicles of a fleet hear of each other by ADS-B, once a second.

In: each one's own GNSS fix, as its receiver tells it. Out: reports to all others within hearing.
"""

from collections.abc import Sequence
from math import atan2, hypot, tau

from autopilot.interface.aircraft import Aircraft
from common.geodesy import geodetic_from_ned
from mission.flight_base import FlightBase
from sim.simulated_traffic import HEARD_WITHIN_M

PERIOD_US = 1_000_000
_ICAO = 0x4B1000  # beyond those of `sim.simulated_traffic`
_SMALL_DRONE, _SURFACE = 14, 17  # ADSB_EMITTER_TYPE: UAV, SURFACE
_FIX_3D = 3
_SQUAWK = 7000  # of who flies by sight


class Transponders:
    """One on board of each vehicle.

    Args:
        flights: of the fleet.
    """

    def __init__(self, flights: Sequence[FlightBase]) -> None:
        self._flights = flights
        self._samples = [flight.rig.rows["sensors"]["samples"] for flight in flights]
        self._next_us = PERIOD_US

    def frame(self, time_us: int) -> None:
        """Tells everybody where the others are, when it is due; before the flight controllers' frame."""
        if time_us < self._next_us:
            return
        self._next_us = time_us + PERIOD_US
        reports = [self._aircraft(i) for i in range(len(self._flights))]
        for i, flight in enumerate(self._flights):
            for j, (there_ned, aircraft) in enumerate(reports):
                here_ned, _ = reports[i]
                if i != j and aircraft is not None and _distance_m(here_ned, there_ned) < HEARD_WITHIN_M:
                    flight.controller.traffic.report(aircraft)

    def _aircraft(self, i: int) -> tuple[tuple[float, float, float], Aircraft | None]:
        flight, fix = self._flights[i], self._samples[i]["gnss"][0]
        north, east, down = (float(axis) for axis in fix["pos_ned"])
        if int(fix["fix_type"]) < _FIX_3D:
            return (north, east, down), None
        lat_deg, lon_deg, alt_m = geodetic_from_ned(north, east, down, flight.config.home)
        north_m_s, east_m_s, down_m_s = (float(axis) for axis in fix["vel_ned"])
        number = flight.drone.system_id
        heading = atan2(east_m_s, north_m_s) % tau
        speed, kind = hypot(north_m_s, east_m_s), _SURFACE if flight.drives else _SMALL_DRONE
        name = f"HG{number:03d}"
        return (north, east, down), Aircraft(
            _ICAO + number, name, lat_deg, lon_deg, alt_m, heading, speed, -down_m_s, kind, _SQUAWK
        )


def _distance_m(here_ned: tuple[float, float, float], there_ned: tuple[float, float, float]) -> float:
    return hypot(*(here - there for here, there in zip(here_ned, there_ned, strict=True)))
