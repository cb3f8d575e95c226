"""The mission by which a plane lands that has no command to: down a circle, then straight on to the touchdown."""

from math import cos, sin

from common.geodesy import GeoPoint, geodetic_from_ned
from mission.plan.plan_file import PlanItem

CMD_LOITER_TO_ALT, CMD_LAND = 31, 21
FRAME_RELATIVE = 3
_RADIUS_M = 80.0  # of the circle
_ENTRY_M = 30.0  # height of the entry of the slope: guess, over trees
_AWAY_M = 480.0  # of the entry from the touchdown: 3.6 degrees, as in the plan that comes with the project


def landing_items(place: GeoPoint, yaw_rad: float) -> list[PlanItem]:
    """Lands at a place in a direction; the circle lies to the right of the way, and is left along it."""
    along, across = (cos(yaw_rad), sin(yaw_rad)), (-sin(yaw_rad), cos(yaw_rad))
    north_m, east_m = (_RADIUS_M * to_right - _AWAY_M * ahead for ahead, to_right in zip(along, across, strict=True))
    lat_deg, lon_deg, _ = geodetic_from_ned(north_m, east_m, 0.0, place)
    leaves_along_the_circle = (1.0, _RADIUS_M, 0.0, 1.0)
    return [
        PlanItem(0, FRAME_RELATIVE, CMD_LOITER_TO_ALT, leaves_along_the_circle, lat_deg, lon_deg, _ENTRY_M),
        PlanItem(1, FRAME_RELATIVE, CMD_LAND, (0.0,) * 4, place.lat_deg, place.lon_deg, 0.0),
    ]
