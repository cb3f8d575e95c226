"""Plan files: a QGroundControl `.plan` or a `QGC WPL 110` text, read into the items the mission protocol uploads.

Items are numbered as they are uploaded, from 0, without the home item of `QGC WPL 110`; DO_JUMP targets follow. Numbers
left open (null in a .plan) are NaN. A survey or corridor is flattened to the items that its planner stored with it; its
own definition is kept, so that writing the plan again loses nothing. A wrong file gets a `PlanError` for its user.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.resources import files
from math import isnan
from pathlib import Path
from typing import Any, TypeVar

from autopilot.interface.item_lists import MissionItem
from common.files import write_whole
from common.geodesy import GeoPoint, geodetic_from_ned, ned_from_geodetic
from mission.plan.plan_checks import COMMANDS_WITH_POSITION, DO_JUMP, Location, PlanError, check_item
from mission.plan.waypoints import HEADER_START, parse_waypoints, waypoints_text

__all__ = [
    "DEFAULT_PLAN",
    "ComplexItem",
    "FenceCircle",
    "FencePolygon",
    "Plan",
    "PlanError",
    "PlanItem",
    "default_plan",
    "moved_plan",
    "parse_plan",
    "plan_text",
    "read_plan",
    "save_plan",
]

T = TypeVar("T")
D = TypeVar("D")

PlanItem = MissionItem  # the record that the vehicle keeps too

DEFAULT_PLAN = Path(str(files("mission"))) / "default.plan"
MAV_AUTOPILOT_PX4 = 12
MAV_TYPE_QUADROTOR = 2
RELATIVE_FRAMES = (3, 6)  # MAV_FRAME_GLOBAL_RELATIVE_ALT and its _INT


@dataclass(frozen=True, slots=True)
class FenceCircle:
    """Stay inside (inclusion) or outside of a circle."""

    lat_deg: float
    lon_deg: float
    radius_m: float
    is_inclusion: bool


@dataclass(frozen=True, slots=True)
class FencePolygon:
    """Stay inside (inclusion) or outside of a polygon."""

    vertices_deg: tuple[tuple[float, float], ...]  # latitude, longitude
    is_inclusion: bool


@dataclass(frozen=True, slots=True)
class ComplexItem:
    """A survey or corridor as its planner defined it, and the uploaded items it stands for."""

    first_seq: int
    item_count: int
    definition_json: str


@dataclass(frozen=True, slots=True)
class Plan:
    """A mission with its fence and rally points."""

    items: tuple[PlanItem, ...]
    home: GeoPoint | None = None  # planned; in flight the vehicle's own home counts
    fence: tuple[FenceCircle | FencePolygon, ...] = ()
    rally: tuple[GeoPoint, ...] = ()  # altitudes above home
    cruise_speed_m_s: float = 15.0  # QGroundControl's default; in flight the vehicle's parameters count
    hover_speed_m_s: float = 5.0
    complex_items: tuple[ComplexItem, ...] = ()


def default_plan(vehicle: str) -> Path:
    """The plan of a class of vehicles that fits the default world."""
    own = DEFAULT_PLAN.with_name(f"default-{vehicle}.plan")
    return own if own.is_file() else DEFAULT_PLAN


def moved_plan(plan: Plan, home: GeoPoint) -> Plan:
    """The plan carried from its planned home to another, keeping distances, directions and heights above home.

    Fence and rally points stay behind: they belong to the place.
    """
    if plan.home is None:
        return plan
    return replace(
        plan, home=home, fence=(), rally=(), items=tuple(_moved(item, plan.home, home) for item in plan.items)
    )


def _moved(item: PlanItem, old: GeoPoint, new: GeoPoint) -> PlanItem:
    if item.command not in COMMANDS_WITH_POSITION or isnan(item.x) or isnan(item.y):
        return item
    north, east, _ = ned_from_geodetic(item.x, item.y, old.alt_m, old)
    lat_deg, lon_deg, _ = geodetic_from_ned(north, east, 0.0, new)
    rise_m = 0.0 if item.frame in RELATIVE_FRAMES else new.alt_m - old.alt_m
    return replace(item, x=lat_deg, y=lon_deg, z=item.z + rise_m)


def read_plan(path: Path | str) -> Plan:
    """The plan in a file of either format.

    Raises:
        PlanError: the file is missing or unreadable, or holds no valid plan.
    """
    location = Location(str(path))
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise location.error("is not a text file") from None
    except OSError as error:
        raise location.error(error.strerror or str(error)) from None
    return parse_plan(text, str(path))


def parse_plan(text: str, name: str) -> Plan:
    """The plan in a text of either format; errors call it `name`.

    Raises:
        PlanError: the text holds no valid plan.
    """
    location = Location(name)
    if text.startswith(HEADER_START):
        home, items = parse_waypoints(text, location)
        return Plan(items=items, home=home)
    raw = _json(text, location)
    if not isinstance(raw, dict) or raw.get("fileType") != "Plan":
        location.fail('is neither a QGroundControl plan ("fileType": "Plan") nor a QGC WPL 110 file')
    location.version(raw, 1)
    mission = location.section(raw, "mission")
    in_mission = location.inside("mission")
    in_mission.version(mission, 2)
    items, complex_items = _items(mission, location)
    return Plan(
        items=items,
        home=_optional(mission, "plannedHomePosition", in_mission.geo_point, None),
        fence=_fence(raw, location),
        rally=_rally(raw, location),
        cruise_speed_m_s=_optional(mission, "cruiseSpeed", in_mission.number, 15.0),
        hover_speed_m_s=_optional(mission, "hoverSpeed", in_mission.number, 5.0),
        complex_items=complex_items,
    )


def save_plan(path: Path | str, plan: Plan) -> None:
    """Writes a `QGC WPL 110` file if the name ends in .waypoints or .txt (mission items only), else a .plan.

    Raises:
        OSError: the folder is missing or may not be written; an existing file is as it was.
    """
    is_text = Path(path).suffix in {".waypoints", ".txt"}
    write_whole(path, (waypoints_text(plan.home, plan.items) if is_text else plan_text(plan)).encode())


def plan_text(plan: Plan) -> str:
    """The plan as the JSON of a .plan file."""
    mission = {
        "cruiseSpeed": plan.cruise_speed_m_s,
        "firmwareType": MAV_AUTOPILOT_PX4,
        "globalPlanAltitudeMode": 1,
        "hoverSpeed": plan.hover_speed_m_s,
        "items": _items_to_json(plan),
        "vehicleType": MAV_TYPE_QUADROTOR,
        "version": 2,
    }
    if plan.home is not None:
        mission["plannedHomePosition"] = [plan.home.lat_deg, plan.home.lon_deg, plan.home.alt_m]
    circles = [
        {
            "circle": {"center": [shape.lat_deg, shape.lon_deg], "radius": shape.radius_m},
            "inclusion": shape.is_inclusion,
            "version": 1,
        }
        for shape in plan.fence
        if isinstance(shape, FenceCircle)
    ]
    polygons = [
        {"inclusion": shape.is_inclusion, "polygon": [list(vertex) for vertex in shape.vertices_deg], "version": 1}
        for shape in plan.fence
        if isinstance(shape, FencePolygon)
    ]
    document = {
        "fileType": "Plan",
        "geoFence": {"circles": circles, "polygons": polygons, "version": 2},
        "groundStation": "Honeyguide",
        "mission": mission,
        "rallyPoints": {"points": [[p.lat_deg, p.lon_deg, p.alt_m] for p in plan.rally], "version": 2},
        "version": 1,
    }
    return json.dumps(document, indent=2, allow_nan=False) + "\n"


def _json(text: str, location: Location) -> Any:
    try:
        return json.loads(text, parse_constant=lambda word: location.fail(f"{word} is not a JSON number"))
    except json.JSONDecodeError as error:
        raise location.error(f"line {error.lineno} is not valid JSON ({error.msg}): is the file complete?") from None
    except PlanError:
        raise
    except (RecursionError, ValueError):  # nested too deep, or a whole number of thousands of digits
        raise location.error("is not a plan: the JSON is nested too deep or holds an absurd number") from None


def _optional(raw: dict[str, Any], key: str, getter: Callable[[Any, str], T], default: D) -> T | D:
    return default if raw.get(key) is None else getter(raw[key], key)


def _items(mission: dict[str, Any], location: Location) -> tuple[tuple[PlanItem, ...], tuple[ComplexItem, ...]]:
    """The uploaded items, and which of them stand for a complex item."""
    raw_items: list[tuple[Any, Location]] = []
    complex_items: list[ComplexItem] = []
    for number, raw in enumerate(location.inside("mission").rows(mission, "items"), 1):
        where = location.inside(f"item {number}")
        kind = raw.get("type") if isinstance(raw, dict) else None
        if kind == "ComplexItem":
            stored = raw.get("TransectStyleComplexItem")
            rows = stored.get("Items") if isinstance(stored, dict) else None
            if not isinstance(rows, list) or not rows:
                where.fail(f"a complex item of type {raw.get('complexItemType')} without stored Items cannot be flown")
            complex_items.append(ComplexItem(len(raw_items), len(rows), json.dumps(raw)))
            raw_items += [(row, where.inside(f"stored item {k}")) for k, row in enumerate(rows, 1)]
        elif kind == "SimpleItem":
            raw_items.append((raw, where))
        else:
            where.fail("type must be SimpleItem or ComplexItem")
    if not raw_items:
        location.fail("the mission has no items")
    items = tuple(_item(raw, seq, where) for seq, (raw, where) in enumerate(raw_items))
    seq_of_jump_id = {raw.get("doJumpId", seq + 1): seq for seq, (raw, _) in enumerate(raw_items)}
    return tuple(
        _with_jump_target(item, seq_of_jump_id, where) for item, (_, where) in zip(items, raw_items, strict=True)
    ), tuple(complex_items)


def _item(raw: Any, seq: int, location: Location) -> PlanItem:
    if not isinstance(raw, dict):
        location.fail("must be an object")
    p1, p2, p3, p4, x, y, z = location.numbers_or_null(raw.get("params"), "params", 7)
    autocontinue = raw.get("autoContinue", True)
    if not isinstance(autocontinue, bool):
        location.fail("autoContinue must be true or false")
    if not isinstance(raw.get("doJumpId", 0), int):
        location.fail("doJumpId must be a whole number")
    frame = location.integer(raw.get("frame"), "frame", 0xFF)
    command = location.integer(raw.get("command"), "command", 0xFFFF)
    return check_item(PlanItem(seq, frame, command, (p1, p2, p3, p4), x, y, z, autocontinue), location)


def _with_jump_target(item: PlanItem, seq_of_jump_id: dict[int, int], location: Location) -> PlanItem:
    """The item; if it jumps, to the uploaded number of its target."""
    if item.command != DO_JUMP:
        return item
    if item.params[0] not in seq_of_jump_id:
        location.fail(f"jumps to doJumpId {item.params[0]:g}, which no item has")
    return replace(item, params=(float(seq_of_jump_id[int(item.params[0])]), *item.params[1:]))


def _fence(raw: dict[str, Any], location: Location) -> tuple[FenceCircle | FencePolygon, ...]:
    if raw.get("geoFence") is None:
        return ()
    section = location.section(raw, "geoFence")
    location = location.inside("geoFence")
    location.version(section, 2)
    shapes: list[FenceCircle | FencePolygon] = []
    for number, row in enumerate(location.rows(section, "circles"), 1):
        where = location.inside(f"circle {number}")
        circle = where.section(row, "circle")
        centre = where.lat_lon(circle.get("center"), "center")
        radius_m = where.number(circle.get("radius"), "radius")
        if radius_m <= 0.0:
            where.fail("radius must be positive")
        shapes.append(FenceCircle(*centre, radius_m, row.get("inclusion") is not False))
    for number, row in enumerate(location.rows(section, "polygons"), 1):
        where = location.inside(f"polygon {number}")
        vertices = where.rows(row, "polygon")
        if len(vertices) < 3:
            where.fail("a polygon needs at least 3 vertices")
        points = tuple(where.lat_lon(vertex, f"vertex {k}") for k, vertex in enumerate(vertices, 1))
        shapes.append(FencePolygon(points, row.get("inclusion") is not False))
    return tuple(shapes)


def _rally(raw: dict[str, Any], location: Location) -> tuple[GeoPoint, ...]:
    if raw.get("rallyPoints") is None:
        return ()
    section = location.section(raw, "rallyPoints")
    location = location.inside("rallyPoints")
    location.version(section, 2)
    return tuple(location.geo_point(row, f"point {k}") for k, row in enumerate(location.rows(section, "points"), 1))


def _items_to_json(plan: Plan) -> list[dict[str, Any]]:
    complex_by_seq = {item.first_seq: item for item in plan.complex_items}
    rows: list[dict[str, Any]] = []
    seq = 0
    while seq < len(plan.items):
        item = plan.items[seq]
        if seq in complex_by_seq:
            definition: dict[str, Any] = json.loads(complex_by_seq[seq].definition_json)
            for k, stored in enumerate(definition["TransectStyleComplexItem"]["Items"]):
                stored["doJumpId"] = seq + k + 1
            rows.append(definition)
            seq += complex_by_seq[seq].item_count
        else:
            rows.append(_item_to_json(item))
            seq += 1
    return rows


def _item_to_json(item: PlanItem) -> dict[str, Any]:
    first = item.params[0] + 1.0 if item.command == DO_JUMP else item.params[0]
    values = (first, *item.params[1:], item.x, item.y, item.z)
    row: dict[str, Any] = {
        "autoContinue": item.autocontinue,
        "command": item.command,
        "doJumpId": item.seq + 1,
        "frame": item.frame,
        "params": [None if isnan(value) else value for value in values],
        "type": "SimpleItem",
    }
    if item.command in COMMANDS_WITH_POSITION:
        is_relative = item.frame in {3, 6}
        row |= {"AMSLAltAboveTerrain": None, "Altitude": row["params"][6], "AltitudeMode": 1 if is_relative else 2}
    return row
