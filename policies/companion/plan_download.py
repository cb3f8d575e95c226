"""The vehicle's plan, as a client of the mission protocol gets it.

In: MISSION_CURRENT, which says that there is one; MISSION_COUNT and MISSION_ITEM_INT, which are asked for. Out: its
items, and the one that is current. It is asked for anew now and then: not every autopilot says when it has changed.
"""

from typing import Any

from autopilot.interface.item_lists import MissionItem
from autopilot.mavlink.client_end import AUTOPILOT_COMPONENT
from autopilot.mavlink.wire.item_messages import item_from_fields
from policies.companion.vehicle_link import COMPONENT, NEVER_US, VehicleLink

RENEW_US = 5_000_000
PATIENCE_US = 500_000  # for each answer
ITEMS_MAX = 1000  # guess: a longer plan is none of ours
_MISSION = 0  # MAV_MISSION_TYPE


class PlanDownload:
    """Keeps the plan of one vehicle."""

    def __init__(self, vehicle: VehicleLink) -> None:
        self.items: tuple[MissionItem, ...] = ()
        self.current_seq = 0
        self._vehicle = vehicle
        self._awaited = 0  # items of the download under way; 0: none
        self._coming: list[MissionItem] = []
        self._asked_us = NEVER_US
        vehicle.listen("MISSION_CURRENT", self._current, 2.0)
        vehicle.listen("MISSION_COUNT", self._count)
        vehicle.listen("MISSION_ITEM_INT", self._item)

    def frame(self, time_us: int) -> None:
        """Asks for what is due."""
        if self._awaited:
            if time_us - self._asked_us > PATIENCE_US:
                self._awaited = 0  # begun anew, below, when the next renewal is due
        elif time_us - self._asked_us > RENEW_US:
            self._asked_us = time_us
            self._vehicle.ask("MISSION_REQUEST_LIST", mission_type=_MISSION)

    def _is_ours(self, sysid: int, compid: int, fields: Any) -> bool:
        is_vehicle = sysid == self._vehicle.system_id and compid == AUTOPILOT_COMPONENT
        is_to_us = fields.target_system == sysid and fields.target_component == COMPONENT
        return is_vehicle and is_to_us and fields.mission_type == _MISSION

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
        self._vehicle.ask("MISSION_REQUEST_INT", seq=len(self._coming), mission_type=_MISSION)

    def _finish(self) -> None:
        self.items, self._coming, self._awaited = tuple(self._coming), [], 0
        self._vehicle.ask("MISSION_ACK", type=0, mission_type=_MISSION)
