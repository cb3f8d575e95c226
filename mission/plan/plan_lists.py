"""A plan's fence and rally points as the lists that a vehicle takes."""

from mission.plan.plan_file import FencePolygon, Plan, PlanItem

MISSION_LIST, FENCE_LIST, RALLY_LIST = 0, 1, 2  # MAV_MISSION_TYPE
INCLUSION_VERTEX, EXCLUSION_VERTEX, INCLUSION_CIRCLE, EXCLUSION_CIRCLE = 5001, 5002, 5003, 5004
RALLY_POINT = 5100
FRAME_GLOBAL = 0
FRAME_RELATIVE = 3


def fence_items(plan: Plan) -> list[PlanItem]:
    """The plan's polygons, vertex by vertex, and circles."""
    items: list[PlanItem] = []
    for shape in plan.fence:
        if isinstance(shape, FencePolygon):
            command = INCLUSION_VERTEX if shape.is_inclusion else EXCLUSION_VERTEX
            count = float(len(shape.vertices_deg))
            for lat, lon in shape.vertices_deg:
                items.append(PlanItem(len(items), FRAME_GLOBAL, command, (count, 0.0, 0.0, 0.0), lat, lon, 0.0))
        else:
            command = INCLUSION_CIRCLE if shape.is_inclusion else EXCLUSION_CIRCLE
            params = (shape.radius_m, 0.0, 0.0, 0.0)
            items.append(PlanItem(len(items), FRAME_GLOBAL, command, params, shape.lat_deg, shape.lon_deg, 0.0))
    return items


def rally_items(plan: Plan) -> list[PlanItem]:
    """The plan's rally points."""
    return [
        PlanItem(i, FRAME_RELATIVE, RALLY_POINT, (0.0,) * 4, point.lat_deg, point.lon_deg, point.alt_m)
        for i, point in enumerate(plan.rally)
    ]
