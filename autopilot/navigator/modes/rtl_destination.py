"""Where a return leads: home, a rally point, the landing of the mission, or home back along the mission (RTL_TYPE)."""

from dataclasses import dataclass
from enum import IntEnum
from math import hypot, nan

from autopilot.interface.item_lists import MissionItem
from autopilot.navigator.context import NavContext
from autopilot.navigator.fence.fence import Fence
from autopilot.navigator.fence.rally_points import RallyPoints
from autopilot.navigator.mission.item_commands import RELATIVE_FRAMES
from autopilot.navigator.mission.mission import Mission
from autopilot.navigator.setpoint import Vector


class ReturnType(IntEnum):
    """RTL_TYPE, PX4's numbers."""

    NEAREST_SAFE_POINT = 0  # home or a rally point
    RALLY_OR_LANDING = 1
    ALONG_MISSION = 2
    NEAREST_OF_ALL = 3
    ALONG_MISSION_SHORTER = 4  # forward or back, by the number of items
    RALLY = 5


@dataclass(frozen=True, slots=True)
class Destination:
    """The end of a return."""

    position: Vector  # [m] on the ground, or of the mission item where a landing begins
    name: str
    yaw: float = nan  # [rad] to land with
    lowest_d: float = nan  # [m] down coordinate below which the way there does not lead
    landing_item: int | None = None  # from which the mission is flown
    back: tuple[Vector, ...] = ()  # the mission's places on the way back, nearest first


class Destinations:
    """Everything a vehicle may return to.

    Args:
        context: what the navigator's modes share.
        rally: the stored rally points.
        mission: the stored mission.
        fence: what lies outside of it is no position to return to.
    """

    __slots__ = ("_context", "_fence", "_mission", "_rally")

    def __init__(self, context: NavContext, rally: RallyPoints, mission: Mission, fence: Fence) -> None:
        self._context = context
        self._rally = rally
        self._mission = mission
        self._fence = fence

    def choose(self) -> Destination:
        """The destination for RTL_TYPE and the present position; home if there is nothing else."""
        kind = ReturnType(int(self._context.number("RTL_TYPE")))
        home = self.home()
        if kind in (ReturnType.ALONG_MISSION, ReturnType.ALONG_MISSION_SHORTER):
            return self._along_mission(home, is_shorter_chosen=kind is ReturnType.ALONG_MISSION_SHORTER)
        positions = self._rally_positions()
        if kind in (ReturnType.RALLY_OR_LANDING, ReturnType.NEAREST_OF_ALL):
            positions += self._landings()
        if kind in (ReturnType.NEAREST_SAFE_POINT, ReturnType.NEAREST_OF_ALL):
            positions.insert(0, home)  # first: of equal ways the one home
        return min(positions, key=self._way_m, default=home)

    def home(self) -> Destination:
        """The position of the take-off, or the one a client has set."""
        state = self._context.state
        return Destination(state.home_ned, "home", state.home_yaw_rad)

    def _rally_positions(self) -> list[Destination]:
        home_d = self._context.state.home_ned[2]
        positions = []
        for item in self._rally.items:
            north, east, down = self._position_of(item)
            if not self._fence.refusal((north, east, home_d)):
                name = f"rally point {item.seq + 1}"
                positions.append(Destination((north, east, home_d), name, lowest_d=min(down, home_d)))
        return positions

    def _landings(self) -> list[Destination]:
        item = self._mission.landing_sequence()
        if item is None:
            return []
        return [Destination(self._mission.position_after(item), "mission landing", landing_item=item)]

    def _along_mission(self, home: Destination, *, is_shorter_chosen: bool) -> Destination:
        state = self._context.state
        landing = self._mission.landing_sequence()
        current = state.mission_current if self._mission.is_begun else 0
        if landing is not None and not (is_shorter_chosen and current < landing - current):
            first = current if self._mission.is_begun and current < landing else landing
            return Destination(self._mission.position_after(first), "mission landing", landing_item=first)
        if not self._mission.is_begun:
            return home
        back = tuple(position for seq, position in self._mission.positions() if seq < current)
        return Destination(home.position, "home along the mission", home.yaw, back=back[::-1])

    def _position_of(self, item: MissionItem) -> Vector:
        context = self._context
        alt_m = item.z
        if item.frame in RELATIVE_FRAMES:
            alt_m += (context.state.home or context.state.origin).alt_m
        return context.pos_ned_of(item.x, item.y, alt_m)

    def _way_m(self, destination: Destination) -> float:
        north, east, _ = self._context.state.estimate.pos_ned
        return hypot(destination.position[0] - north, destination.position[1] - east)
