"""Stops what drives before obstacles in its lane, ahead and behind, whatever mode drives it at a speed.

In: the ring of distances, the heading. Out: the greatest speeds along the nose and backwards, with the setpoint.
"""

from math import inf, pi

from autopilot.inputs.obstacles import Obstacles
from autopilot.interface.vehicle_interface import Announcer
from autopilot.interface.vehicle_state import Severity, VehicleState
from autopilot.navigator.setpoint import SetpointPort
from autopilot.vehicles.vehicle_class import Lane

_AHEAD, _BEHIND = "ahead", "behind"
_FREE_M_S = 0.5  # with so much room the next stop is told again; guess


class ObstacleStop:
    """Of one vehicle.

    Args:
        state: the vehicle as of this frame.
        obstacles: what is round it.
        setpoint: bounded here.
        announcer: is told once of each stop.
        lane: the room that it takes.
    """

    __slots__ = ("_announcer", "_lane", "_obstacles", "_reported", "_setpoint", "_state")

    def __init__(
        self, state: VehicleState, obstacles: Obstacles, setpoint: SetpointPort, announcer: Announcer, lane: Lane
    ) -> None:
        self._state = state
        self._obstacles = obstacles
        self._setpoint = setpoint
        self._announcer = announcer
        self._lane = lane
        self._reported = {_AHEAD: False, _BEHIND: False}

    def frame(self) -> None:
        """Renews the bounds."""
        state, obstacles = self._state, self._obstacles
        if not obstacles.is_limiting:
            self._setpoint.leave_room(inf, inf)
            return
        lane, yaw, now_us = self._lane, state.yaw_rad, state.time_us
        ahead = obstacles.room_along(yaw, lane.front_m, lane.half_width_m, now_us)
        back = obstacles.room_along(yaw + pi, lane.rear_m, lane.half_width_m, now_us)
        self._setpoint.leave_room(ahead, back)
        is_backing = self._setpoint.is_backing
        self._tell(_AHEAD, ahead, is_on_the_way=not is_backing, has_ranges=obstacles.knows_along(yaw, now_us))
        self._tell(_BEHIND, back, is_on_the_way=is_backing, has_ranges=obstacles.knows_along(yaw + pi, now_us))

    def _tell(self, where: str, room: float, *, is_on_the_way: bool, has_ranges: bool) -> None:
        """Says once that there is no room [m/s], where it drives."""
        if room == 0.0 and is_on_the_way and self._state.is_armed and not self._reported[where]:
            self._reported[where] = True
            what = "Obstacle" if has_ranges else "No distances"
            self._announcer.statustext(Severity.NOTICE, f"{what} {where}: stopped")
        elif room > _FREE_M_S:
            self._reported[where] = False
