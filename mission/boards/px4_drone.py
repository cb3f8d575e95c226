"""The scripting client of a real PX4: what differs from our own vehicle, which speaks its language."""

from collections.abc import Sequence
from dataclasses import replace
from math import nan, pi
from typing import Any

from mission.boards.outside_drone import FRAME_GLOBAL_INT, OutsideDrone
from mission.client import CommandRefused
from mission.plan.plan_file import PlanItem
from mission.script import CMD_TAKEOFF, FRAME_GLOBAL, MAIN_AUTO

TAKES_IN_S = 3.0  # guess: until its navigator has read a mission that has been acknowledged
RETRY_S = 0.2
TAKING_OFF = (MAIN_AUTO, 2)  # main and sub mode
MAIN_MANUAL = 1
FIXED_WING = 1  # MAV_TYPE
FORGETS_IN_S = 1.5  # its TECS forgets what it has not been asked for a second
CMD_LOITER_TURNS, CMD_LOITER_TIME = 18, 19


class Px4Drone(OutsideDrone):
    """See `Drone`."""

    async def wait_ready(self, timeout_s: float = 60.0) -> None:
        """A plane's reference of height begins at sea level, and climbs at 3 m/s to where it is; so it is forgotten."""
        await super().wait_ready(timeout_s)
        heartbeat = self.latest("HEARTBEAT")
        if heartbeat is not None and heartbeat.type == FIXED_WING and not self.is_armed:
            await self._set_mode(MAIN_MANUAL, 0, "manual")  # which holds no height
            await self.sleep(FORGETS_IN_S)
            await self.hold()

    async def takeoff(self, height_m: float, timeout_s: float = 60.0) -> None:
        """It is there when it leaves its take-off, within its own tolerance of the height."""
        alt_amsl_m = self.home.alt_m + height_m
        await self.command(CMD_TAKEOFF, nan, 0.0, 0.0, nan, nan, nan, alt_amsl_m, name="takeoff")
        await self.until(lambda: self.px4_mode == TAKING_OFF, 3.0, "mode takeoff")
        await self.until(lambda: self.px4_mode != TAKING_OFF, timeout_s, f"takeoff to {height_m:g} m")

    async def upload(self, items: Sequence[PlanItem], mission_type: int = 0) -> None:
        """It counts no turns: a plane circles as long as they take."""
        if any(item.command == CMD_LOITER_TURNS for item in items):
            airspeed_m_s = await self.get_parameter("FW_AIRSPD_TRIM")
            items = [_timed(item, airspeed_m_s) if item.command == CMD_LOITER_TURNS else item for item in items]
        await super().upload(items, mission_type)

    async def command_int(self, command: int, frame: int, *fields: Any, **options: Any) -> Any:
        """It takes places in GLOBAL_INT, and in no other frame."""
        return await super().command_int(
            command, FRAME_GLOBAL_INT if frame == FRAME_GLOBAL else frame, *fields, **options
        )

    async def start_mission(self, first: int = 0) -> None:
        end_us = self.time_us + int(TAKES_IN_S * 1e6)
        while True:
            try:
                return await super().start_mission(first)
            except CommandRefused:
                if self.time_us >= end_us:
                    raise
            await self.sleep(RETRY_S)


def _timed(item: PlanItem, airspeed_m_s: float) -> PlanItem:
    """Turns as the time that they take."""
    turns, _, radius_m, leaves = item.params
    seconds = turns * 2.0 * pi * abs(radius_m) / airspeed_m_s
    return replace(item, command=CMD_LOITER_TIME, params=(seconds, 0.0, radius_m, leaves))
