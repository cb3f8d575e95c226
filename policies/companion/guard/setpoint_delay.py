"""How much later than usual setpoints reach the vehicle, by how long it takes to answer.

In: a TIMESYNC sent twice a second, and the answers of the vehicle. Out: what the guard adds to its reaction. Autopilots
answer at once, so that the round trip is the link's: what telemetry is late by counts as well, since no age on its
clock tells it. One that does not answer is taken to be no later than usual.
"""

from collections import deque
from statistics import median_low
from typing import Any

from autopilot.mavlink.channel import AUTOPILOT_COMPONENT
from policies.companion.telemetry import NEVER_US
from policies.companion.vehicle_link import VehicleLink

_PERIOD_US = 500_000
_ASKED = 8  # requests that an answer may be to
_KEPT = 5  # round trips, of which the median counts
_FRAME_US = 20_000  # of a link without delay
_MOST_S = 0.7  # more changes nothing: it hardly moves then


class SetpointDelay:
    """Of one vehicle's link."""

    def __init__(self) -> None:
        self._vehicle: VehicleLink | None = None
        self._asked_us: deque[int] = deque([NEVER_US], maxlen=_ASKED)
        self._trips_us: deque[int] = deque(maxlen=_KEPT)

    def attach(self, vehicle: VehicleLink) -> None:
        """Hears the vehicle's answers."""
        self._vehicle = vehicle
        vehicle.listen("TIMESYNC", self._answered)

    def step(self, time_us: int) -> None:
        """Asks, if it is time [us] on the companion's clock."""
        if self._vehicle is not None and time_us - self._asked_us[-1] >= _PERIOD_US:
            self._asked_us.append(time_us)
            self._vehicle.send("TIMESYNC", ts1=time_us * 1000)

    def _answered(self, system: int, component: int, fields: Any, time_us: int) -> None:
        if self._vehicle is None or (system, component) != (self._vehicle.system_id, AUTOPILOT_COMPONENT):
            return
        if fields.tc1 and fields.ts1 // 1000 in self._asked_us:  # not the vehicle's own request, nor for somebody else
            self._trips_us.append(time_us - fields.ts1 // 1000)

    @property
    def late_s(self) -> float:
        """In whole frames beyond the first; 0: as usual."""
        trip_us = median_low(self._trips_us) if self._trips_us else 0
        return min(max(trip_us // _FRAME_US - 1, 0) * _FRAME_US * 1e-6, _MOST_S)
