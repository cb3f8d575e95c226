"""The `QGC WPL 110` text format: one mission item a line, twelve columns separated by tabs, item 0 is the home.

Columns: number, current, frame, command, four parameters, x (latitude), y (longitude), z (altitude), autocontinue.
"""

from dataclasses import replace
from math import isnan, nan

from autopilot.interface.item_lists import MissionItem
from common.geodesy import GeoPoint
from mission.plan.plan_checks import DO_JUMP, FLOAT32_MAX, FRAME_GLOBAL, NAV_WAYPOINT, Location, check_item

HEADER_START = "QGC WPL"
HEADER = "QGC WPL 110"
COLUMNS = 12


def parse_waypoints(text: str, location: Location) -> tuple[GeoPoint | None, tuple[MissionItem, ...]]:
    """The home, None if it is left at 0, 0, and the items, numbered from 0 without it.

    Raises:
        PlanError: the text is truncated or wrong.
    """
    header, *lines = text.splitlines()
    if header.strip() != HEADER:
        location.fail(f"the first line must be {HEADER}, not {header.strip()[:40]}")
    items: list[MissionItem] = []
    for line_number, line in enumerate(lines, 2):
        if line.strip():
            items.append(_item(line, len(items), location.inside(f"item {len(items)} (line {line_number})")))
    if len(items) < 2:
        location.fail("the mission has no items after the home")
    home, *rest = items
    has_home = not (isnan(home.x) or isnan(home.y) or isnan(home.z)) and (home.x, home.y) != (0.0, 0.0)
    point = GeoPoint(home.x, home.y, home.z) if has_home else None
    return point, tuple(_shifted(item, len(rest), location) for item in rest)


def waypoints_text(home: GeoPoint | None, items: tuple[MissionItem, ...]) -> str:
    """The items in this format, behind their home."""
    point = home or GeoPoint(0.0, 0.0, 0.0)
    first = MissionItem(0, FRAME_GLOBAL, NAV_WAYPOINT, (0.0,) * 4, point.lat_deg, point.lon_deg, point.alt_m)
    lines = [HEADER, _line(0, first)]
    for item in items:
        target = (item.params[0] + 1.0, *item.params[1:]) if item.command == DO_JUMP else item.params
        lines.append(_line(item.seq + 1, replace(item, params=target)))
    return "\n".join(lines) + "\n"


def _item(line: str, number: int, location: Location) -> MissionItem:
    columns = line.split()
    if len(columns) != COLUMNS:
        location.fail(f"a line must have {COLUMNS} columns, not {len(columns)}: is the file complete?")
    try:
        seq, frame, command, autocontinue = (int(columns[k]) for k in (0, 2, 3, 11))
    except ValueError:
        location.fail("number, frame, command and autocontinue must be whole numbers")
    if seq != number:
        location.fail(f"items must be numbered 0, 1, 2 and so on, not {seq}")
    location.integer(command, "command", 0xFFFF)
    values: list[float] = []
    for name, column in zip(("p1", "p2", "p3", "p4", "x", "y", "z"), columns[4:11], strict=True):
        try:
            value = float(column)
        except ValueError:
            location.fail(f"{name} must be a number, not {column[:40]}")
        if abs(value) > FLOAT32_MAX:
            location.fail(f"{name} must be finite")
        values.append(nan if isnan(value) else value)  # one NaN object, so that equal items compare equal
    p1, p2, p3, p4, x, y, z = values
    return check_item(MissionItem(seq, frame, command, (p1, p2, p3, p4), x, y, z, autocontinue != 0), location)


def _shifted(item: MissionItem, item_count: int, location: Location) -> MissionItem:
    """The item as it is numbered without the home, its jump target too."""
    shifted = replace(item, seq=item.seq - 1)
    if item.command == DO_JUMP:
        if not 1.0 <= item.params[0] <= item_count:
            location.inside(f"item {item.seq}").fail(f"jumps to item {item.params[0]:g}, which does not exist")
        shifted = replace(shifted, params=(item.params[0] - 1.0, *item.params[1:]))
    return shifted


def _line(number: int, item: MissionItem) -> str:
    values = (repr(float(value)).removesuffix(".0") for value in (*item.params, item.x, item.y, item.z))
    head = f"{number}\t{int(number == 0)}\t{item.frame}\t{item.command}"
    return "\t".join((head, *values, str(int(item.autocontinue))))
