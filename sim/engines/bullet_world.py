"""What stands in a world as shapes of Bullet's: terrain at once, trees and boxes as somebody comes near."""

from math import atan2, cos, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.engines.quiet_bullet import pybullet
from sim.world.world import WorldMap

REACH_M = 15.0  # from a vehicle, to which trees and boxes are there
_AGAIN_M = 5.0  # after so much way it is looked for more
_NEAR_M = 3.0
_WALL_M, _DEEP_M = 1.0, 100.0  # thickness of the walls round the map, and how far down they go


class BulletWorld:
    """The solid things of one world.

    Args:
        world: ours.
        client: of Bullet.
    """

    def __init__(self, world: WorldMap, client: int) -> None:
        self._map, self._client = world, client
        self.ground = self._make_ground()
        self.is_near = False  # whether an obstacle may be touched
        self._seen_at: NDArray[Any] | None = None  # [m] of the vehicles, when things were last put there
        self._looked_at: NDArray[Any] | None = None  # [m] when it was last asked how near the next thing is
        self._free_m = 0.0  # way since then, within which nothing new can be near
        self._trees: set[int] = set()
        self._boxes = [self._make_box(row) for row in world.boxes.rows]
        if world.walls.is_built:
            self._make_walls()
        self._make_solids()

    def furnish(self, pos_ned: NDArray[Any], tick: int) -> None:
        """Puts there what is near vehicles, shape (vehicles, 3), and the boxes where they are at a tick."""
        if self._boxes:
            self._place_boxes(tick)
        if self._seen_at is None or np.abs(pos_ned - self._seen_at).max() > _AGAIN_M:
            self._seen_at = pos_ned.copy()
            trees = self._map.trees
            for place in pos_ned:
                away = np.hypot(trees["north"] - place[0], trees["east"] - place[1]) - trees["crown_radius"]
                for k in np.flatnonzero(away < REACH_M):
                    if int(k) not in self._trees:
                        self._trees.add(int(k))
                        self._plant(trees[k])
        self._look(pos_ned, tick)

    def _look(self, pos_ned: NDArray[Any], tick: int) -> None:
        """Whether something is near; not again before anybody can have come nearer."""
        if self._boxes or self._looked_at is None or np.abs(pos_ned - self._looked_at).max() > self._free_m:
            nearest_m = float(self._map.obstacle_distance(pos_ned, tick).min())
            self._looked_at, self._free_m = pos_ned.copy(), 0.5 * max(nearest_m - _NEAR_M, 0.5)
            self.is_near = nearest_m < _NEAR_M

    def _make_ground(self) -> int:
        """The terrain's own triangles: rows to the west, so that the diagonals of both agree."""
        heights, cell_m = self._map.heights, self._map.terrain.size_m / self._map.terrain.cells
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_HEIGHTFIELD,
            meshScale=[cell_m, cell_m, 1.0],
            heightfieldData=heights[:, ::-1].T.ravel().astype(float).tolist(),
            numHeightfieldRows=heights.shape[0],
            numHeightfieldColumns=heights.shape[1],
            physicsClientId=self._client,
        )
        middle = 0.5 * (float(heights.min()) + float(heights.max()))
        return self._fix(shape, (0.0, 0.0, middle))

    def _plant(self, tree: Any) -> None:
        """A trunk and a crown: a cylinder and a capsule, upright."""
        north, west = float(tree["north"]), -float(tree["east"])
        low, high, root = (float(tree[name]) for name in ("crown_low", "crown_high", "root_height"))
        for kind, radius, bottom, top in (
            (pybullet.GEOM_CYLINDER, tree["trunk_radius"], root, low),
            (pybullet.GEOM_CAPSULE, tree["crown_radius"], low, high),
        ):
            shape = pybullet.createCollisionShape(
                kind, radius=float(radius), height=max(top - bottom, 0.01), physicsClientId=self._client
            )
            self._fix(shape, (north, west, 0.5 * (bottom + top)))

    def _make_box(self, row: Any) -> int:
        half = [float(row["half_length"]), float(row["half_width"]), 0.5 * float(row["high"] - row["low"])]
        shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=self._client)
        return self._fix(shape, (0.0, 0.0, 0.0))

    def _place_boxes(self, tick: int) -> None:
        rows = self._map.boxes.rows
        for body, row, (north, east) in zip(self._boxes, rows, self._map.boxes.middle(tick), strict=True):
            yaw = -atan2(float(row["sin_yaw"]), float(row["cos_yaw"]))
            place = [float(north), -float(east), 0.5 * float(row["low"] + row["high"])]
            turn = [0.0, 0.0, sin(0.5 * yaw), cos(0.5 * yaw)]
            pybullet.resetBasePositionAndOrientation(body, place, turn, physicsClientId=self._client)

    def _make_walls(self) -> None:
        walls = self._map.walls
        inner, top = walls.half_size_m, walls.top_m
        middle, up = inner + 0.5 * _WALL_M, 0.5 * (top - _DEEP_M)
        for north, west, half in (
            (middle, 0.0, (0.5 * _WALL_M, inner + _WALL_M)),
            (-middle, 0.0, (0.5 * _WALL_M, inner + _WALL_M)),
            (0.0, middle, (inner, 0.5 * _WALL_M)),
            (0.0, -middle, (inner, 0.5 * _WALL_M)),
        ):
            extents = [*half, 0.5 * (top + _DEEP_M)]
            shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=extents, physicsClientId=self._client)
            self._fix(shape, (north, west, up))

    def _make_solids(self) -> None:
        """The triangles of a world file, as they are."""
        for part in self._map.solids.parts:
            vertices = part.vertices_ned.astype(float) * np.array([1.0, -1.0, -1.0])
            shape = pybullet.createCollisionShape(
                pybullet.GEOM_MESH,
                vertices=vertices.tolist(),
                indices=part.faces.ravel().tolist(),
                flags=pybullet.GEOM_FORCE_CONCAVE_TRIMESH,
                physicsClientId=self._client,
            )
            self._fix(shape, (0.0, 0.0, 0.0))

    def _fix(self, shape: int, place: tuple[float, float, float]) -> int:
        """A body that stays where it is."""
        body: int = pybullet.createMultiBody(0.0, shape, basePosition=place, physicsClientId=self._client)
        pybullet.changeDynamics(body, -1, lateralFriction=1.0, restitution=0.0, physicsClientId=self._client)
        return body
