"""OBSTACLE_DISTANCE: what the ring sensor on board measures, told; what a client measures, taken in."""

from collections.abc import Mapping
from math import inf, isnan, nan, radians
from typing import Any

from autopilot.interface.vehicle_state import Severity
from autopilot.mavlink.channel import Endpoint, Sender
from autopilot.mavlink.service import Handler, Service
from autopilot.mavlink.wire.convert import UINT16_MAX
from autopilot.mavlink.wire.number_bounds import ANGLE_MAX_RAD, is_known
from autopilot.ports import YAW_ALIGNED

_NORTH_FRAMES = frozenset({0, 1})  # GLOBAL, LOCAL_NED
_BODY_FRAMES = frozenset({8, 12})  # BODY_NED, BODY_FRD


class ObstacleService(Service):
    """Takes distances of others in."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint

    def messages(self) -> Mapping[str, Handler]:
        return {"OBSTACLE_DISTANCE": self.distances_received}

    def distances_received(self, _: Sender, fields: Any) -> None:
        """Takes distances by bearing, which limit the speed in mode Position (CP_DIST)."""
        vehicle = self._endpoint.vehicle
        first_rad = radians(fields.angle_offset)
        if fields.frame in _BODY_FRAMES:
            if not vehicle.state.estimate.flags & YAW_ALIGNED:
                return
            first_rad += vehicle.state.yaw_rad
        elif fields.frame not in _NORTH_FRAMES:
            self._endpoint.text_once(Severity.WARNING, f"Obstacles: frame {fields.frame} is not supported")
            return
        increment_deg = fields.increment if isnan(fields.increment_f) else fields.increment_f or fields.increment
        if not is_known(ANGLE_MAX_RAD, first_rad, radians(increment_deg)):
            self._endpoint.text_once(Severity.WARNING, "Obstacles: the bearing is out of range")
            return
        if not increment_deg:
            return
        distances_m = [_metres(value, fields.max_distance) for value in fields.distances]
        vehicle.obstacles.reported(self._endpoint.time_us, distances_m, first_rad, radians(increment_deg))


def _metres(distance_cm: int, max_cm: int) -> float:
    """[m]; NaN: not known, inf: nothing within reach."""
    if distance_cm == UINT16_MAX:
        return nan
    return inf if distance_cm > max_cm else distance_cm * 0.01
