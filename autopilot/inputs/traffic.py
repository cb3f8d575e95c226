"""Other aircraft as an ADS-B receiver reports them, and whether one comes too near.

In: reports, each with its time. Out: the list, bounded, and the conflict that the failsafe table acts on.
"""

from math import hypot, inf

from autopilot.interface.aircraft import Aircraft
from autopilot.interface.vehicle_state import VehicleState
from common.geodesy import ned_from_geodetic
from common.params import Parameter, ParameterTable

AIRCRAFT_MAX = 50
FORGOTTEN_US = 30_000_000  # an aircraft not reported for longer is gone
CONFLICT_US = 3_000_000  # a conflict is over when no report has confirmed it for that long

TRAFFIC_PARAMETERS: list[Parameter] = [
    Parameter("NAV_TRAFF_AVOID", 1, 0, 4, "", "aircraft near: 0 nothing, 1 warn, 2 return, 3 land, 4 hold",
              "PX4 1.15 default"),
    Parameter("NAV_TRAFF_A_HOR", 500.0, 0.0, 10_000.0, "m", "horizontal distance of an aircraft that is near",
              "PX4 1.15 default"),
    Parameter("NAV_TRAFF_A_VER", 500.0, 0.0, 5_000.0, "m", "vertical distance of an aircraft that is near",
              "PX4 1.15 default"),
]  # fmt: skip


class Traffic:
    """Everything the vehicle has heard of lately.

    Args:
        state: the vehicle; `traffic_conflict_us` is written here.
        params: NAV_TRAFF_*.
    """

    def __init__(self, state: VehicleState, params: ParameterTable) -> None:
        self._state = state
        self._params = params
        self._heard: dict[int, tuple[int, Aircraft]] = {}  # by address, heard longest ago first

    def report(self, aircraft: Aircraft) -> None:
        """An aircraft has been heard."""
        now_us = self._state.time_us
        self._heard.pop(aircraft.icao, None)
        self._heard[aircraft.icao] = (now_us, aircraft)
        if len(self._heard) > AIRCRAFT_MAX:
            self._heard.pop(next(iter(self._heard)))
        nearest = self._state.nearest_aircraft
        if nearest is None or nearest.icao == aircraft.icao or self._distance_m(aircraft) < self._distance_m(nearest):
            self._state.nearest_aircraft = aircraft
        if self._is_near(aircraft):
            self._state.traffic_conflict_us = now_us + CONFLICT_US

    def known(self) -> list[Aircraft]:
        """The aircraft heard lately, the nearest first."""
        oldest_us = self._state.time_us - FORGOTTEN_US
        for icao in [icao for icao, (heard_us, _) in self._heard.items() if heard_us < oldest_us]:
            del self._heard[icao]
        return sorted((aircraft for _, aircraft in self._heard.values()), key=self._distance_m)

    def _is_near(self, aircraft: Aircraft) -> bool:
        is_level = abs(aircraft.alt_amsl_m - self._state.position.alt_m) < self._params["NAV_TRAFF_A_VER"]
        return is_level and self._distance_m(aircraft) < self._params["NAV_TRAFF_A_HOR"]

    def _distance_m(self, aircraft: Aircraft) -> float:
        estimate = self._state.estimate
        if estimate is None:
            return inf
        there = ned_from_geodetic(aircraft.lat_deg, aircraft.lon_deg, self._state.origin.alt_m, self._state.origin)
        return hypot(there[0] - estimate.pos_ned[0], there[1] - estimate.pos_ned[1])
