"""Missions whose item 0 is home, as ArduPilot's clients number them, from and to ours, which begin with a real item."""

from collections.abc import Sequence
from dataclasses import replace

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.item_lists import MissionItem
from autopilot.interface.vehicle_state import VehicleState

_JUMP = mavlink.MAV_CMD_DO_JUMP


def with_home(items: Sequence[MissionItem], state: VehicleState) -> list[MissionItem]:
    """Our mission as clients see it: home before the first item, every number one higher; an empty one stays empty."""
    if not items:
        return []
    return [home_item(state), *(_moved(item, 1) for item in items)]


def home_item(state: VehicleState) -> MissionItem:
    """Home as item 0; the position of power-on while there is no home."""
    home = state.home or state.origin
    return MissionItem(
        0, mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_CMD_NAV_WAYPOINT, (0.0,) * 4, home.lat_deg, home.lon_deg, home.alt_m
    )


def without_home(items: Sequence[MissionItem]) -> list[MissionItem]:
    """A client's mission as we keep it; home alone is how a mission is cleared."""
    return [_moved(item, -1) for item in items[1:]]


def _moved(item: MissionItem, by: int) -> MissionItem:
    params = item.params
    if item.command == _JUMP:  # to the first item at least: there is nothing to fly to in a jump to home
        params = (max(params[0] + by, 0.0), *params[1:])
    return replace(item, seq=item.seq + by, params=params)
