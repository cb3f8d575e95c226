"""Where to navigate to: a goto of a client, or the waypoints of the vehicle's plan, one after the other.

In: a DO_REPOSITION sent to the companion itself; the place that the vehicle says it goes to in Hold or Guided
(POSITION_TARGET_GLOBAL_INT), which is how a ground station's or MAVSDK's goto to the autopilot is heard; the plan. Out:
the next goal in the vehicle's ned frame. A goto comes before the plan, and is over when it has been reached.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import dist, isfinite, isnan, nan, radians
from typing import Any

from autopilot.interface.item_lists import ItemRefusal, MissionItem
from autopilot.interface.vehicle_state import Mode, Severity
from autopilot.mavlink.client_end import AUTOPILOT_COMPONENT
from autopilot.mavlink.wire.convert import INT32_MAX, degrees_from_e7, is_position
from autopilot.mavlink.wire.number_bounds import POSITION_MAX_M, is_known, is_within
from autopilot.navigator.fence.fence_items import fence_shapes
from autopilot.navigator.fence.fence_region import region_of
from common.attitude import Vector
from common.geodesy import ned_from_geodetic
from policies.companion.vehicle_link import COMPONENT, VehicleLink
from policies.companion.where_to.plan_download import PlanDownload

YAW_MAX_RAD = 100.0  # some turn too often
FAR_M = 1000.0  # guess: farther is a mistake
NEAR_M = 10.0  # of what flies 5 m/s; guess
MOVED_M = 1.0  # a place that the vehicle goes to has changed if it is so far from the last
_DO_REPOSITION, _NAV_WAYPOINT = 192, 16
_ACCEPTED, _TEMPORARILY_REJECTED, _DENIED = 0, 1, 2  # MAV_RESULT
_ABOVE_SEA, _ABOVE_HOME = frozenset({0, 5}), frozenset({3, 6})  # MAV_FRAME
_GOTO_MODES = (Mode.HOLD, Mode.GUIDED)
_FREE_POSITION, _FREE_YAW = 0b111, 1 << 10  # type_mask


@dataclass(frozen=True, slots=True)
class Goal:
    """A place to navigate to."""

    pos_ned: Vector  # [m]; down is NaN where the height does not matter
    name: str  # for the pilot: "goto", "waypoint 2 of 5"
    yaw: float = nan  # [rad] heading there; NaN: any
    is_last: bool = True  # nothing comes after it


class Goals:
    """What one vehicle's companion has been asked to reach.

    Args:
        vehicle: whose links it hears.
        is_ordered_by_goto: the vehicle's own goto is an order to fly there; otherwise only a place to fly to.
        near_m: a place nearer than this that the vehicle holds is where it stopped, not where it was sent.
        refusal: why a goto cannot be gone to; "" if it can.
    """

    def __init__(
        self,
        vehicle: VehicleLink,
        *,
        is_ordered_by_goto: bool,
        near_m: float = NEAR_M,
        refusal: Callable[[Goal], str] = lambda _: "",
    ) -> None:
        self._is_ordered_by_goto = is_ordered_by_goto
        self._near_m, self._refusal = near_m, refusal
        self._is_ordered = False
        self._goto: Goal | None = None
        self._target_ned: Vector = (nan, nan, nan)  # that the vehicle went to when it was last heard
        self._has_heard_target = False  # the first may be of a way that had begun before we were there
        self._home_alt_m = nan
        self._items: tuple[MissionItem, ...] = ()  # of the plan as it was last looked at
        self._seq = -1  # that was current then
        self._known = 0  # how much of what tells where its places are
        self._has_reached = False  # something, since the plan was another
        self._waypoints: list[Goal] = []  # that are left
        self.done = ""  # what has been reached, once nothing is left
        self._vehicle = vehicle
        self._plan = PlanDownload(vehicle)
        vehicle.listen("HOME_POSITION", self._home_reported, 0.5)
        vehicle.listen("POSITION_TARGET_GLOBAL_INT", self._target_reported, 10.0)
        vehicle.listen("COMMAND_INT", self._command_int)
        vehicle.listen("COMMAND_LONG", self._command_long)

    def frame(self, time_us: int) -> None:
        """Keeps the plan; before `goal`."""
        self._plan.frame(time_us)
        known, is_new = self._known_count(), (self._plan.items, self._plan.current_seq) != (self._items, self._seq)
        if is_new:
            self._items, self._seq, self._has_reached = self._plan.items, self._plan.current_seq, False
        elif known <= self._known:
            return
        self._known = max(known, self._known)
        left = len(self._waypoints) if self._has_reached else len(self._items)  # of a plan that is under way, or over
        waypoints = self._waypoints_of(self._items, self._seq)
        self._waypoints = waypoints[max(len(waypoints) - left, 0) :]
        if self._waypoints:
            self.done = ""

    def is_ordered(self) -> bool:
        """Whether a goto has asked to be flown since the last call."""
        is_ordered, self._is_ordered = self._is_ordered, False
        return is_ordered

    @property
    def goal(self) -> Goal | None:
        """Where to go next; None: nowhere."""
        return self._goto or (self._waypoints[0] if self._waypoints else None)

    def reached(self) -> Goal | None:
        """Takes note that the goal has been reached, and returns what was."""
        reached, self._has_reached = self.goal, True
        if self._goto is not None:
            self._goto = None
            self._waypoints = []  # the plan was not asked for
        elif self._waypoints:
            self._waypoints = self._waypoints[1:]
        if reached is not None and reached.is_last:
            self.done = f"{reached.name} reached"
        return reached

    # ---- what comes in ----

    def _home_reported(self, sysid: int, compid: int, fields: Any, _: int) -> None:
        if (sysid, compid) == (self._vehicle.system_id, AUTOPILOT_COMPONENT):
            self._home_alt_m = fields.altitude * 1.0e-3

    def _target_reported(self, sysid: int, compid: int, fields: Any, _: int) -> None:
        """The vehicle has said where it goes: a new place far from it, in Hold or Guided, is a goto."""
        vehicle = self._vehicle
        if (sysid, compid) != (vehicle.system_id, AUTOPILOT_COMPONENT):
            return
        own = vehicle.own
        has_heard, self._has_heard_target = self._has_heard_target, True
        if own.mode not in _GOTO_MODES or fields.type_mask & _FREE_POSITION or not (fields.lat_int or fields.lon_int):
            return
        target_ned = self._ned_of(degrees_from_e7(fields.lat_int), degrees_from_e7(fields.lon_int), fields.alt)
        if isinstance(target_ned, str) or dist(target_ned, self._target_ned) < MOVED_M:
            return
        self._target_ned = target_ned
        if has_heard and dist(target_ned[:2], own.pos_ned[:2]) > self._near_m:
            yaw = nan if fields.type_mask & _FREE_YAW else fields.yaw
            refusal = self._take(target_ned, yaw, is_ordered=self._is_ordered_by_goto)
            if refusal:
                vehicle.say(f"Companion: goto refused: {refusal}", Severity.WARNING)

    def _command_int(self, sysid: int, compid: int, fields: Any, _: int) -> None:
        if self._is_goto_to_us(fields):
            lat_deg, lon_deg = degrees_from_e7(fields.x), degrees_from_e7(fields.y)
            is_given = INT32_MAX not in (fields.x, fields.y)
            alt_m = self._alt_amsl_m(fields.frame, fields.z)
            place = (lat_deg if is_given else nan, lon_deg if is_given else nan, alt_m)
            self._goto_received(sysid, compid, place, fields.param4)

    def _command_long(self, sysid: int, compid: int, fields: Any, _: int) -> None:
        if self._is_goto_to_us(fields):
            self._goto_received(sysid, compid, (fields.param5, fields.param6, fields.param7), fields.param4)

    def _is_goto_to_us(self, fields: Any) -> bool:
        is_to_us = (fields.target_system, fields.target_component) == (self._vehicle.system_id, COMPONENT)
        return is_to_us and bool(fields.command == _DO_REPOSITION)

    def _goto_received(self, sysid: int, compid: int, place: Vector, yaw: float) -> None:
        """A goto to the companion itself: always an order.

        Args:
            sysid: of who sent it.
            compid: its component.
            place: latitude, longitude [deg], altitude [m].
            yaw: heading there [rad]; NaN: any.
        """
        vehicle = self._vehicle
        own = vehicle.own
        lat_deg, lon_deg, alt_m = place
        result, reason = _DENIED, "there is no such place"
        if is_within(POSITION_MAX_M, alt_m) and is_position(lat_deg, lon_deg) and isfinite(lat_deg + lon_deg):
            target_ned = self._ned_of(lat_deg, lon_deg, alt_m)
            if isinstance(target_ned, str):
                result, reason = _TEMPORARILY_REJECTED, target_ned
            elif not own.is_under_way:
                why = "armed" if own.is_ground_vehicle else "in the air"
                result, reason = _TEMPORARILY_REJECTED, f"the vehicle is not {why}"
            else:
                reason = self._take(target_ned, yaw, is_ordered=True)
                result = _DENIED if reason else _ACCEPTED
        if result != _ACCEPTED:
            vehicle.say(f"Companion: goto refused: {reason}", Severity.WARNING)
        vehicle.send("COMMAND_ACK", command=_DO_REPOSITION, result=result, target_system=sysid, target_component=compid)

    def _take(self, target_ned: Vector, yaw: float, *, is_ordered: bool) -> str:
        """Makes a place the goal; why not, "" if it is."""
        vehicle = self._vehicle
        away_m = dist(target_ned[:2], vehicle.own.pos_ned[:2])
        if away_m > FAR_M:
            return f"it is {away_m / 1000.0:.1f} km away, {FAR_M / 1000.0:.1f} km allowed"
        goal = Goal(target_ned, "goto", yaw=yaw if is_known(YAW_MAX_RAD, yaw) else nan)
        refusal = self._fence_refusal(target_ned) or self._refusal(goal)
        if refusal:
            return refusal
        self._goto, self.done = goal, ""
        self._is_ordered = is_ordered
        return ""

    def _fence_refusal(self, target_ned: Vector) -> str:
        """Why the vehicle's fence forbids a place."""
        origin = self._vehicle.own.origin
        shapes = fence_shapes(self._plan.fence)
        if origin is None or isinstance(shapes, ItemRefusal):
            return ""
        return "it is outside the fence" if region_of(shapes, origin).clearance(*target_ned[:2]) < 0.0 else ""

    # ---- where places are ----

    def _known_count(self) -> int:
        """How many are known of position and home: a plan may be there before they are."""
        own = self._vehicle.own
        is_placed = own.origin is not None and isfinite(own.pos_ned[0])
        return int(is_placed) + int(isfinite(self._home_alt_m))

    def _ned_of(self, lat_deg: float, lon_deg: float, alt_m: float) -> Vector | str:
        """A place in the vehicle's ned frame, or why it is not known."""
        own = self._vehicle.own
        if own.origin is None or not isfinite(own.pos_ned[0]):
            return "the vehicle's position is not known"
        north, east, down = ned_from_geodetic(lat_deg, lon_deg, own.origin.alt_m if isnan(alt_m) else alt_m, own.origin)
        if not is_known(POSITION_MAX_M, north, east, down):
            return "there is no such place"
        return north, east, nan if isnan(alt_m) else down

    def _alt_amsl_m(self, frame: int, alt_m: float) -> float:
        """Altitude [m]; NaN where it is not known, as of what is given above the ground."""
        if frame in _ABOVE_SEA:
            return alt_m
        return self._home_alt_m + alt_m if frame in _ABOVE_HOME else nan

    def _waypoints_of(self, items: tuple[MissionItem, ...], current_seq: int) -> list[Goal]:
        """The waypoints from the current item on."""
        is_ardupilot = self._vehicle.is_ardupilot  # its item 0 is home
        places = []
        for item in items:
            if item.command != _NAV_WAYPOINT or item.seq < current_seq or (is_ardupilot and item.seq == 0):
                continue
            place = self._ned_of(item.x, item.y, self._alt_amsl_m(item.frame, item.z))
            if not isinstance(place, str):
                yaw_deg = nan if is_ardupilot else item.params[3]  # to ArduPilot's waypoints it is nothing
                places.append((place, radians(yaw_deg) if is_known(360.0, yaw_deg) else nan))
        last = len(places) - 1
        return [Goal(place, f"waypoint {k + 1} of {last + 1}", yaw, k == last) for k, (place, yaw) in enumerate(places)]
