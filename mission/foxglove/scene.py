"""The scene round the vehicle as Foxglove's 3D panel draws it: what stands, what moves, the vehicle's shape, the plan.

In: the world and the airframe. Out: SceneUpdates. Ground, walls and vehicle are triangles of the live page's shapes;
trees are a cylinder and a ball each.
"""

from collections.abc import Sequence
from math import isfinite
from typing import Any

import numpy as np
from foxglove.messages import (
    Color,
    CubePrimitive,
    CylinderPrimitive,
    LinePrimitive,
    Point3,
    Pose,
    SceneEntity,
    SceneUpdate,
    SpherePrimitive,
    TriangleListPrimitive,
    Vector3,
)

from common.airframe import Airframe
from common.attitude import quat_of
from common.kernels import TICK_US
from mission.foxglove.frames import MAP, VEHICLE, enu_from_ned, enu_points, flu_points, q_enu_from_flu
from mission.foxglove.messages import quaternion, timestamp, vector
from mission.foxglove.vehicle_state import Person, VehicleState
from mission.view import shapes
from mission.view.shapes import BARK, JACKET, Mesh
from sim.world.world import WorldMap

GROUND_CELLS = 128  # of a side; enough for hills
GOAL_M, PLAN_M = 1.0, 0.15  # diameter of the ball, thickness of the line
_UPRIGHT = quaternion((0.0, 0.0, 0.0, 1.0))
_GOAL, _PLAN = Color(r=1.0, g=0.75, b=0.0, a=0.7), Color(r=1.0, g=0.75, b=0.0, a=1.0)


def color(rgb: Sequence[Any]) -> Color:
    """Of bytes."""
    red, green, blue = (int(part) / 255.0 for part in rgb)
    return Color(r=red, g=green, b=blue, a=1.0)


def triangles(mesh: Mesh, points: Any) -> TriangleListPrimitive:
    """A mesh with its vertices in the frame of its entity.

    Args:
        mesh: its faces and colours.
        points: its vertices there [m], (n, 3).
    """
    return TriangleListPrimitive(
        pose=Pose(position=vector((0.0, 0.0, 0.0)), orientation=_UPRIGHT),
        points=[Point3(x=x, y=y, z=z) for x, y, z in points.tolist()],
        colors=[color(rgb) for rgb in mesh.colours.tolist()],
        indices=mesh.faces.reshape(-1).tolist(),
    )


def world_scene(world: WorldMap, time_us: int) -> SceneUpdate:
    """All that stands still."""
    meshes = {
        "ground": shapes.ground(world, GROUND_CELLS),
        "walls": shapes.walls(world),
        "boxes": shapes.boxes(world, movers=False),
    }
    entities = [
        _entity(time_us, MAP, name, triangles=[triangles(mesh, enu_points(mesh.vertices))])
        for name, mesh in meshes.items()
        if mesh is not None
    ]
    if len(world.trees):
        entities.append(_trees(world, time_us))
    return SceneUpdate(entities=entities)


def _trees(world: WorldMap, time_us: int) -> SceneEntity:
    trees = shapes.trees(world)
    bark = color(BARK)
    trunks = [
        CylinderPrimitive(pose=_upright(place), size=_diameters(half), bottom_scale=1.0, top_scale=1.0, color=bark)
        for place, half in zip(enu_points(trees.trunk_ned).tolist(), trees.trunk_size.tolist(), strict=True)
    ]
    crowns = [
        SpherePrimitive(pose=_upright(place), size=_diameters(half), color=color(rgb))
        for place, half, rgb in zip(
            enu_points(trees.crown_ned).tolist(), trees.crown_size.tolist(), trees.crown_colours.tolist(), strict=True
        )
    ]
    return _entity(time_us, MAP, "trees", cylinders=trunks, spheres=crowns)


def vehicle_scene(airframe: Airframe, time_us: int) -> SceneUpdate:
    """The vehicle's shape, which goes with its frame; blades and wheels stand still."""
    shape = shapes.vehicle(airframe)
    turning = [*((shape.blade, hub) for hub in shape.hubs), *zip(shape.wheels, shape.wheel_hubs, strict=True)]
    moved = [Mesh(part.vertices + hub, part.faces, part.colours) for part, hub in turning]
    mesh = shapes.joined([shape.body, *moved])
    entity = _entity(time_us, VEHICLE, "vehicle", triangles=[triangles(mesh, flu_points(mesh.vertices))])
    return SceneUpdate(entities=[entity])


def plan_scene(path_ned: Sequence[Any], time_us: int) -> SceneUpdate:
    """The way of the plan."""
    points = [Point3(x=x, y=y, z=z) for x, y, z in (enu_from_ned(point) for point in path_ned)]
    pose = Pose(position=vector((0.0, 0.0, 0.0)), orientation=_UPRIGHT)
    line = LinePrimitive(pose=pose, thickness=PLAN_M, points=points, color=_PLAN)
    return SceneUpdate(entities=[_entity(time_us, MAP, "plan", lines=[line])])


class MovingScene:
    """What moves besides the vehicle: the owner, boxes, and where the vehicle goes to.

    Args:
        world: whose boxes move.
    """

    def __init__(self, world: WorldMap | None) -> None:
        self._world = world
        self._boxes = [] if world is None else shapes.moving_boxes(world)

    def update(self, state: VehicleState) -> SceneUpdate | None:
        """As of this moment; None: there is nothing."""
        entities = self._moved_boxes(state.time_us)
        if state.owner is not None and state.owner.stature_m > 0.0:
            entities.append(_person(state.owner, state.time_us))
        if all(isfinite(part) for part in state.goal_ned):
            pose = _upright(enu_from_ned(state.goal_ned))
            ball = SpherePrimitive(pose=pose, size=Vector3(x=GOAL_M, y=GOAL_M, z=GOAL_M), color=_GOAL)
            entities.append(_entity(state.time_us, MAP, "goal", spheres=[ball]))
        return SceneUpdate(entities=entities) if entities else None

    def _moved_boxes(self, time_us: int) -> list[SceneEntity]:
        if self._world is None or not self._boxes:
            return []
        middles = self._world.boxes.middle(round(time_us / TICK_US))
        entities = []
        for i, mesh in self._boxes:
            north, east = middles[i]
            moved = mesh.vertices + np.array([north, east, 0.0], np.float32)
            parts = [triangles(mesh, enu_points(moved))]
            entities.append(_entity(time_us, MAP, f"box {i}", triangles=parts))
        return entities


def _person(person: Person, time_us: int) -> SceneEntity:
    """A body of the stature, which faces where the person looks."""
    x, y, z = enu_from_ned(person.pos_ned)
    tall = person.stature_m
    turn = quaternion(q_enu_from_flu(quat_of(person.heading_rad, 0.0)))
    pose = Pose(position=Vector3(x=x, y=y, z=z + 0.42 * tall), orientation=turn)
    body = CubePrimitive(pose=pose, size=Vector3(x=0.13 * tall, y=0.26 * tall, z=0.84 * tall), color=color(JACKET))
    head = SpherePrimitive(
        pose=_upright((x, y, z + 0.92 * tall)), size=_diameters((0.07 * tall,) * 3), color=color(shapes.SKIN)
    )
    return _entity(time_us, MAP, "owner", cubes=[body], spheres=[head])


def _entity(time_us: int, frame: str, name: str, **parts: Any) -> SceneEntity:
    """One that stays until it is sent again, and goes with its frame."""
    return SceneEntity(timestamp=timestamp(time_us), frame_id=frame, id=name, frame_locked=True, **parts)


def _upright(position: Sequence[float]) -> Pose:
    return Pose(position=vector(position), orientation=_UPRIGHT)


def _diameters(half: Sequence[float]) -> Vector3:
    x, y, z = half
    return Vector3(x=2.0 * x, y=2.0 * y, z=2.0 * z)
