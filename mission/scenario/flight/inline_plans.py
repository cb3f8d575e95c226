"""Missions and fences that a scenario says in metres, as the items that a vehicle takes."""

from collections.abc import Sequence
from math import nan

from common.geodesy import GeoPoint, geodetic_from_ned
from mission.plan.plan_file import FenceCircle, FencePolygon, Plan, PlanItem
from mission.plan.plan_lists import fence_items
from mission.scenario.parts.steps import Fence, FlyPath, Survey

WAYPOINT, RETURN, LAND, TAKEOFF, SPLINE, CHANGE_SPEED = 16, 20, 21, 22, 82, 178  # MAV_CMD
ABOVE_HOME, NO_FRAME = 3, 2  # MAV_FRAME


class _Items:
    """Items of a mission, one after the other.

    Args:
        home: origin of the points.
    """

    def __init__(self, home: GeoPoint) -> None:
        self.items: list[PlanItem] = []
        self._home = home

    def go(self, command: int, point: Sequence[float]) -> None:
        lat_deg, lon_deg, _ = geodetic_from_ned(point[0], point[1], 0.0, self._home)
        params = (0.0, 0.0, 0.0, nan)
        self.items.append(PlanItem(len(self.items), ABOVE_HOME, command, params, lat_deg, lon_deg, -point[2]))

    def speed(self, speed_m_s: float | None) -> None:
        if speed_m_s is not None:
            params = (1.0, speed_m_s, -1.0, 0.0)
            self.items.append(PlanItem(len(self.items), NO_FRAME, CHANGE_SPEED, params, 0.0, 0.0, 0.0))

    def back(self) -> None:
        self.items.append(PlanItem(len(self.items), NO_FRAME, RETURN, (0.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0))

    def plan(self) -> Plan:
        return Plan(tuple(self.items), self._home)


def path_plan(step: FlyPath, home: GeoPoint, *, drives: bool, start_ne_m: tuple[float, float] = (0.0, 0.0)) -> Plan:
    """The mission through the points; item 0 is the take-off of what flies."""
    made = _Items(home)
    if not drives:
        made.go(TAKEOFF, (*start_ne_m, step.points[0][2]))
    made.speed(step.speed_m_s)
    for point in step.points:
        made.go(SPLINE if step.is_spline else WAYPOINT, point)
    if step.end == "return":
        made.back()
    elif step.end == "land" and not drives:
        made.go(LAND, (*step.points[-1][:2], 0.0))
    return made.plan()


def survey_plan(step: Survey, home: GeoPoint, *, drives: bool) -> Plan:
    """The mission to and fro over the rectangle, and home."""
    made = _Items(home)
    if not drives:
        made.go(TAKEOFF, (0.0, 0.0, -step.height_m))
    made.speed(step.speed_m_s)
    for line in range(step.lines):
        east = step.corner_ne_m[1] + step.east_m * line / (step.lines - 1)
        along = [step.north_m * k / (step.points_per_line - 1) for k in range(step.points_per_line)]
        for north in along if line % 2 == 0 else reversed(along):
            made.go(WAYPOINT, (step.corner_ne_m[0] + north, east, -step.height_m))
    made.back()
    return made.plan()


def fence_plan_items(step: Fence, home: GeoPoint) -> list[PlanItem]:
    """The items of the fence."""

    def degrees(north: float, east: float) -> tuple[float, float]:
        lat_deg, lon_deg, _ = geodetic_from_ned(north, east, 0.0, home)
        return lat_deg, lon_deg

    is_inclusion = step.keeps == "in"
    shape: FenceCircle | FencePolygon
    if step.polygon_ne_m is not None:
        shape = FencePolygon(tuple(degrees(*vertex) for vertex in step.polygon_ne_m), is_inclusion)
    else:
        shape = FenceCircle(*degrees(*(step.circle_ne_m or (0.0, 0.0))), step.radius_m or 0.0, is_inclusion)
    return fence_items(Plan((), home, (shape,)))
