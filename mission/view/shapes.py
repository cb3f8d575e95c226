"""The world's things as triangles, for the page in the browser and for the HTML file.

In: a `WorldMap`, an airframe. Out: vertices in ned [m] (or in the body's frd), faces that run counter-clockwise seen
from outside, and colours with the light already in them where nobody lights them later. Made once per flight.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from common.airframe import Airframe
from common.airframes.multirotor import MultirotorAirframe
from common.airframes.plane import PlaneAirframe
from common.airframes.rover import RoverAirframe
from common.attitude import Quat, quat_of
from mission.view.vehicle_shapes.mesh import (
    BARK,
    LEAVES,
    Floats,
    Mesh,
    ball,
    beam,
    box,
    divided,
    joined,
    painted,
    trunk,
)  # fmt: skip
from mission.view.vehicle_shapes.plane import plane

if TYPE_CHECKING:  # the vehicles alone are light to import
    from sim.world.custom.solid_parts import SolidPart
    from sim.world.world import WorldMap

__all__ = [
    "BARK", "BLADE", "FRAME", "SUN_NED", "Mesh", "Trees", "VehicleShape", "ball", "beam", "blade_radius_m", "box",
    "boxes", "ground", "hubs_frd", "joined", "moving_boxes", "multirotor", "person", "standing", "trees", "trunk",
    "vehicle", "walls", "wheel_attitude",
]  # fmt: skip

SUN_NED = np.array([-0.60, 0.51, -0.62], np.float32)  # where the light comes from: as in the cameras' images, nearly
GRASS, MEADOW, EARTH = (np.array(rgb, np.float32) for rgb in ((92, 122, 58), (140, 150, 82), (150, 130, 96)))  # sRGB

CONCRETE = (168, 164, 158)
JACKET, TROUSERS, SKIN = (24, 74, 196), (52, 58, 74), (222, 184, 152)
BOX_M, NOSE_M = (0.5, 0.3, 0.15), (0.1, 0.15, 0.1)  # of a vehicle whose shape is not known
FRAME, BLADE = (48, 52, 60), (30, 32, 36)
TYRE, SPOKE, MARK = (34, 34, 38), (150, 156, 164), (236, 236, 240)
WHEEL_SIDES, SPOKES = 14, 4
BOX_TOP = (8, 9)  # of a box's faces


@dataclass(frozen=True, eq=False, slots=True)
class Trees:
    """Trunks are `trunk()` and crowns `ball()`, each scaled and moved."""

    trunk_ned: Floats  # (trees, 3) middle of each
    trunk_size: Floats  # (trees, 3)
    crown_ned: Floats
    crown_size: Floats
    crown_colours: NDArray[np.uint8]  # (trees, 3)


def ground(world: "WorldMap", cells_most: int = 256) -> Mesh:
    """The terrain, hill-shaded; its grid is thinned so that a side has at most `cells_most` cells."""
    half_m = 0.5 * world.config.size_m
    count = min(world.heights.shape[0], cells_most + 1)
    side = np.linspace(-half_m, half_m, count)
    north, east = np.meshgrid(side, side, indexing="ij")
    vertices = np.stack([north, east, -world.height(north, east)], axis=-1).reshape(-1, 3).astype(np.float32)
    normal_ned = world.normal_ned(north, east).reshape(-1, 3)
    corner = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).reshape(-1)
    faces = np.concatenate(
        [
            np.stack([corner, corner + count + 1, corner + count], axis=1),
            np.stack([corner, corner + 1, corner + count + 1], axis=1),
        ]
    )
    patches = 0.5 + 0.5 * np.sin(0.11 * north + np.sin(0.07 * east)) * np.sin(0.13 * east + np.sin(0.05 * north))
    steep = np.clip((1.0 + normal_ned[:, 2:]) * 8.0, 0.0, 1.0)
    colour = GRASS + patches.reshape(-1, 1) * (MEADOW - GRASS)
    colour = colour + steep * (EARTH - colour)
    sun = SUN_NED / np.linalg.norm(SUN_NED)
    light = 0.45 + 0.85 * np.clip(normal_ned @ sun, 0.0, 1.0)
    return Mesh(vertices, faces.astype(np.uint32), np.clip(colour * light[:, None], 0, 255).astype(np.uint8))


def trees(world: "WorldMap") -> Trees:
    """Every tree; a crown is drawn as the ellipsoid round its capsule's axis."""
    rows = world.trees
    crown_half_m = 0.5 * (rows["crown_high"] - rows["crown_low"]) + rows["crown_radius"]
    trunk_half_m = 0.5 * (rows["crown_low"] - rows["root_height"])
    radius, thick = rows["crown_radius"], rows["trunk_radius"]
    shade = (np.abs(np.sin(12.9898 * rows["north"] + 78.233 * rows["east"])) % 1.0)[:, None]
    dark, light = (np.array(rgb, np.float32) for rgb in LEAVES)
    return Trees(
        np.stack([rows["north"], rows["east"], -0.5 * (rows["crown_low"] + rows["root_height"])], axis=1),
        np.stack([thick, thick, trunk_half_m], axis=1),
        np.stack([rows["north"], rows["east"], -0.5 * (rows["crown_low"] + rows["crown_high"])], axis=1),
        np.stack([radius, radius, crown_half_m], axis=1),
        (dark + shade * (light - dark)).astype(np.uint8),
    )


def walls(world: "WorldMap") -> Mesh | None:
    """The ring of walls round the map, if there is one."""
    from sim.world.walls import WALL_THICKNESS_M

    if not world.config.has_walls:
        return None
    half_m = 0.5 * world.config.size_m
    low_m, top_m = float(world.heights.min()) - 1.0, world.walls.top_m
    middle, length = half_m + 0.5 * WALL_THICKNESS_M, 2.0 * (half_m + WALL_THICKNESS_M)
    up = (-0.5 * (low_m + top_m), top_m - low_m)
    boxes = [
        box(centre, size, CONCRETE)
        for sign in (1.0, -1.0)
        for centre, size in (
            ((sign * middle, 0.0, up[0]), (WALL_THICKNESS_M, length, up[1])),
            ((0.0, sign * middle, up[0]), (length, WALL_THICKNESS_M, up[1])),
        )
    ]
    return joined(boxes)


def boxes(world: "WorldMap", tick: int = 0, *, movers: bool = True) -> Mesh | None:
    """The boxes in the world, as they are at a tick, with those that move or without; None if there are none."""
    rows = world.boxes.rows
    meshes = [
        Mesh(mesh.vertices + np.array([north, east, 0.0], np.float32), mesh.faces, mesh.colours)
        for row, (north, east) in zip(rows, world.boxes.middle(tick), strict=True)
        if movers or row["period_ticks"] == 0
        for mesh in [_box_round_middle(row)]
    ]
    return joined(meshes) if meshes else None


def standing(world: "WorldMap") -> Mesh | None:
    """All boxes that stand and all solids of a world file, each part in one colour; None if there are none."""
    still = boxes(world, movers=False)
    meshes = [*([] if still is None else [still]), *(_in_one_colour(part) for part in world.solids.parts)]
    return joined(meshes) if meshes else None


def _in_one_colour(part: "SolidPart") -> Mesh:
    """That of an image is its mean."""
    rgb = part.rgb if part.image is None else part.image.reshape(-1, 3).mean(axis=0)
    colours = np.tile(np.array(rgb, np.uint8), (len(part.vertices_ned), 1))
    return Mesh(part.vertices_ned, part.faces.astype(np.uint32), colours)


def moving_boxes(world: "WorldMap") -> list[tuple[int, Mesh]]:
    """Those that run to and fro: which of the world's boxes, and its shape round its middle on the map."""
    rows = world.boxes.rows
    return [(i, _box_round_middle(rows[i])) for i in range(len(rows)) if rows[i]["period_ticks"] > 0]


def _box_round_middle(row: Any) -> Mesh:
    size = (2.0 * float(row["half_length"]), 2.0 * float(row["half_width"]), float(row["high"] - row["low"]))
    colour = CONCRETE if row["period_ticks"] == 0 else JACKET
    mesh = box((0.0, 0.0, -0.5 * float(row["high"] + row["low"])), size, colour)
    cos, sin = float(row["cos_yaw"]), float(row["sin_yaw"])
    turn = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]], np.float32)
    return Mesh((mesh.vertices @ turn).astype(np.float32), mesh.faces, mesh.colours)


class VehicleShape(NamedTuple):
    """What a vehicle looks like, in frd."""

    body: Mesh
    blade: Mesh
    """What turns at each hub."""
    hubs: Floats
    """[m] (hubs, 3)"""
    spins: Sequence[int]
    """Of each hub: +1 counter-clockwise seen from above, -1 clockwise."""
    blade_radius_m: float
    wheels: Sequence[Mesh] = ()
    """Each round its hub, the axle along y; in the order of their speeds in the truth."""
    wheel_hubs: Floats = np.zeros((0, 3), np.float32)
    """[m] (wheels, 3)"""
    is_steered: Sequence[bool] = ()
    """Of each wheel."""

    @property
    def drives(self) -> bool:
        return len(self.wheels) > 0


def vehicle(airframe: Airframe) -> VehicleShape:
    """The shape of a vehicle; a plain box where its class's is not known."""
    no_blade, no_hubs = box((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), BLADE), np.zeros((0, 3), np.float32)
    if isinstance(airframe, RoverAirframe):
        hubs, steered = wheel_hubs_frd(airframe), (not airframe.is_skid,) * 2 + (False,) * 2
        return VehicleShape(rover(airframe), no_blade, no_hubs, (), 0.0, (wheel(airframe),) * len(hubs), hubs, steered)
    if isinstance(airframe, PlaneAirframe):
        return VehicleShape(plane(airframe), no_blade, no_hubs, (), 0.0)
    if not isinstance(airframe, MultirotorAirframe):
        body = joined([box((0.0, 0.0, 0.0), BOX_M, FRAME), box((0.5 * BOX_M[0], 0.0, 0.0), NOSE_M, JACKET)])
        return VehicleShape(body, no_blade, no_hubs, (), 0.0)
    spins = [rotor.spin for rotor in airframe.rotors]
    return VehicleShape(multirotor(airframe), blade(airframe), hubs_frd(airframe), spins, blade_radius_m(airframe))


def multirotor(airframe: MultirotorAirframe) -> Mesh:
    """The vehicle without its rotors, in frd: a hull, a nose that shows the heading, an arm and a motor for each."""
    hubs = hubs_frd(airframe)
    span_m = float(np.abs(hubs[:, :2]).max())
    parts = [
        box((0.0, 0.0, 0.0), (1.1 * span_m, 0.6 * span_m, 0.35 * span_m), FRAME),
        box((0.55 * span_m, 0.0, 0.0), (0.2 * span_m, 0.35 * span_m, 0.25 * span_m), JACKET),
    ]
    for hub in hubs:
        parts.append(beam((0.0, 0.0, 0.0), hub, 0.06 * span_m, FRAME))
        parts.append(box(hub, (0.15 * span_m, 0.15 * span_m, 0.2 * span_m), FRAME))
    return joined(parts)


def blade(airframe: MultirotorAirframe) -> Mesh:
    """Two blades across the hub, along x, in frd."""
    radius_m = blade_radius_m(airframe)
    return box((0.0, 0.0, 0.0), (2.0 * radius_m, 0.12 * radius_m, 0.02 * radius_m), BLADE)


def hubs_frd(airframe: MultirotorAirframe) -> Floats:
    """Places of the rotors [m], (rotors, 3)."""
    return np.array([(rotor.x_m, rotor.y_m, rotor.z_m) for rotor in airframe.rotors], np.float32)


def blade_radius_m(airframe: MultirotorAirframe) -> float:
    """As large as neighbours leave room for; the flight model knows thrust, not size."""
    hubs = hubs_frd(airframe)
    gaps = np.linalg.norm(hubs[:, None] - hubs[None, :], axis=2)
    return 0.45 * float(gaps[gaps > 0.0].min())


def rover(airframe: RoverAirframe) -> Mesh:
    """The vehicle without its wheels, in frd: a hull between them, a lid, a bumper at each end, the front one blue."""
    hull = airframe.hull
    length_m, middle_m = hull.front_m + hull.rear_m, 0.5 * (hull.front_m - hull.rear_m)
    between_m = airframe.wheels.track_m - tread_m(airframe) - 0.02
    deck_m = -0.35 * hull.top_m  # above it the lid, down being positive
    tall_m = hull.bottom_m - deck_m
    centre_z_m = 0.5 * (hull.bottom_m + deck_m)
    bumper = (0.04 * length_m, 2.0 * hull.half_width_m, 0.4 * tall_m)
    lid_m, ends_m = hull.top_m + deck_m, (-0.46, -0.35, 0.15, 0.46)  # of the length: the lid is on the middle part
    parts = [
        box((hull.front_m - 0.5 * bumper[0], 0.0, centre_z_m), bumper, JACKET),
        box((-hull.rear_m + 0.5 * bumper[0], 0.0, centre_z_m), bumper, FRAME),
    ]
    for low, high in pairwise(ends_m):
        middle_x_m, part_m = middle_m + 0.5 * (low + high) * length_m, (high - low) * length_m
        part = box((middle_x_m, 0.0, centre_z_m), (part_m, between_m, tall_m), FRAME)
        if low == ends_m[1]:
            part = Mesh(part.vertices, np.delete(part.faces, BOX_TOP, axis=0), part.colours)  # nothing shows through
            parts.append(box((middle_x_m, 0.0, deck_m - 0.5 * lid_m), (part_m, between_m, lid_m), CONCRETE))
        parts.append(part)
    body = joined(parts)
    return divided(divided(body))


def wheel(airframe: RoverAirframe) -> Mesh:
    """One wheel round its hub, the axle along y: a tyre with light spokes on both sides, one of them brighter."""
    radius_m, half_m = airframe.wheels.radius_m, 0.5 * tread_m(airframe)
    angle = np.arange(WHEEL_SIDES) * 2.0 * np.pi / WHEEL_SIDES
    ring = np.column_stack([radius_m * np.cos(angle), np.zeros(WHEEL_SIDES), radius_m * np.sin(angle)])
    side = np.array([0.0, half_m, 0.0])
    here, there = np.arange(WHEEL_SIDES), (np.arange(WHEEL_SIDES) + 1) % WHEEL_SIDES
    tread = np.concatenate(
        [np.stack([here, here + WHEEL_SIDES, there], 1), np.stack([there, here + WHEEL_SIDES, there + WHEEL_SIDES], 1)]
    )
    left, right = np.full(WHEEL_SIDES, 2 * WHEEL_SIDES), np.full(WHEEL_SIDES, 2 * WHEEL_SIDES + 1)
    caps = [np.stack([left, here, there], 1), np.stack([right, there + WHEEL_SIDES, here + WHEEL_SIDES], 1)]
    vertices = np.concatenate([ring - side, ring + side, [-side, side]]).astype(np.float32)
    parts = [painted(vertices, np.concatenate([tread, *caps]).astype(np.uint32), TYRE)]
    for k in range(SPOKES):
        turn = 2.0 * np.pi * k / SPOKES
        spoke = box((0.4 * radius_m, 0.0, 0.0), (0.72 * radius_m, 2.1 * half_m, 0.2 * radius_m), SPOKE if k else MARK)
        cos, sin = np.cos(turn), np.sin(turn)
        about_y = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]], np.float32)
        parts.append(Mesh((spoke.vertices @ about_y).astype(np.float32), spoke.faces, spoke.colours))
    return joined(parts)


def tread_m(airframe: RoverAirframe) -> float:
    """How wide a tyre is: the hull's box has the wheels in it."""
    return 2.0 * max(airframe.hull.half_width_m - 0.5 * airframe.wheels.track_m, 0.01)


def wheel_hubs_frd(airframe: RoverAirframe) -> Floats:
    """Places of the wheels [m], (4, 3): front left, front right, rear left, rear right."""
    wheels = airframe.wheels
    ends, sides = (wheels.front_x_m, -wheels.rear_x_m), (-0.5 * wheels.track_m, 0.5 * wheels.track_m)
    return np.array([(x, y, wheels.hub_z_m) for x in ends for y in sides], np.float32)


def wheel_attitude(turned_rad: float, steering_rad: float) -> Quat:
    """Of a wheel that has rolled forwards by an angle and is steered to the right; q_frd_from_wheel."""
    return quat_of(steering_rad, -turned_rad)


def person(stature_m: float) -> Mesh:
    """A standing person, in hfrd round the feet: legs, body with arms, head."""
    h = stature_m
    parts = [box((0.0, side * 0.055 * h, -0.24 * h), (0.09 * h, 0.085 * h, 0.48 * h), TROUSERS) for side in (-1.0, 1.0)]
    parts += [box((0.0, side * 0.145 * h, -0.62 * h), (0.07 * h, 0.06 * h, 0.36 * h), JACKET) for side in (-1.0, 1.0)]
    parts.append(box((0.0, 0.0, -0.65 * h), (0.13 * h, 0.22 * h, 0.36 * h), JACKET))
    head = ball()
    radius = np.array([0.075, 0.07, 0.09], np.float32) * h
    parts.append(painted(head.vertices * radius + np.array([0.0, 0.0, -0.92 * h], np.float32), head.faces, SKIN))
    return joined(parts)
