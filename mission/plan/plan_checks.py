"""What a value in a plan file may be, and the sentence its user reads when it is something else.

A `Location` is where in the file a value stands; every getter returns the checked value or raises `PlanError`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite, isnan, nan
from typing import Any, NoReturn

from autopilot.interface.item_lists import MissionItem
from common.geodesy import GeoPoint

FLOAT32_MAX = 3.4028234663852886e38  # the protocol sends float32

# MAV_FRAME
FRAME_GLOBAL = 0
FRAME_MISSION = 2
FRAME_GLOBAL_RELATIVE_ALT = 3
KNOWN_FRAMES = (FRAME_GLOBAL, FRAME_MISSION, FRAME_GLOBAL_RELATIVE_ALT, 5, 6, 10, 11)  # _INT twins, above terrain

# MAV_CMD
NAV_WAYPOINT = 16
DO_JUMP = 177
FENCE_AND_RALLY_COMMANDS = range(5000, 5101)
# waypoint, loiters, land, takeoff, loiter to altitude, ROI, spline, set home, return path, land start, ROI, gate
COMMANDS_WITH_POSITION = frozenset({16, 17, 18, 19, 21, 22, 31, 80, 82, 179, 188, 189, 195, 201, 4501})
COMMANDS_THAT_NEED_POSITION = frozenset({16, 17, 18, 19, 31, 82})


class PlanError(ValueError):
    """The plan file is missing, truncated or wrong; the message is one sentence for the user."""


@dataclass(frozen=True, slots=True)
class Location:
    """A location in a file, as errors name it: `mission.plan: item 3`."""

    text: str

    def inside(self, part: str) -> "Location":
        return Location(f"{self.text}: {part}")

    def error(self, sentence: str) -> PlanError:
        return PlanError(f"{self.text}: {sentence}")

    def fail(self, sentence: str) -> NoReturn:
        raise self.error(sentence)

    def version(self, raw: Mapping[str, Any], expected: int) -> None:
        """Accepts only the version this reader knows."""
        if raw.get("version") != expected:
            self.fail(f"version must be {expected}, not {raw.get('version')}")

    def section(self, raw: Any, key: str) -> dict[str, Any]:
        value = raw.get(key) if isinstance(raw, dict) else None
        if not isinstance(value, dict):
            self.fail(f'"{key}" is missing or not an object')
        return value

    def rows(self, raw: Any, key: str) -> list[Any]:
        value = raw.get(key) if isinstance(raw, dict) else None
        if not isinstance(value, list):
            self.fail(f'"{key}" is missing or not a list')
        return value

    def number(self, value: Any, field: str) -> float:
        if not _is_number(value):
            self.fail(f"{field} must be a finite number")
        return float(value)

    def integer(self, value: Any, field: str, maximum: int) -> int:
        if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value <= maximum:
            self.fail(f"{field} must be a whole number from 0 to {maximum}")
        return value

    def numbers_or_null(self, values: Any, field: str, count: int) -> tuple[float, ...]:
        """Numbers of which any may be left open: null becomes NaN."""
        if (
            not isinstance(values, list)
            or len(values) != count
            or not all(value is None or _is_number(value) for value in values)
        ):
            self.fail(f"{field} must be {count} numbers or null")
        return tuple(nan if value is None else float(value) for value in values)

    def lat_lon(self, values: Any, field: str) -> tuple[float, float]:
        if not isinstance(values, list) or len(values) != 2 or not all(_is_number(value) for value in values):
            self.fail(f"{field} must be latitude and longitude")
        self.check_lat_lon(values[0], values[1], field)
        return float(values[0]), float(values[1])

    def geo_point(self, values: Any, field: str) -> GeoPoint:
        if not isinstance(values, list) or len(values) != 3 or not all(_is_number(value) for value in values):
            self.fail(f"{field} must be latitude, longitude and altitude")
        self.check_lat_lon(values[0], values[1], field)
        return GeoPoint(*(float(value) for value in values))

    def check_lat_lon(self, lat_deg: float, lon_deg: float, field: str) -> None:
        """Accepts NaN, which leaves the coordinate open."""
        if abs(lat_deg) > 90.0:
            self.fail(f"{field}: latitude {lat_deg:g} is not within ±90 degrees")
        if abs(lon_deg) > 180.0:
            self.fail(f"{field}: longitude {lon_deg:g} is not within ±180 degrees")


def check_item(item: MissionItem, location: Location) -> MissionItem:
    """The item, if its frame is known and its position is on earth and as complete as its command needs."""
    if item.frame not in KNOWN_FRAMES:
        location.fail(f"frame {item.frame} is not one of {', '.join(map(str, KNOWN_FRAMES))}")
    if item.command in FENCE_AND_RALLY_COMMANDS:
        location.fail(f"command {item.command} belongs to a fence or rally file, not to a mission")
    if item.command in COMMANDS_WITH_POSITION:
        location.check_lat_lon(item.x, item.y, "params")
    if item.command in COMMANDS_THAT_NEED_POSITION:
        for name, value in (("latitude", item.x), ("longitude", item.y), ("altitude", item.z)):
            if isnan(value):
                location.fail(f"command {item.command} needs its {name}")
    return item


def _is_number(value: Any) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) <= FLOAT32_MAX and isfinite(value)
