"""What is round the vehicle, by a ring of range finders, and how fast it may go towards it (collision prevention).

In: distances by bearing, from a sensor on board or from a client (OBSTACLE_DISTANCE). Out: a pilot's velocity, limited
in mode Position so that the vehicle can stop before CP_DIST; for a rover the speed in its lane, in all modes. PX4's
collision prevention, without its guidance of the direction.
"""

from collections.abc import Sequence
from math import cos, floor, inf, isfinite, nan, pi, sin, sqrt

from autopilot.vehicles.planned_limits import planned_accel
from common.attitude import wrapped
from common.params import Parameter, ParameterTable

BINS = 72
FRESH_US = 500_000  # older distances say nothing (PX4: RANGE_STREAM_TIMEOUT)
_BIN_RAD = 2.0 * pi / BINS
_SPREAD_RAD = 0.5 * _BIN_RAD  # to either side of a bearing, where what is at the distance may be
_BESIDE_M = 0.1  # room beside a hull; guess
_PX4 = "PX4 1.15 default"

OBSTACLE_PARAMETERS: list[Parameter] = [
    Parameter("CP_DIST", -1.0, -1.0, 15.0, "m",
              "distance kept to obstacles in mode Position, by a rover in all that hold a speed, negative: no limit",
              _PX4),
    Parameter("CP_DELAY", 0.4, 0.0, 1.0, "s", "delay of sensor and vehicle that the limit allows for", _PX4),
    Parameter("CP_GO_NO_DATA", 0, 0, 1, "", "move where no distance is known: 0 no, 1 yes", _PX4),
]  # fmt: skip


class Obstacles:
    """Distances by bearing, in ned: bin i is centred at i · 5 degrees, clockwise from north.

    Args:
        params: CP_*.
        accel: name of the parameter of the acceleration by which the vehicle stops.
    """

    __slots__ = (
        "_accel",
        "_accel_name",
        "_bearing_rad",
        "_delay_s",
        "_distance_m",
        "_params",
        "_seen_us",
        "body_m",
        "keep_m",
        "sensed_us",
    )

    def __init__(self, params: ParameterTable, accel: str) -> None:
        self._params = params
        self._accel_name = accel
        self._distance_m = [nan] * BINS
        self._bearing_rad = [i * _BIN_RAD for i in range(BINS)]  # of what is at that distance
        self._seen_us = [-FRESH_US - 1] * BINS
        self.body_m: Sequence[float] = ()  # [m] of the sensor on board, clockwise from the nose; inf: nothing there
        self.sensed_us = 0  # when it measured
        self._load()
        params.on_change(self._on_parameter)

    @property
    def is_limiting(self) -> bool:
        """Whether the vehicle shall keep away from obstacles at all."""
        return self.keep_m >= 0.0

    def sensed(self, time_us: int, distances_m: Sequence[float], yaw_rad: float) -> None:
        """The sensor on board has measured: distances evenly spaced, clockwise from the nose."""
        self.body_m, self.sensed_us = distances_m, time_us
        self.reported(time_us, distances_m, yaw_rad, 2.0 * pi / len(distances_m))

    def reported(self, time_us: int, distances_m: Sequence[float], first_rad: float, increment_rad: float) -> None:
        """Distances by bearing have come.

        Args:
            time_us: when.
            distances_m: [m]; NaN: not known, inf: nothing within reach.
            first_rad: bearing of the first one, clockwise from north.
            increment_rad: between two; may be negative.
        """
        nearest: dict[int, tuple[float, float]] = {}
        for i, distance_m in enumerate(distances_m):
            if distance_m == distance_m:
                bearing = first_rad + i * increment_rad
                index = round(bearing / _BIN_RAD) % BINS
                nearest[index] = min((distance_m, bearing), nearest.get(index, (inf, bearing)))
        for index, (distance_m, bearing) in nearest.items():
            self._distance_m[index] = distance_m
            self._bearing_rad[index] = bearing
            self._seen_us[index] = time_us

    def limited(self, north: float, east: float, now_us: int) -> tuple[float, float]:
        """A horizontal velocity [m/s] with which the vehicle can still stop `keep_m` before every obstacle."""
        speed = sqrt(north * north + east * east)
        if speed == 0.0 or (not self._params["CP_GO_NO_DATA"] and not self._knows_ahead(north, east, speed, now_us)):
            return 0.0, 0.0
        fresh = [i for i in range(BINS) if now_us - self._seen_us[i] <= FRESH_US and isfinite(self._distance_m[i])]
        for i in sorted(fresh, key=self._distance_m.__getitem__):  # the nearest takes most; another order pushes back
            bearing = i * _BIN_RAD
            unit_north, unit_east = cos(bearing), sin(bearing)
            excess = north * unit_north + east * unit_east - self._speed_towards(self._distance_m[i])
            if excess > 0.0:
                north -= excess * unit_north
                east -= excess * unit_east
        return north, east

    def room_along(self, heading_rad: float, end_m: float, half_width_m: float, now_us: int) -> float:
        """Speed [m/s] from which it stops `keep_m` before what is in its lane along a heading; inf: any.

        Args:
            heading_rad: of the lane, clockwise from north.
            end_m: from where the distances are measured to the end of the vehicle.
            half_width_m: of the vehicle.
            now_us: now.
        """
        way_m = inf
        for i in range(BINS):
            if now_us - self._seen_us[i] > FRESH_US:
                continue
            angle = abs(wrapped(self._bearing_rad[i] - heading_rad))
            if angle >= 0.5 * pi:
                continue
            distance_m = self._distance_m[i]
            beside_m = distance_m * sin(max(angle - _SPREAD_RAD, 0.0))
            if isfinite(distance_m) and beside_m < half_width_m + _BESIDE_M:
                way_m = min(way_m, distance_m * cos(angle))
        if not self._params["CP_GO_NO_DATA"] and not self.knows_along(heading_rad, now_us):
            return 0.0
        return self._speed_towards(way_m - end_m) if isfinite(way_m) else inf

    def knows_along(self, heading_rad: float, now_us: int) -> bool:
        """Whether there are distances of late straight along a heading."""
        before = floor(heading_rad / _BIN_RAD)
        return any(now_us - self._seen_us[i % BINS] <= FRESH_US for i in (before, before + 1))

    def _knows_ahead(self, north: float, east: float, speed: float, now_us: int) -> bool:
        index = max(range(BINS), key=lambda i: (north * cos(i * _BIN_RAD) + east * sin(i * _BIN_RAD)) / speed)
        return now_us - self._seen_us[index] <= FRESH_US

    def _speed_towards(self, distance_m: float) -> float:
        """Speed [m/s] from which the vehicle stops in time, the delay included; 0 nearer than that."""
        room_m = distance_m - self.keep_m
        if room_m <= 0.0:
            return 0.0
        late = self._accel * self._delay_s
        return sqrt(late * late + 2.0 * self._accel * room_m) - late

    def _load(self) -> None:
        self.keep_m = float(self._params["CP_DIST"])
        self._delay_s = float(self._params["CP_DELAY"])
        self._accel = planned_accel(float(self._params[self._accel_name]))

    def _on_parameter(self, parameter: Parameter) -> None:
        if parameter.name.startswith("CP_") or parameter.name == self._accel_name:
            self._load()
