"""The vehicle's plan and its fence, as a client of the mission protocol gets them.

In: MISSION_CURRENT, which says that there is a plan; MISSION_COUNT and MISSION_ITEM_INT, which are asked for. Out: the
items of both, and the one that is current. They are asked for anew now and then, one after the other: not every
autopilot says when they have changed.
"""

from typing import Any

from autopilot.interface.item_lists import MissionItem
from autopilot.mavlink.client_end import AUTOPILOT_COMPONENT
from autopilot.mavlink.wire.item_messages import item_from_fields
from policies.companion.telemetry import NEVER_US
from policies.companion.vehicle_link import COMPONENT, VehicleLink

RENEW_US = 5_000_000
PATIENCE_US = 500_000  # for each answer
ITEMS_MAX = 1000  # guess: a longer plan is none of ours
_MISSION, _FENCE = 0, 1  # MAV_MISSION_TYPE


class PlanDownload:
    """Keeps the plan and the fence of one vehicle."""

    def __init__(self, vehicle: VehicleLink) -> None:
        self.items: tuple[MissionItem, ...] = ()
        self.fence: tuple[MissionItem, ...] = ()
        self.current_seq = 0
        self._list = _MISSION  # that is asked for
        self._vehicle = vehicle
        self._awaited = 0  # items of the download under way; 0: none
        self._coming: list[MissionItem] = []
        self._asked_us = NEVER_US
        self._is_next_due = False  # the plan is there: the fence
        vehicle.listen("MISSION_CURRENT", self._current, 2.0)
        vehicle.listen("MISSION_COUNT", self._count)
        vehicle.listen("MISSION_ITEM_INT", self._item)

    def frame(self, time_us: int) -> None:
        """Asks for what is due."""
        if self._awaited:
            if time_us - self._asked_us > PATIENCE_US:
                self._awaited = 0  # begun anew, below, when the next renewal is due
        elif time_us - self._asked_us > RENEW_US:
            self._begin(_MISSION, time_us)
        elif self._list == _MISSION and self._is_next_due:
            self._begin(_FENCE, time_us)

    def _begin(self, which: int, time_us: int) -> None:
        self._list, self._asked_us, self._is_next_due = which, time_us, False
        self._vehicle.ask("MISSION_REQUEST_LIST", mission_type=which)

    def _is_ours(self, sysid: int, compid: int, fields: Any) -> bool:
        is_vehicle = sysid == self._vehicle.system_id and compid == AUTOPILOT_COMPONENT
        is_to_us = fields.target_system == sysid and fields.target_component == COMPONENT
        return is_vehicle and is_to_us and fields.mission_type == self._list

    def _current(self, sysid: int, compid: int, fields: Any, _: int) -> None:
        if sysid == self._vehicle.system_id and compid == AUTOPILOT_COMPONENT:
            self.current_seq = fields.seq

    def _count(self, sysid: int, compid: int, fields: Any, time_us: int) -> None:
        if not self._is_ours(sysid, compid, fields) or fields.count > ITEMS_MAX:
            return
        self._awaited, self._coming = fields.count, []
        if fields.count:
            self._ask_next(time_us)
        else:
            self._finish()

    def _item(self, sysid: int, compid: int, fields: Any, time_us: int) -> None:
        if not self._is_ours(sysid, compid, fields) or not self._awaited or fields.seq != len(self._coming):
            return
        self._coming.append(item_from_fields(fields))
        if len(self._coming) < self._awaited:
            self._ask_next(time_us)
        else:
            self._finish()

    def _ask_next(self, time_us: int) -> None:
        self._asked_us = time_us
        self._vehicle.ask("MISSION_REQUEST_INT", seq=len(self._coming), mission_type=self._list)

    def _finish(self) -> None:
        items, self._coming, self._awaited = tuple(self._coming), [], 0
        if self._list == _MISSION:
            self._is_next_due = True
            if repr(items) != repr(self.items):  # NaN, which is not itself, is the same again
                self.items = items
        else:
            self.fence = items
        self._vehicle.ask("MISSION_ACK", type=0, mission_type=self._list)
