"""The scripting client of a real ArduPilot: the same actions as `Drone`, by its modes and its ways.

Our own vehicle speaks PX4's to scripts whatever ground stations hear; this is for ArduPilot itself, at the other end of
a board or of a network. Scripts need not know which they have.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import hypot, isnan, radians
from typing import Any

from autopilot.mavlink.wire.codec import Message, message_id
from common.geodesy import ned_from_geodetic
from mission.boards.outside_drone import OutsideDrone
from mission.boards.plane_landing import landing_items
from mission.client import CommandRefused, ScriptTimeout
from mission.plan.plan_file import PlanItem
from mission.script import (
    AUTO_LAND,
    AUTO_LOITER,
    AUTO_MISSION,
    AUTO_RTL,
    CMD_ARM_DISARM,
    CMD_MISSION_START,
    CMD_REPOSITION,
    CMD_SET_MODE,
    CMD_TAKEOFF,
    FORCE_MAGIC,
    FRAME_GLOBAL,
    MAIN_AUTO,
    MAIN_OFFBOARD,
)

CMD_WAYPOINT, CMD_DO_JUMP, CMD_SET_MESSAGE_INTERVAL = 16, 177, 511
AUTO_TAKEOFF = 2
CUSTOM_MODE = 1.0  # MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
CHANGE_MODE = 1.0  # MAV_DO_REPOSITION_FLAGS
# Its numbers of PX4's modes, of what flies and of what drives; its plane's
_COPTER = {
    (MAIN_OFFBOARD, 0): 4,  # GUIDED
    (MAIN_AUTO, AUTO_LOITER): 17,  # BRAKE: LOITER would sink without a throttle stick in the middle
    (MAIN_AUTO, AUTO_MISSION): 3,
    (MAIN_AUTO, AUTO_RTL): 6,
    (MAIN_AUTO, AUTO_LAND): 9,
}
_ROVER = {
    (MAIN_OFFBOARD, 0): 15,
    (MAIN_AUTO, AUTO_LOITER): 4,  # HOLD
    (MAIN_AUTO, AUTO_MISSION): 10,
    (MAIN_AUTO, AUTO_RTL): 11,
}
_PLANE = {
    (MAIN_OFFBOARD, 0): 15,
    (MAIN_AUTO, AUTO_TAKEOFF): 13,
    (MAIN_AUTO, AUTO_LOITER): 12,
    (MAIN_AUTO, AUTO_MISSION): 10,
    (MAIN_AUTO, AUTO_RTL): 11,
}
_FIXED_WING = 1  # MAV_TYPE
_LEVELS_OFF_M = 5.0  # below the height of a plane's take-off, that it takes its time for: guess
_CIRCLED = 1.3  # of its circle's radius, within which a plane is where it was sent: guess
_CIRCLED_M = 10.0  # and of height: guess
_WIND_S, _CALM_M_S = 3.0, 1.5  # how long its estimate is waited for; a weaker wind has no direction: guess
_LANDING_S = 600.0  # that a plane may take: it comes back first, and lands against the wind
_POSITION, _CONSTANT_POSITION = 16 | 512, 128  # EKF_STATUS_FLAGS: horizontal, absolute, estimated or predicted; none


class ArduPilotDrone(OutsideDrone):
    """See `Drone`."""

    sends_parameters_as_floats = True
    needs = ("EKF_STATUS_REPORT",)

    @property
    def is_ready(self) -> bool:
        report = self.latest("EKF_STATUS_REPORT")
        knows_place = report is not None and report.flags & _POSITION and not report.flags & _CONSTANT_POSITION
        return super().is_ready and bool(knows_place)

    @property
    def is_plane(self) -> bool:
        heartbeat = self.latest("HEARTBEAT")
        return heartbeat is not None and bool(heartbeat.type == _FIXED_WING)

    @property
    def _modes(self) -> dict[tuple[int, int], int]:
        if self.drives:
            return _ROVER
        return _PLANE if self.is_plane else _COPTER

    @property
    def px4_mode(self) -> tuple[int, int]:
        """PX4's main and sub mode that is nearest to its own; (0, 0): none is."""
        heartbeat = self.latest("HEARTBEAT")
        for mode, number in self._modes.items():
            if heartbeat is not None and heartbeat.custom_mode == number:
                return mode
        return 0, 0

    async def arm(self, *, force: bool = False) -> None:
        if not self.is_armed and not self.drives:
            await self._set_mode(MAIN_OFFBOARD, 0, "guided")  # it is not armed in LAND or RTL
        attitude = self.latest("ATTITUDE")
        self._runway_rad = 0.0 if attitude is None else attitude.yaw
        await self.command(CMD_ARM_DISARM, 1.0, FORCE_MAGIC if force else 0.0, name="arm")
        await self.until(lambda: self.is_armed, 5.0, "armed")

    async def takeoff(self, height_m: float, timeout_s: float = 60.0) -> None:
        if self.is_plane:
            await self._run_and_climb(height_m, timeout_s)
            return
        await self._set_mode(MAIN_OFFBOARD, 0, "guided")
        await self.command(CMD_TAKEOFF, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, height_m, name="takeoff")
        await self.until(lambda: abs(self._height_m() - height_m) < 0.3, timeout_s, f"takeoff to {height_m:g} m")
        await self.hold()

    async def _run_and_climb(self, height_m: float, timeout_s: float) -> None:
        """A plane's take-off, along the runway that it stands on; it circles there."""
        await self.set_parameter("TKOFF_ALT", height_m)
        await self._set_mode(MAIN_AUTO, AUTO_TAKEOFF, "takeoff")
        await self.until(lambda: self._height_m() > height_m - _LEVELS_OFF_M, timeout_s, f"takeoff to {height_m:g} m")
        await self.hold()

    async def goto(
        self,
        lat_deg: float,
        lon_deg: float,
        alt_amsl_m: float,
        *,
        yaw_rad: float = float("nan"),
        speed_m_s: float = -1.0,
        acceptance_m: float = 1.0,
        timeout_s: float = 120.0,
    ) -> None:
        params = (speed_m_s, CHANGE_MODE, 0.0, 0.0 if isnan(yaw_rad) else yaw_rad)
        place = round(lat_deg * 1e7), round(lon_deg * 1e7), alt_amsl_m
        await self.command_int(CMD_REPOSITION, FRAME_GLOBAL, params, *place, name="goto")
        if self.is_plane:
            await self._until_circled(lat_deg, lon_deg, alt_amsl_m, timeout_s)
        else:
            await self._until_there(lat_deg, lon_deg, alt_amsl_m, acceptance_m, timeout_s)

    async def _until_circled(self, lat_deg: float, lon_deg: float, alt_amsl_m: float, timeout_s: float) -> None:
        """A plane goes round the place, at its height."""
        radius_m = abs(await self.get_parameter("WP_LOITER_RAD"))
        north_m, east_m, down_m = ned_from_geodetic(lat_deg, lon_deg, alt_amsl_m, self.origin)

        def is_there() -> bool:
            north, east, down = self.pos_ned
            return hypot(north - north_m, east - east_m) < _CIRCLED * radius_m and abs(down - down_m) < _CIRCLED_M

        await self.until(is_there, timeout_s, "goto")

    async def land(self, timeout_s: float = 120.0) -> None:
        if self.is_plane:
            await self._land_by_mission(max(timeout_s, _LANDING_S))
            return
        await self._set_mode(MAIN_AUTO, AUTO_LAND, "land")
        await self.wait_disarmed(timeout_s)

    async def _land_by_mission(self, timeout_s: float) -> None:
        """A plane lands where it took off, against the wind; the mission that it had is lost."""
        await self.upload(landing_items(self.home, await self._landing_rad()))
        await self.start_mission()
        await self.wait_disarmed(timeout_s)

    async def _landing_rad(self) -> float:
        """Where the wind comes from, by its estimate; in a calm the direction in which it took off."""
        await self.command(CMD_SET_MESSAGE_INTERVAL, float(message_id("WIND")), 1e6, name="wind")
        try:
            await self.until(lambda: self.latest("WIND") is not None, _WIND_S, "wind")
        except ScriptTimeout:
            return self._runway_rad
        wind = self.latest("WIND")
        return radians(wind.direction) if wind.speed > _CALM_M_S else self._runway_rad

    _runway_rad = 0.0  # its heading when it was armed
    _farthest = 0  # item that it has gone for, since its mission began
    _stale: Any = None  # of the mission before

    def frame(self, time_us: int) -> None:
        super().frame(time_us)
        current = self.latest("MISSION_CURRENT")
        if current is not None and current is not self._stale and self.is_armed:
            self._farthest = max(self._farthest, current.seq)

    @property
    def is_mission_complete(self) -> bool:
        """As it says; a copter that has landed by its last item begins anew, and says nothing."""
        current = self.latest("MISSION_CURRENT")
        has_ended = current is not None and 0 < current.total <= self._farthest and not self.is_armed
        return super().is_mission_complete or has_ended

    async def start_mission(self, first: int = 0) -> None:
        self.reached.clear()
        self._farthest, self._stale = 0, self.latest("MISSION_CURRENT")
        if not self.is_armed:
            await self.arm()
        await self._set_mode(MAIN_AUTO, AUTO_MISSION, "mission")
        await self.command(CMD_MISSION_START, float(first), 0.0, name="start mission")

    async def wait_disarmed(self, timeout_s: float = 120.0) -> None:
        """A rover stays armed where its mission ends: it is disarmed there."""
        if not self.drives:
            await super().wait_disarmed(timeout_s)
            return
        await self.until(lambda: not self.is_armed or self.is_mission_complete, timeout_s, "mission complete")
        if self.is_armed:
            await self.disarm()

    async def upload(self, items: Sequence[PlanItem], mission_type: int = 0) -> None:
        """Item 0 of ArduPilot's missions is home: those of a plan follow it."""
        if mission_type == 0:
            home = self.home
            first = PlanItem(0, FRAME_GLOBAL, CMD_WAYPOINT, (0.0,) * 4, home.lat_deg, home.lon_deg, home.alt_m)
            items = [first, *(_one_later(_whole(item)) for item in items)]
        await super().upload(items, mission_type)

    def _note(self, message: Message) -> None:
        super()._note(message)
        if message.name != "STATUSTEXT":
            self.reached[-1] -= 1

    async def _set_mode(self, main: int, sub: int, name: str) -> None:
        number = self._modes.get((main, sub))
        if number is None:
            raise CommandRefused(name, 2, "ArduPilot has no such mode for this vehicle")
        await self.command(CMD_SET_MODE, CUSTOM_MODE, float(number), name=name)
        await self.until(lambda: self.latest("HEARTBEAT").custom_mode == number, 3.0, f"mode {name}")


def _one_later(item: PlanItem) -> PlanItem:
    """The item behind home, where jumps lead one further, too."""
    target, repeat, p3, p4 = item.params
    params = (target + 1.0, repeat, p3, p4) if item.command == CMD_DO_JUMP else item.params
    return replace(item, seq=item.seq + 1, params=params)


def _whole(item: PlanItem) -> PlanItem:
    """Without NaN, which it refuses: 0 is its word for what is not given."""
    p1, p2, p3, p4 = (0.0 if isnan(value) else value for value in item.params)
    return replace(item, params=(p1, p2, p3, p4))
